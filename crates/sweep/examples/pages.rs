//! Writes pages of sweeps that never ran, to be looked at: `cargo run -p sweep --example pages -- FOLDER [MOST]`; or that of a table, with the
//! time that it takes: `cargo run --release -p sweep --example pages -- --of TABLE.parquet PAGE.html`.

use std::path::{Path, PathBuf};
use std::time::Instant;

use sweep::design::{DesignAxis, DesignMethod, ExperimentDesign};
use sweep::distribution::Distribution;
use sweep::page::{SweepPageHeader, sweep_page};
use sweep::summary::SweepSummary;
use sweep::table::{
    ERROR, FAILED, PASSED, SweepColumn, SweepColumnRole, SweepColumnValues, SweepTable, read_table,
    write_table,
};

const NAMES: [(&str, &str); 6] = [
    ("plant.body.m", "kg"),
    ("plant.tire_front.friction_coefficient", "1"),
    ("signal.driver_speed.value", "m/s"),
    ("plant.body.i_zz", "kg·m²"),
    ("controller.gain", "1/m"),
    ("effect.imu_yaw_rate.noise.std", "rad/s"),
];

fn design(method: DesignMethod, variants: u64) -> ExperimentDesign {
    let ranges = [(1400., 1900.), (0.6, 1.1), (18., 32.), (2000., 3200.), (0.1, 0.4), (0.0, 0.02)];
    let axes = NAMES.iter().zip(ranges).map(|((name, _), (low, high))| DesignAxis {
        name: (*name).to_owned(),
        distribution: Distribution::Uniform { low, high },
    });
    ExperimentDesign { method, axes: axes.collect(), variants, seed: 4, correlations: Vec::new() }
}

/// Two margins and a collected value of a variant; nothing when it crashes.
fn run(x: &[f64]) -> Option<[f64; 3]> {
    let grip = x[1] * 9.81 - x[2] * x[2] / 110.0;
    let yaw = 0.09 - 0.0045 * (x[0] / x[3]) * x[2] * (0.4 + x[4]) - 0.4 * x[5];
    (x[4] < 0.385 || x[2] < 29.0).then_some([grip, yaw, x[2] / (1.0 + x[1]) + 3.0 * x[4]])
}

fn table(design: &ExperimentDesign) -> SweepTable {
    let points = design.design_points().expect("a design");
    let all: Vec<Vec<f64>> = (0..points.point_count()).map(|index| points.point(index)).collect();
    let runs: Vec<_> = all.iter().map(|x| run(x)).collect();
    let result = |k: usize| runs.iter().map(|it| it.map_or(f64::NAN, |it| it[k])).collect();
    let passed = |k: usize| runs.iter().map(|it| it.map(|it| it[k] >= 0.0)).collect();
    let verdict = runs.iter().map(|it| match it {
        Some(it) if it[0] >= 0.0 && it[1] >= 0.0 => PASSED,
        Some(_) => FAILED,
        None => ERROR,
    });
    let of_errors = |text: &str| {
        let some = |it: &Option<_>| it.is_none().then(|| text.to_owned());
        SweepColumnValues::Texts(runs.iter().map(some).collect())
    };
    let numbers = (0..all.len() as i64).collect();
    let mut columns =
        vec![SweepColumn::new("variant", SweepColumnRole::Variant, SweepColumnValues::Integers(numbers))];
    for (axis, (name, unit)) in NAMES.iter().enumerate() {
        let values = all.iter().map(|x| x[axis]).collect();
        let column = SweepColumn::new(name, SweepColumnRole::Parameter, SweepColumnValues::Numbers(values));
        columns.push(column.with_unit(Some(unit)));
    }
    let verdicts = verdict.map(|it| Some(it.to_owned())).collect();
    columns.push(SweepColumn::new("verdict", SweepColumnRole::Verdict, SweepColumnValues::Texts(verdicts)));
    let text = "node `controller`: fmi3DoStep at t = 2.31 s a floating point exception <SIGFPE>";
    for (name, text) in [("error", text), ("error.node", "controller"), ("error.call", "fmi3DoStep")] {
        columns.push(SweepColumn::new(name, SweepColumnRole::Error, of_errors(text)));
    }
    let times = all.iter().zip(&runs).map(|(x, it)| it.map_or(60.0 / x[2], |_| f64::NAN)).collect();
    columns.push(
        SweepColumn::new("error.time", SweepColumnRole::Error, SweepColumnValues::Numbers(times))
            .with_unit(Some("s")),
    );
    for (k, (name, unit)) in [("stays in its lane", "m/s²"), ("yaw is damped", "1")].iter().enumerate() {
        let check = format!("check.{name}");
        columns.push(SweepColumn::new(
            &check,
            SweepColumnRole::Check,
            SweepColumnValues::Booleans(passed(k)),
        ));
        let margin = SweepColumn::new(
            &format!("margin.{name}"),
            SweepColumnRole::Margin,
            SweepColumnValues::Numbers(result(k)),
        );
        columns.push(margin.with_unit(Some(unit)));
    }
    let name = "collect.largest_side_slip";
    columns.push(
        SweepColumn::new(name, SweepColumnRole::Collected, SweepColumnValues::Numbers(result(2)))
            .with_unit(Some("deg")),
    );
    SweepTable { columns }
}

fn header(design: String) -> SweepPageHeader {
    SweepPageHeader {
        title: "Sweep of double_lane_change".to_owned(),
        plan: "target/sweeps/double_lane_change".to_owned(),
        design,
        reports: std::collections::BTreeMap::new(),
        csv: Some("sweep.csv".to_owned()),
        scenario_values: std::collections::BTreeMap::new(),
    }
}

fn write_page_of(table: &Path, page: &Path) {
    let start = Instant::now();
    let table = read_table(table).expect("a table");
    let read = start.elapsed();
    let summary = SweepSummary::from_table(&table, None, 1);
    let summarised = start.elapsed();
    let html = sweep_page(&header(format!("{} variants.", table.row_count())), &table, &summary);
    std::fs::write(page, html).expect("it is written");
    let [read, summarised, written] =
        [read, summarised, start.elapsed()].map(|duration| duration.as_secs_f64());
    println!(
        "{} variants: read {read:.2} s, summary {:.2} s, page {:.2} s, together {written:.2} s",
        table.row_count(),
        summarised - read,
        written - summarised
    );
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let first = arguments.next().expect("a folder, or --of with a table and a page");
    if first == "--of" {
        let mut path = || PathBuf::from(arguments.next().expect("a table and a page"));
        return write_page_of(&path(), &path());
    }
    let folder = PathBuf::from(first);
    let most = arguments.next().map_or(1000, |count| count.parse().expect("a count"));
    for (name, method, variants) in [
        ("one", DesignMethod::Sobol, 1),
        ("saltelli", DesignMethod::Saltelli, 4096),
        ("ranks", DesignMethod::LatinHypercube, most),
    ] {
        let design = design(method, variants);
        let table = table(&design);
        let axes: Vec<String> = design.axes.iter().map(|axis| axis.name.clone()).collect();
        let summary =
            SweepSummary::from_table(&table, (method == DesignMethod::Saltelli).then_some(&axes), 1);
        let about = header(format!("{} variants, {}, seed 4.", table.row_count(), method.display_name()));
        let html = sweep_page(&about, &table, &summary);
        std::fs::write(folder.join(format!("{name}.html")), html).expect("it is written");
        write_table(&folder.join(format!("{name}.parquet")), &table).expect("it is written");
    }
}
