//! Checks `report.html`: it holds the verdict of each run, needs nothing else, and shows foreign text as text.

use super::fixture::Scenario;
use super::fmus::{misbehave, ours};
use super::harness::Lab;

tests! {
    the_page_of_a_failed_run_shows_its_checks_and_no_markup_of_theirs: Compiler,
    the_page_of_a_run_that_an_error_ended_shows_the_error: Compiler,
}

/// Whether the page loads anything: what is not inside of it or beside it, or a script but its data and its player.
fn loads(html: &str) -> bool {
    let outside = |start: &str| html.split(start).skip(1).any(|rest| !rest.starts_with("./"));
    let own = ["<script type=\"application/json\" id=\"player-data\">", "<script>"];
    let scripts = html.split("<script").count() - 1;
    let expected: usize = own.iter().map(|it| html.matches(it).count().min(1)).sum();
    ["<link", "@import", "src=\"http", "onload="].iter().any(|it| html.contains(it))
        || scripts != expected
        || outside("href=\"")
}

fn the_page_of_a_failed_run_shows_its_checks_and_no_markup_of_theirs() {
    let lab = Lab::new();
    lab.add(&ours().join("plant.fmu"));
    let script = "<script>alert(1)</script>";
    let scenario = Scenario::headed(&format!("title = \"Coasting {script}\""))
        .time(0.01, 2.0)
        .fmu("plant", "plant.fmu", "start.v_x = 20.0, F_x = 0.0, delta = 0.0")
        .check(&format!("stays {script}"), "plant.X < 20.1")
        .check("drives", "max(plant.X) > 30");
    lab.write("case.toml", scenario.text());
    lab.trackside(&["run", "case.toml", "--out", "out", "--rerun", "off"]).expect(1);
    let html = lab.read("out/report.html");
    assert!(!loads(&html), "{html}");
    let shown = "&lt;script&gt;alert(1)&lt;/script&gt;";
    for part in [
        format!("<h1>Coasting {shown}</h1>"),
        "1 of 2 checks failed".to_owned(),
        format!("stays {shown}"),
        "plant.X &lt; 20.1".to_owned(),
        "first deviation".to_owned(),
        "<svg".to_owned(),
        "trackside 0.".to_owned(),
        "[[check]]".to_owned(),
    ] {
        assert!(html.contains(&part), "no {part} in {html}");
    }
    let check = &lab.report("out")["checks"][0];
    let [first, at] = ["first", "at"].map(|key| check[key].as_f64().expect("a time"));
    assert!((1.0..1.1).contains(&first) && at == 2.0, "{check}");
    assert!(
        html.contains(&format!("<td class=\"number\" data-label=\"first deviation [s]\">{first:.3}</td>")),
        "{html}"
    );
}

fn the_page_of_a_run_that_an_error_ended_shows_the_error() {
    let lab = Lab::new();
    lab.write("misbehave.fmu", misbehave());
    let start = "u = 0.0, fault = 'fmi2DoStep', status = 3, at = 0.5";
    let scenario = Scenario::new().time(0.1, 1.0).fmu("tank", "misbehave.fmu", start);
    lab.write("case.toml", scenario.check("clock", "tank.y < 2").text());
    lab.trackside(&["run", "case.toml", "--out", "out", "--rerun", "off"]).expect(3);
    let html = lab.read("out/report.html");
    assert!(!loads(&html), "{html}");
    for part in ["<b>ERROR</b>", "node `tank`: fmi2DoStep", "tank.y &lt; 2", "SHA-256"] {
        assert!(html.contains(part), "no {part} in {html}");
    }
}
