//! The analysis of a manoeuvre: its characteristic values as numbers for checks and as a table for the report, its track and its diagrams.

use diagnostics::Error;
use manoeuvre::{
    CharacteristicValue, CharacteristicValueInfo, CharacteristicValues, DiagramLayerKind, Manoeuvre,
    TestDiagramLayer,
};
use plugin::{Diagram, DiagramLayer, DiagramLayerRole, DiagramLayerShape};
use recording::{AllVariables, Sink, TestTrackLayout};
use serde_json::{Map, Value, json};
use units::display::{customary_quantity, name_with_unit, number_text, unit_text};

use crate::report::TestPicture;

/// The values of a manoeuvre, from the columns that the driver commanded and measured, in the order of [`Manoeuvre::test_log`]. The
/// pictures get that of the test, whether it has values or not.
///
/// # Errors
/// When the test did not take place.
pub(super) fn evaluate_manoeuvre(
    name: &str,
    manoeuvre: &Manoeuvre,
    time: &[f64],
    columns: &[Vec<f64>],
    pictures: &mut Vec<TestPicture>,
) -> Result<Value, Error> {
    let failed = |what: String| Error::analysis_failure(name, what);
    let Some((commands, inputs)) = columns.split_first_chunk::<3>() else {
        return Err(failed("its commands are not there".to_owned()));
    };
    let commands = commands.each_ref().map(Vec::as_slice);
    pictures.push(TestPicture::new(name, manoeuvre, time, commands[2], inputs));
    let log = manoeuvre.test_log(time, commands, inputs).map_err(failed)?;
    let picture = pictures.last_mut();
    let begin = picture.as_ref().and_then(|picture| picture.stages.first()).map_or(0.0, |(begin, _)| *begin);
    if let Some(track) = picture.and_then(|picture| picture.track.as_mut()) {
        track.set_hits(manoeuvre, &log, begin);
    }
    let values = manoeuvre.kind.characteristic_values(&manoeuvre.common, &log).map_err(failed)?;
    if let Some(picture) = pictures.last_mut() {
        picture.diagrams = manoeuvre.test_diagrams(&log, &values, begin);
    }
    Ok(manoeuvre_result_json(manoeuvre, &values))
}

/// Gives the track and the diagrams of a test to those who draw them.
///
/// # Errors
/// Those of the sink.
pub(super) fn record_test_picture(
    picture: &TestPicture,
    sink: &mut dyn Sink<AllVariables>,
) -> Result<(), Error> {
    if let Some(track) = &picture.track {
        let [hit_cones, cones] = track.hit_and_standing_cones();
        sink.push_test_track(&TestTrackLayout { cones: &cones, hit_cones: &hit_cones, path: &track.path })?;
    }
    for diagram in &picture.diagrams {
        let [bottom, top] = diagram.y_range.unwrap_or([f64::NAN; 2]);
        let diagram = Diagram {
            title: &diagram.title,
            axes: [diagram.x_label, diagram.y_label],
            ranges: [[f64::NAN; 2], [bottom, top]],
            layers: diagram.layers.iter().map(diagram_layer).collect(),
        };
        sink.push_diagram(&picture.name, picture.title, &diagram)?;
    }
    Ok(())
}

fn diagram_layer(layer: &TestDiagramLayer) -> DiagramLayer<'_> {
    let role = match layer.kind {
        DiagramLayerKind::Curve => DiagramLayerRole::Plant,
        DiagramLayerKind::SecondCurve => DiagramLayerRole::Measurement,
        DiagramLayerKind::Reference => DiagramLayerRole::Reference,
        DiagramLayerKind::Fit => DiagramLayerRole::Estimate,
        DiagramLayerKind::Limit => DiagramLayerRole::Limit,
        DiagramLayerKind::Mark => DiagramLayerRole::Other,
    };
    let shape = match layer.kind {
        DiagramLayerKind::Mark => DiagramLayerShape::Points,
        _ => DiagramLayerShape::Line,
    };
    DiagramLayer { name: &layer.name, shape, role, x: &layer.x, y: &layer.y, upper: &[] }
}

/// The values under their names, with a title and tables.
fn manoeuvre_result_json(manoeuvre: &Manoeuvre, values: &CharacteristicValues) -> Value {
    let known = manoeuvre.kind.value_descriptions();
    let about = |name: &str| known.iter().find(|it| it.name == name);
    let (mut all, mut rows, mut lists) = (Map::new(), Vec::new(), Vec::new());
    for (name, found) in &values.0 {
        let Some(known) = about(name) else { continue };
        match found {
            CharacteristicValue::Number(number) => {
                all.insert((*name).to_owned(), json!(number));
                let number = number.map_or("–".to_owned(), number_text);
                rows.push(json!([name, number, described_unit(found, known.unit), known.about]));
            }
            CharacteristicValue::List(list) => {
                all.insert((*name).to_owned(), json!(list));
                lists.push((known, list));
            }
        }
    }
    let mut tables = Vec::new();
    if !rows.is_empty() {
        tables.push(json!({ "head": ["value", "", "unit", ""], "rows": rows }));
    }
    tables.extend(value_lists_table(&lists));
    all.insert("summary".to_owned(), json!([manoeuvre.kind.kind_title()]));
    all.insert("tables".to_owned(), Value::Array(tables));
    Value::Object(all)
}

/// Lists side by side, one row for each place.
fn value_lists_table(lists: &[(&CharacteristicValueInfo, &Vec<f64>)]) -> Option<Value> {
    let longest = lists.iter().map(|(_, list)| list.len()).max()?;
    let title = |known: &CharacteristicValueInfo| name_with_unit(known.name, Some(known.unit));
    let head: Vec<_> = lists.iter().map(|(known, _)| title(known)).collect();
    let cell = |list: &Vec<f64>, place: usize| list.get(place).copied().map_or(String::new(), number_text);
    let row = |place| lists.iter().map(|(_, list)| cell(list, place)).collect::<Vec<_>>();
    Some(json!({ "head": head, "rows": (0..longest).map(row).collect::<Vec<_>>() }))
}

/// The unit as people write it, and the number in the unit that they say beside it.
fn described_unit(found: &CharacteristicValue, unit: &str) -> String {
    let customary = match found {
        CharacteristicValue::Number(Some(number)) => customary_quantity(*number, unit),
        _ => None,
    };
    let customary = customary.map(|text| format!(" ({text})")).unwrap_or_default();
    unit_text(unit) + &customary
}
