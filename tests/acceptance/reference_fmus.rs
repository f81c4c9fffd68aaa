//! Runs the Modelica Reference FMUs and compares with their published results.

use super::fixture::Scenario;
use super::harness::Lab;
use super::requirement::reference_fmus;

tests! {
    reference_fmus_reproduce_their_published_results: ReferenceFmus,
    reference_fmus_break_neither_runs_nor_the_standard: ReferenceFmus,
}

/// Names with the communication step and the stop time of the results [s]; Stair ends its run itself.
const PUBLISHED: [(&str, f64, f64); 5] = [
    ("BouncingBall", 0.01, 3.0),
    ("Dahlquist", 0.1, 10.0),
    ("Resource", 1.0, 1.0),
    ("Stair", 0.2, 10.0),
    ("VanDerPol", 0.01, 20.0),
];

/// A table as its titles and its numbers.
fn table(text: &str) -> (Vec<&str>, Vec<Vec<f64>>) {
    let mut lines = text.lines();
    let titles = lines.next().expect("titles").split(',').collect();
    let row = |line: &str| -> Vec<f64> {
        line.split(',').map(|cell| cell.parse().expect("a number")).collect()
    };
    (titles, lines.map(row).collect())
}

fn reference_fmus_reproduce_their_published_results() {
    for (name, step, stop) in PUBLISHED {
        let lab = Lab::new();
        lab.add(&reference_fmus().join(format!("2.0/{name}.fmu")));
        let scenario = Scenario::new().time(step, stop).fmu("it", &format!("{name}.fmu"), "");
        lab.write("case.toml", scenario.text());
        lab.trackside(&["run", "case.toml", "--out", "out", "--csv"]).expect(0);
        let published = reference_fmus().join(format!("results/{name}_out.csv"));
        let published = std::fs::read_to_string(published).expect("results");
        let ours = lab.table("out/run.csv");
        let ((titles, expected), (own, found)) = (table(&published), table(&ours));
        assert_eq!(found.len(), expected.len(), "{name}: rows");
        for (place, title) in titles.iter().enumerate().skip(1) {
            let column = own.iter().position(|it| *it == format!("it.{title}"));
            let column = column.unwrap_or_else(|| panic!("{name}: no {title} in {own:?}"));
            for (expected, found) in expected.iter().zip(&found) {
                // To the bit: the cells have all digits.
                assert_eq!(found[column], expected[place], "{name}.{title} at {} s", expected[0]);
            }
        }
    }
}

fn reference_fmus_break_neither_runs_nor_the_standard() {
    for (name, ..) in PUBLISHED {
        let lab = Lab::new();
        lab.add(&reference_fmus().join(format!("2.0/{name}.fmu")));
        let ended = lab.trackside(&["conform", &format!("{name}.fmu")]).expect(0);
        assert!(
            ended.stdout.contains("The FMU keeps FMI 2.0 for callers that do"),
            "{}",
            ended.stdout
        );
    }
}
