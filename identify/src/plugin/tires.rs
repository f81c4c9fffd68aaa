//! Identifies the tires of a car: prepares its signals, identifies each curve, and tells what was found.

mod facts;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::time::Instant;

use drive_doctor::Examination;
use drive_inference::CarUncertainty;
use plugin::{Host, Request, Signal};
use preparation::direction::Direction;
use preparation::{Column, DriveLog, Pipeline, Points, Prepared, Stage};
use serde_json::{Map, Value, json};
use tire_inference::axle_coupling::{Coupled, couple};
use tire_inference::estimate::{Answer, identify};
use tire_inference::fit::{FitError, FitOptions};
use tire_inference::parameters::Theta;
use tire_inference::settings::{Method, Settings};

use crate::config::Tires;
use crate::design::d_optimal;
use crate::draws::{self, DrawnTire, Draws};
use crate::loads::{self, Loaded, Loads};
use crate::names::CAR_ADDED;
use crate::page::{self, Page, Section};
use crate::plugin::{doctor, drive_log, go_on, leave_start_values, methods, overall, posterior};
use crate::start_values::Tire;
use crate::stretches;
use crate::told::{Overall, Told, forget_absent_peak};
use crate::widening::{Widening, braked_otherwise, perturbed};

/// One curve of the car.
struct Curve<'a> {
    /// Its key in the result.
    key: &'static str,
    /// Its name on the page.
    name: &'static str,
    /// Its name in a sentence.
    axle: &'static str,
    direction: Direction,
    points: &'a Points,
}

fn curves(prepared: &Prepared) -> Vec<Curve<'_>> {
    let axles = [
        (
            ["front", "front_x"],
            ["Front axle, lateral", "Front axle, longitudinal"],
            &prepared.front,
        ),
        (["rear", "rear_x"], ["Rear axle, lateral", "Rear axle, longitudinal"], &prepared.rear),
    ];
    let mut curves = Vec::new();
    for ((keys, names, axle), short) in axles.into_iter().zip(["front", "rear"]) {
        let lateral = (Direction::Lateral, Some(&axle.lateral));
        let both = [lateral, (Direction::Longitudinal, axle.longitudinal.as_ref())];
        for ((key, name), (direction, points)) in keys.into_iter().zip(names).zip(both) {
            curves.extend(points.map(|points| Curve { key, name, axle: short, direction, points }));
        }
    }
    curves
}

/// Does `task = "tires"`.
///
/// # Errors
/// When the signals cannot be used, a curve cannot be fitted, or the program asked to give up.
pub(super) fn tires(
    config: &Tires,
    request: &Request,
    host: &mut dyn Host,
) -> Result<Value, String> {
    go_on(host, 0.0, "preparing the points")?;
    let recording = drive_log(request);
    let (car, uncertainty) = config.car().map_err(|error| error.to_string())?;
    let log = doctor::of_car(&recording, &car.body);
    let pipeline = Pipeline { car, ..config.prepare.clone() };
    let prepared = pipeline.run(&recording).map_err(|error| error.to_string())?;
    record_stages(&prepared.stages, host);
    let curves = curves(&prepared);
    let mut found: Vec<(Settings, Answer)> = Vec::new();
    for (number, curve) in curves.iter().enumerate() {
        go_on(host, (number + 1) as f64 / (curves.len() + 1) as f64, curve.name)?;
        let of = match curve.direction {
            Direction::Lateral => &config.lateral,
            Direction::Longitudinal => &config.longitudinal,
        };
        let usual = of.settings(curve.direction, curve.points.shift, config.seed);
        let prior_from_file = config.files.curve(curve.key, &usual.prior.free)?;
        let settings = Settings { prior_from_file, svi: config.svi, ..usual };
        let samples = &curve.points.samples;
        let wrong = |error: FitError| format!("{}: {error}", curve.name);
        let begin = Instant::now();
        let settings = of.loss.settle(settings, samples).map_err(wrong)?;
        let settling = begin.elapsed().as_secs_f64();
        let mut tire = identify(samples, &settings, &config.methods).map_err(wrong)?;
        for (_, estimate) in &mut tire.estimates {
            estimate.seconds += settling;
        }
        found.push((settings, tire));
    }
    if config.axle_coupling > 0.0 {
        couple_axles(&curves, &mut found, config.axle_coupling)?;
    }
    go_on(host, 0.94, "loads and longitudinal forces")?;
    let mut loads = Loads::fit(&prepared, &pipeline);
    let widenings = widenings((&pipeline, &uncertainty), &recording, (&found, &mut loads), host)?;
    for (widening, (settings, answer)) in widenings.iter().zip(&mut found) {
        widening.widen(answer, &settings.prior, config.seed);
    }
    let estimates = found.iter_mut().flat_map(|(_, answer)| &mut answer.estimates);
    for (_, estimate) in estimates {
        forget_absent_peak(estimate);
        doctor::cap(&log, estimate);
    }
    let mut overall = told(&curves, &found, &log);
    if !perturbed(&car, &uncertainty).is_empty() {
        overall.widened = CAR_ADDED;
    }
    let signal = |name: &str| request.signal(name).map(|it| [it.time, it.values]);
    let drift = stretches::drift(&config.drift, signal, (&prepared, &pipeline));
    let car = page::car::logged(&car, &uncertainty);
    let loads = of_loads(&loads, (&curves, &found), &log);
    let of_plant = of_plant(config, &curves, &found);
    overall.remarks.extend(draws::missing(&of_plant));
    // Each curve has its own data: what they leave open is independent.
    leave_start_values((&of_plant, Draws::Apart), &overall.verdict(), config.seed, host);
    leave_page((&curves, &found, &overall), (&prepared, &car, &log), (&drift, &loads), host);
    let mut result = report(config, (&curves, &found, &overall), (&prepared, &log));
    result["drift"] = stretches::report(&drift);
    [result["load_sensitivity"], result["combined_slip"]] = loads::report(&loads);
    if let Some(windows) = &config.windows {
        result["windows"] = stretches::windows(windows, (&prepared, &pipeline));
    }
    Ok(result)
}

/// What is told of loads and longitudinal forces; the first method that was asked for is the one to go on with.
fn of_loads(
    loads: &Loads,
    (curves, found): (&[Curve], &[(Settings, Answer)]),
    log: &Examination,
) -> Vec<Loaded> {
    let longitudinal = |key: &str| {
        let mut both = curves.iter().zip(found);
        both.find(|(curve, _)| curve.key == key).map(|(_, (_, answer))| &answer.estimates[0].1)
    };
    let mut told = loads.told(["front_x", "rear_x"].map(longitudinal));
    doctor::cap_loads(log, &mut told);
    told
}

/// How far each curve, and what loads tell, move with the uncertain data of the car.
fn widenings(
    (pipeline, uncertainty): (&Pipeline, &CarUncertainty),
    recording: &DriveLog,
    (found, loads): (&[(Settings, Answer)], &mut Loads),
    host: &mut dyn Host,
) -> Result<Vec<Widening>, String> {
    let mut widenings = vec![Widening::default(); found.len()];
    for (name, cars) in perturbed(&pipeline.car, uncertainty) {
        go_on(host, 0.95, &format!("fitting with another {name}"))?;
        let failed = |error: String| format!("with another {name}: {error}");
        let fits = |car| -> Result<(Vec<Theta>, loads::Ends), String> {
            let pipeline = Pipeline { car, ..pipeline.clone() };
            let prepared = pipeline.run(recording).map_err(|error| failed(error.to_string()))?;
            let fit = |(curve, (settings, answer)): (Curve, &(Settings, Answer))| {
                let start = answer.unrestricted.first().map(|(_, solution)| solution.theta);
                let options = start.map_or(settings.options, FitOptions::from_start);
                let settings = Settings { options, ..settings.clone() };
                let fit =
                    settings.fit(&curve.points.samples, &settings.prior, Method::LeastSquares);
                fit.map(|solution| solution.theta).map_err(|error| failed(error.to_string()))
            };
            let curves: Result<_, _> = curves(&prepared).into_iter().zip(found).map(fit).collect();
            Ok((curves?, loads.with(&prepared, &pipeline)))
        };
        let [low, high] = cars.map(fits);
        let ((low, low_loads), (high, high_loads)) = (low?, high?);
        loads.add(name, [low_loads, high_loads]);
        let ends = low.into_iter().zip(high);
        widenings.iter_mut().zip(ends).for_each(|(it, (low, high))| it.add(name, [low, high]));
    }
    if let Some((name, cars)) = braked_otherwise(&pipeline.car) {
        go_on(host, 0.97, &format!("loads with another {name}"))?;
        let ends = cars.map(|car| {
            let pipeline = Pipeline { car, ..pipeline.clone() };
            let prepared = pipeline.run(recording).map_err(|error| error.to_string())?;
            Ok::<_, String>(loads.with(&prepared, &pipeline))
        });
        let [low, high] = ends;
        loads.add(name, [low?, high?]);
    }
    Ok(widenings)
}

/// Fits the lateral curves of both axles again, drawn to each other.
fn couple_axles(
    curves: &[Curve],
    found: &mut [(Settings, Answer)],
    weight: f64,
) -> Result<(), String> {
    let lateral =
        curves.iter().zip(found).filter(|(curve, _)| curve.direction == Direction::Lateral);
    let axles: Vec<_> = lateral
        .map(|(curve, (settings, answer))| Coupled {
            samples: &curve.points.samples,
            settings,
            answer,
        })
        .collect();
    let Ok(axles) = <[_; 2]>::try_from(axles) else { return Ok(()) };
    couple(axles, weight).map_err(|error| format!("axle_coupling: {error}"))
}

/// What to drive next: the slips, up to half as much again as was driven, and how much of the time at each, that would tell
/// most about this tire.
fn design(curve: &Curve, (_, found): &(Settings, Answer)) -> Option<Value> {
    let [low, high] = curve.points.samples.slip_range()?;
    let tire = tire_inference::parameters::curve(&found.unrestricted.first()?.1.theta);
    let design = d_optimal(&tire, 1.5 * low.abs().max(high.abs()))?;
    Some(json!({ "slips": design.slips, "shares": design.shares }))
}

/// What was found as a whole; the first method that was asked for is the one to go on with.
fn told<'a>(curves: &[Curve], found: &'a [(Settings, Answer)], log: &Examination) -> Overall<'a> {
    let told = |(curve, (settings, answer)): (&Curve, &'a (Settings, Answer))| {
        let (estimate, prior) = (&answer.estimates[0].1, &settings.prior);
        Told { name: curve.axle, direction: curve.direction, estimate, prior }
    };
    let mut overall = overall(curves.iter().zip(found).map(told).collect());
    doctor::tell(log, &mut overall);
    overall
}

/// Results by method, then by curve.
fn report(
    config: &Tires,
    (curves, found, overall): (&[Curve], &[(Settings, Answer)], &Overall),
    (prepared, log): (&Prepared, &Examination),
) -> Value {
    let mut result = Map::from_iter([("preparation".to_owned(), json!(prepared.report))]);
    for (index, method) in config.methods.iter().enumerate() {
        let by_curve: Map<_, _> = curves
            .iter()
            .zip(found)
            .map(|(curve, (_, found))| (curve.key.to_owned(), json!(found.estimates[index].1)))
            .collect();
        result.insert(method.name().to_owned(), by_curve.into());
    }
    let designs = curves.iter().zip(found).map(|(curve, found)| (curve.key, design(curve, found)));
    result.insert("design".to_owned(), designs.collect());
    let bounds = curves
        .iter()
        .zip(found)
        .map(|(curve, (settings, _))| (curve.key.to_owned(), json!(settings.prior.bounds)));
    result.insert("bounds".to_owned(), Value::Object(bounds.collect()));
    overall.result(Some(log), result)
}

/// The tires that the plant has.
fn of_plant<'a>(
    config: &'a Tires,
    curves: &[Curve],
    found: &'a [(Settings, Answer)],
) -> Vec<DrawnTire<'a>> {
    let lateral =
        curves.iter().zip(found).filter(|(curve, _)| curve.direction == Direction::Lateral);
    let drawn = |(curve, (_, answer)): (&Curve, &'a (Settings, Answer))| {
        // The first method that was asked for is the one to go on with.
        let estimate = &answer.estimates[0].1;
        let tire = Tire {
            node: &config.node,
            tire: if curve.key == "front" { "tire_f" } else { "tire_r" },
            estimate,
            direction: curve.direction,
        };
        DrawnTire { tire, posterior: posterior(answer, estimate) }
    };
    lateral.map(drawn).collect()
}

fn leave_page(
    (curves, found, overall): (&[Curve], &[(Settings, Answer)], &Overall),
    (prepared, car, log): (&Prepared, &[(String, String)], &Examination),
    (drift, loads): (&[stretches::Drifting], &[Loaded]),
    host: &mut dyn Host,
) {
    let sections = curves.iter().zip(found).map(|(curve, (settings, found))| Section {
        name: curve.name,
        direction: curve.direction,
        samples: &curve.points.samples,
        prior: &settings.prior,
        methods: methods(found),
    });
    let facts = facts::facts(prepared);
    let page = Page {
        title: "Tires",
        overall: Some(overall),
        car,
        facts: &facts,
        log: Some(log),
        drift,
        loads,
        sections: sections.collect(),
        ..Page::default()
    };
    page::leave(&page, host);
}

/// Shows what went into and came out of each step. What went in is shown where nothing before it shows it.
fn record_stages(stages: &[Stage], host: &mut dyn Host) {
    let mut shown: BTreeMap<&str, &Column> = BTreeMap::new();
    for (number, stage) in stages.iter().enumerate() {
        let new =
            stage.inputs.iter().filter(|column| shown.get(column.name.as_str()) != Some(column));
        let inputs: Vec<_> = new.collect();
        record(&format!("{number} {} from", stage.name), &inputs, host);
        let outputs: Vec<_> = stage.outputs.iter().collect();
        record(&format!("{number} {}", stage.name), &outputs, host);
        for column in &stage.outputs {
            shown.insert(&column.name, column);
        }
    }
}

/// Records columns, those of the same times together.
fn record(group: &str, columns: &[&Column], host: &mut dyn Host) {
    let mut rest = columns.to_vec();
    let mut part = 1;
    while let Some(first) = rest.first().copied() {
        let (same, others): (Vec<_>, Vec<_>) =
            rest.into_iter().partition(|column| column.time == first.time);
        let signals: Vec<_> = same
            .iter()
            .map(|column| Signal {
                name: &column.name,
                unit: column.unit,
                time: &column.time,
                values: &column.values,
            })
            .collect();
        let name = if part == 1 { group.to_owned() } else { format!("{group} {part}") };
        host.record(&name, &signals);
        rest = others;
        part += 1;
    }
}
