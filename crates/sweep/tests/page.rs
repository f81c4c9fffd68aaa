//! Tests what a page says of tables that are small, large, empty, or hostile.

use sweep::page::{SweepPageHeader, sweep_page};
use sweep::summary::{DesignKind, SensitivityMethod, SweepSummary};
use sweep::table::{SweepColumn, SweepColumnRole, SweepColumnValues, SweepTable};

fn about() -> SweepPageHeader {
    let plan = "target/my sweeps/it's".to_owned();
    SweepPageHeader {
        title: "Sweep <of> it".to_owned(),
        plan,
        design: "five variants".to_owned(),
        reports: [(11, "variants/11/report.html".to_owned())].into(),
        csv: Some("sweep.csv".to_owned()),
        scenario_values: [("car.k_bar".to_owned(), "20.0".to_owned())].into(),
    }
}

/// Five variants: one passes with room, one just, one fails, one fails without a margin, one crashes.
fn table() -> SweepTable {
    let texts = |all: [Option<&str>; 5]| SweepColumnValues::Texts(all.map(|it| it.map(str::to_owned)).into());
    let numbers = |all: [f64; 5]| SweepColumnValues::Numbers(all.into());
    let crash = |text| texts([None, None, None, None, Some(text)]);
    let verdicts = ["passed", "passed", "failed", "failed", "error"].map(Some);
    let judged = [Some(true), Some(true), Some(false), Some(false), None];
    let columns = vec![
        SweepColumn::new(
            "variant",
            SweepColumnRole::Variant,
            SweepColumnValues::Integers((10..15).collect()),
        ),
        SweepColumn::new("plant.m", SweepColumnRole::Parameter, numbers([1., 2., 4., 3., 5.]))
            .with_unit(Some("kg")),
        SweepColumn::new(
            "plant.path",
            SweepColumnRole::Parameter,
            texts(["a", "b", "c", "a", "b"].map(Some)),
        ),
        SweepColumn::new("verdict", SweepColumnRole::Verdict, texts(verdicts)),
        SweepColumn::new("error", SweepColumnRole::Error, crash("<script>alert(1)</script> \u{1b}[0m")),
        SweepColumn::new("error.node", SweepColumnRole::Error, crash("plant")),
        SweepColumn::new("error.call", SweepColumnRole::Error, crash("fmi2DoStep")),
        SweepColumn::new(
            "error.time",
            SweepColumnRole::Error,
            numbers([f64::NAN, f64::NAN, f64::NAN, f64::NAN, 2.5]),
        ),
        SweepColumn::new("check.lane", SweepColumnRole::Check, SweepColumnValues::Booleans(judged.into())),
        SweepColumn::new(
            "margin.lane",
            SweepColumnRole::Margin,
            numbers([3.0, 0.5, -1.0, f64::NAN, f64::NAN]),
        )
        .with_unit(Some("m")),
        SweepColumn::new(
            "collect.speed",
            SweepColumnRole::Collected,
            numbers([1.0, 2.0, 4.0, 3.0, f64::NAN]),
        ),
    ];
    SweepTable { columns }
}

#[test]
fn a_summary_counts_what_the_table_has() {
    let summary = SweepSummary::from_table(&table(), None, 1);
    assert_eq!((summary.share.passed, summary.share.of, summary.errors), (2, 5, 1));
    let check = &summary.checks[0];
    assert_eq!((check.name.as_str(), check.share.passed, check.share.of), ("lane", 2, 4));
    // The one without a margin failed worst; the one that crashed was not judged.
    let worst: Vec<i64> = check.worst.iter().map(|worst| worst.variant).collect();
    assert_eq!(worst, [13, 12, 11, 10]);
    let failures = &summary.failures[0];
    assert_eq!((failures.count, &failures.variants[..]), (1, &[14][..]));
    assert_eq!((failures.node.as_deref(), failures.time), (Some("plant"), Some([2.5, 2.5])));
    assert_eq!(summary.not_ordered, ["plant.path"]);
    let speed = summary.outputs.iter().find(|it| it.name == "collect.speed").expect("collected");
    assert_eq!((speed.method, speed.used, speed.left_out), (SensitivityMethod::Ranks, 4, 1));
    assert_eq!((&speed.effects[0].parameter[..], speed.effects[0].estimate.value), ("plant.m", 1.0));
}

#[test]
fn the_page_says_what_counts_and_runs_nothing_that_stands_in_texts() {
    let summary = SweepSummary::from_table(&table(), None, 1);
    let html = sweep_page(&about(), &table(), &summary);
    for expected in [
        "Sweep &lt;of&gt; it",
        "<b>40 %</b> 2 of 5 variants pass; 95 % interval 12 to 77 %",
        "<b>1 variant did not end</b>",
        "-1.0 m",
        "lane: smallest margin",
        "speed: highest",
        "plant.m = 4.0 kg",
        "<a href=\"./variants/11/report.html\">report</a>",
        "<a href=\"./sweep.csv\">",
        "speed over plant.m",
        "trackside replay &#39;target/my sweeps/it&#39;\\&#39;&#39;s/10&#39;",
        "&lt;script&gt;alert(1)&lt;/script&gt; \\u{1b}[0m",
        "<td>plant</td><td>fmi2DoStep</td><td class=\"number\">2.5 s</td>",
        "no order: <code>plant.path</code>",
    ] {
        assert!(html.contains(expected), "{expected} is not in\n{html}");
    }
    // The only script is the one that sorts.
    assert_eq!(html.matches("<script").count(), 1);
    assert!(!html.contains("<script>alert") && !html.contains(">NaN") && !html.contains(">inf"));
}

#[test]
fn two_setups_stand_side_by_side_with_their_differences() {
    let texts = |all: [&str; 2]| SweepColumnValues::Texts(all.map(|it| Some(it.to_owned())).into());
    let numbers = |all: [f64; 2]| SweepColumnValues::Numbers(all.into());
    let columns = vec![
        SweepColumn::new("variant", SweepColumnRole::Variant, SweepColumnValues::Integers(vec![0, 1])),
        SweepColumn::new("name", SweepColumnRole::Name, texts(["stock", "sport"])),
        SweepColumn::new("car.k_bar", SweepColumnRole::Parameter, numbers([20.0, 25.0]))
            .with_unit(Some("kN/m")),
        SweepColumn::new("verdict", SweepColumnRole::Verdict, texts(["passed", "passed"])),
        SweepColumn::new("collect.roll", SweepColumnRole::Collected, numbers([4.0, 3.5]))
            .with_unit(Some("deg")),
        SweepColumn::new("collect.mass", SweepColumnRole::Collected, numbers([1500.0, 1500.0])),
        SweepColumn::new("collect.time", SweepColumnRole::Collected, numbers([2.0, 2.01])),
    ];
    let table = SweepTable { columns };
    let summary = SweepSummary::from_table(&table, None, 1).with_design(DesignKind::ByHand);
    let html = sweep_page(&about(), &table, &summary);
    for expected in [
        "<h2>Side by side</h2>",
        "<th>stock</th><th>sport</th>",
        // What the scenario has, and a result that hardly differs.
        "<span class=\" own\">20</span>",
        "<span class=\"\">2.01</span><i class=\"size\" style=\"width:100px\"></i><span class=\"difference\">≈</span>",
        "+5.0 (+25.0 %)",
        "−0.5 (−12.5 %)",
        "<tr class=\"faint\"><td>mass</td>",
        "roll over car.k_bar",
        ">3.5</text>",
    ] {
        assert!(html.contains(expected), "{expected} is not in\n{html}");
    }
    assert!(!html.contains("All variants side by side"), "two lines across axes show nothing");
    assert!(!html.contains("95 %"), "what somebody chose is no sample");
}

#[test]
fn one_variant_and_none_have_a_page_too() {
    let mut one = table();
    for column in &mut one.columns {
        column.values = match &column.values {
            SweepColumnValues::Integers(values) => SweepColumnValues::Integers(values[..1].to_vec()),
            SweepColumnValues::Numbers(values) => SweepColumnValues::Numbers(values[..1].to_vec()),
            SweepColumnValues::Booleans(values) => SweepColumnValues::Booleans(values[..1].to_vec()),
            SweepColumnValues::Texts(values) => SweepColumnValues::Texts(values[..1].to_vec()),
        };
    }
    let html = sweep_page(&about(), &one, &SweepSummary::from_table(&one, None, 1));
    assert!(html.contains("<b>100 %</b> 1 of 1 variant passes; 95 % interval 21 to 100 %"), "{html}");
    assert!(!html.contains(">NaN") && !html.contains("What drives what"), "{html}");
    let none = table().without_rows();
    let html = sweep_page(&about(), &none, &SweepSummary::from_table(&none, None, 1));
    assert!(html.contains("0 of 0 variants pass") && !html.contains(">NaN"), "{html}");
    let html = sweep_page(
        &about(),
        &SweepTable::default(),
        &SweepSummary::from_table(&SweepTable::default(), None, 1),
    );
    assert!(html.contains("0 of 0 variants pass"), "{html}");
}

#[test]
fn variants_without_checks_are_neither_passed_nor_failed() {
    let verdicts = vec![Some("no checks".to_owned()); 2];
    let columns = vec![
        SweepColumn::new("variant", SweepColumnRole::Variant, SweepColumnValues::Integers(vec![0, 1])),
        SweepColumn::new("verdict", SweepColumnRole::Verdict, SweepColumnValues::Texts(verdicts)),
    ];
    let table = SweepTable { columns };
    let html = sweep_page(&about(), &table, &SweepSummary::from_table(&table, None, 1));
    let banner = "banner neutral\"><b>NO CHECKS</b> 2 of 2 variants came to their end, nothing was checked";
    assert!(html.contains(banner), "{html}");
}

#[test]
fn a_million_variants_make_no_larger_page_than_thousands() {
    let of = |rows: i64| {
        let numbers: Vec<f64> = (0..rows).map(|k| (k % 9973) as f64).collect();
        let passed = |x: &f64| *x < 9000.0;
        let verdict = |x: &f64| Some(if passed(x) { "passed" } else { "failed" }.to_owned());
        let checks = numbers.iter().map(|x| Some(passed(x))).collect();
        let margins = numbers.iter().map(|x| 9000.0 - x).collect();
        let columns = vec![
            SweepColumn::new(
                "variant",
                SweepColumnRole::Variant,
                SweepColumnValues::Integers((0..rows).collect()),
            ),
            SweepColumn::new(
                "verdict",
                SweepColumnRole::Verdict,
                SweepColumnValues::Texts(numbers.iter().map(verdict).collect()),
            ),
            SweepColumn::new("check.lane", SweepColumnRole::Check, SweepColumnValues::Booleans(checks)),
            SweepColumn::new("margin.lane", SweepColumnRole::Margin, SweepColumnValues::Numbers(margins)),
            SweepColumn::new("p", SweepColumnRole::Parameter, SweepColumnValues::Numbers(numbers)),
        ];
        let table = SweepTable { columns };
        sweep_page(&about(), &table, &SweepSummary::from_table(&table, None, 1))
    };
    let (small, large) = (of(10_000), of(1_000_000));
    assert!(large.contains("of 1,000,000 variants pass"));
    assert!(large.len() < small.len() + small.len() / 4, "{} {}", small.len(), large.len());
}
