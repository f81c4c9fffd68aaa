//! Reads public systems of other tools, and finds what their files say.

use std::path::PathBuf;

use super::*;

/// A folder of public systems; `TRACKSIDE_FMUS` names another one around it.
fn published(name: &str) -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/fmus");
    let folder = std::env::var_os("TRACKSIDE_FMUS").map_or_else(beside, PathBuf::from);
    let folder = folder.join("ssp").join(name);
    if folder.is_dir() {
        return Some(folder);
    }
    println!("left out: there is no folder {}; TRACKSIDE_FMUS can name another one", folder.display());
    None
}

/// The values of connectors of systems, by their names.
fn connector_values(folder: &Path) -> Vec<(String, SspValue)> {
    let notes = crate::notes::ReadingNotes::default();
    let mut tree = crate::tree::SystemTree::new(crate::package::PackageReader::new(), &notes);
    let file = crate::package::PackageLocation::new(folder, folder, crate::package::DEFAULT);
    let description = tree.load_description(&file).expect("a description");
    tree.instantiate_element(&description, &description.system, String::new()).expect("a system");
    let values = tree.nodes.iter().enumerate().filter_map(|(node, found)| {
        let value = found.value.as_ref()?;
        let transformed = value.transformation.apply(&value.value)?;
        Some((tree.qualified_connector_name(node), transformed))
    });
    let mut values: Vec<_> = values.collect();
    values.sort_by(|a, b| a.0.cmp(&b.0));
    values
}

fn numbers(values: &[(&str, f64)]) -> Vec<(String, SspValue)> {
    values.iter().map(|(name, value)| ((*name).to_owned(), SspValue::Real(*value))).collect()
}

#[test]
#[ignore = "needs public systems of SSP"]
fn mapped_parameters_with_factor_and_offset() {
    let folder = published("LinearTransformation3").expect("a system of TRACKSIDE_FMUS");
    let system = open_system(&folder, None).expect("a system");
    let components: Vec<_> = system.components.iter().map(|x| x.name.as_str()).collect();
    assert_eq!((system.name.as_str(), components), ("default", vec!["Add1", "Gain1"]));
    assert_eq!(names(&system), ["Gain1.y -> Add1.u1"]);
    // 2 * 2 + 10 and 4 * 2 + 5.
    assert_eq!((number(&system, "Gain1", "u"), number(&system, "Gain1", "k")), (14.0, 13.0));
    assert!(system.components[0].start_values.is_empty());
    assert!(system.components[1].source.ends_with("resources/Gain.fmu"));
    assert_eq!((system.experiment.start, system.experiment.stop), (Some(0.0), Some(1.0)));
    let k = &system.components[1].connectors[2];
    let unit = k.unit.as_ref().and_then(|unit| unit.base).expect("the unit 1");
    assert_eq!((k.name.as_str(), unit.exponents, unit.factor), ("k", [0; 8], 1.0));
    let position = &start(&system, "Gain1", "k").position;
    assert!(position.file_path().ends_with("resources/mappedParameter1.ssv"));
    assert_eq!((position.line(), position.column()), (8, 7));
}

#[test]
#[ignore = "needs public systems of SSP"]
fn connections_give_parameters_their_values() {
    let folder = published("import_export_parameters2").expect("a system of TRACKSIDE_FMUS");
    let system = open_system(&folder, None).expect("a system");
    // OMSimulator prints the same values after the initialisation.
    let value = |component, variable| number(&system, component, variable);
    assert_eq!((value("addP", "k1"), value("addP", "k2"), value("addP", "u1")), (30.0, -1.0, -20.0));
    assert_eq!(value("addI", "k2"), 20.0);
    assert!(system.components[2].start_values.is_empty() && system.connections.is_empty());
    let inputs: Vec<_> = system.inputs.iter().map(|x| (x.connector.name.as_str(), x.to.len())).collect();
    assert_eq!(inputs, [("Input_cref", 1), ("Input1", 0), ("T_cref", 1), ("k_cref", 1)]);
    let (port, _) = system.outputs[0].from.as_ref().expect("a component");
    assert_eq!((port.component, port.variable.as_str()), (0, "y"));
    assert_eq!((system.experiment.start, system.experiment.stop), (Some(0.0), Some(4.0)));
    let noted = system.stepping.map(|it| (it.master, it.step));
    assert_eq!(noted, Some((SteppingTool::OmSimulator, 0.001)));
}

#[test]
#[ignore = "needs public systems of SSP"]
fn one_value_is_mapped_to_connectors_of_three_systems() {
    let folder = published("importParameterMapping").expect("a system of TRACKSIDE_FMUS");
    let values = [
        ("Input_1", 20.0),
        ("Input_2", 20.0),
        ("System1.Input_1", 20.0),
        ("System1.Input_2", 20.0),
        ("System1.parameter_1", -30.0),
        ("System2.Input_1", 20.0),
        ("System2.Input_2", 20.0),
        ("System2.parameter_1", -30.0),
        ("parameter_1", -30.0),
    ];
    assert_eq!(connector_values(&folder), numbers(&values));
    assert!(open_system(&folder, None).expect("a system").components.is_empty());
}

#[test]
#[ignore = "needs public systems of SSP"]
fn systems_have_bindings_of_their_own() {
    let folder = published("import_hierarchical_ssv_sources").expect("a system of TRACKSIDE_FMUS");
    let values = [
        ("System1.Input_1", -10.0),
        ("System1.parameter_1", -20.0),
        ("System2.Input_1", -30.0),
        ("System2.Input_2", -100.0),
        ("System2.parameter_1", -40.0),
        ("System3.Input_1", -70.0),
        ("System3.parameter_1", -70.0),
    ];
    assert_eq!(connector_values(&folder), numbers(&values));
}

#[test]
#[ignore = "needs public systems of SSP"]
fn a_ship_without_its_fmus_is_refused_and_read_with_them() {
    let source = published("dp_ship_structure").expect("a system of TRACKSIDE_FMUS");
    let message = open_system(&source, None).expect_err("no FMUs").to_string();
    assert!(message.contains("models/DPController.fmu") && message.contains(":10:51"), "{message}");
    let text = std::fs::read_to_string(source.join("SystemStructure.ssd")).expect("a text");
    let fmus = ["DPController", "NLPobserver", "ReferenceGenerator", "ThMPC", "OSOM"];
    let fmus = fmus.map(|name| format!("models/{name}.fmu"));
    let files: Vec<_> =
        fmus.iter().map(|name| (name.as_str(), "")).chain([("SystemStructure.ssd", text.as_str())]).collect();
    let folder = folder(&files);
    let system = open_system(folder.path(), None).expect("a system");
    let components: Vec<_> = system.components.iter().map(|x| x.name.as_str()).collect();
    let expected = ["DP Controller", "Observer", "Reference Generator", "Thrust Allocation", "Ship"];
    assert_eq!(components, expected);
    let connections = names(&system);
    assert_eq!(connections.len(), 3 + 6 + 3 + 3 + 3 + 2 + 6);
    assert!(connections.contains(&"Ship.q[3] -> Observer.y[3]".to_owned()));
    assert!(connections.contains(&"Thrust Allocation.alpha2 -> Ship.input[2]".to_owned()));
    assert_eq!((system.experiment.start, system.experiment.stop), (None, None));
}
