//! Networks of roads with known lines: circuits of one road and of several, lanes of both directions, forks, hills and banks.

use std::f64::consts::PI;
use std::fmt::Write as _;

use approx::assert_relative_eq;
use track::TrackLine;

use super::*;

/// A geometry of a plan view: start, heading, length, and what it is.
fn geometry(s: f64, at: [f64; 2], heading: f64, length: f64, shape: &str) -> String {
    let [x, y] = at;
    format!(
        "<geometry s=\"{s}\" x=\"{x}\" y=\"{y}\" hdg=\"{heading}\" length=\"{length}\">{shape}</geometry>"
    )
}

fn lane(id: i32, kind: &str, width: f64, links: &str) -> String {
    format!(
        "<lane id=\"{id}\" type=\"{kind}\" level=\"false\"><link>{links}</link><width sOffset=\"0\" a=\"{width}\" b=\"0\" c=\"0\" d=\"0\"/></lane>"
    )
}

/// A road with one lane section.
struct TestRoad {
    id: u32,
    length: f64,
    geometries: String,
    link: String,
    profiles: String,
    left: String,
    right: String,
}

impl TestRoad {
    fn straight(id: u32, at: [f64; 2], heading: f64, length: f64) -> Self {
        let geometries = geometry(0.0, at, heading, length, "<line/>");
        let [link, profiles, left] = [const { String::new() }; 3];
        TestRoad { id, length, geometries, link, profiles, left, right: lane(-1, "driving", 8.0, "") }
    }

    fn xml(&self) -> String {
        let TestRoad { id, length, geometries, link, profiles, left, right } = self;
        let left = if left.is_empty() { String::new() } else { format!("<left>{left}</left>") };
        format!(
            "<road id=\"{id}\" length=\"{length}\" junction=\"-1\"><link>{link}</link><planView>{geometries}</planView>{profiles}\
             <lanes><laneSection s=\"0\">{left}<center><lane id=\"0\" type=\"none\"/></center><right>{right}</right></laneSection></lanes></road>"
        )
    }
}

fn network(roads: &[TestRoad]) -> RoadNetwork {
    let mut xml = String::from("<OpenDRIVE><header revMajor=\"1\" revMinor=\"6\"/>");
    roads.iter().for_each(|road| write!(xml, "{}", road.xml()).expect("a text takes everything"));
    xodr::load_str(&(xml + "</OpenDRIVE>")).expect("a network")
}

fn successor(road: u32) -> String {
    format!("<successor elementType=\"road\" elementId=\"{road}\" contactPoint=\"start\"/>")
}

fn predecessor(road: u32) -> String {
    format!("<predecessor elementType=\"road\" elementId=\"{road}\" contactPoint=\"end\"/>")
}

const LINKED: &str = "<predecessor id=\"-1\"/><successor id=\"-1\"/>";

/// An oval of one road: two straights of 100 m, and two half circles of 40 m radius to the left.
fn oval() -> TestRoad {
    let (straight, bend) = (100.0, 40.0 * PI);
    let arc = "<arc curvature=\"0.025\"/>";
    let geometries = [
        geometry(0.0, [0.0, 0.0], 0.0, straight, "<line/>"),
        geometry(straight, [100.0, 0.0], 0.0, bend, arc),
        geometry(straight + bend, [100.0, 80.0], PI, straight, "<line/>"),
        geometry(2.0 * straight + bend, [0.0, 80.0], PI, bend, arc),
    ];
    TestRoad {
        geometries: geometries.concat(),
        link: predecessor(1) + &successor(1),
        right: lane(-1, "driving", 8.0, LINKED) + &lane(-2, "shoulder", 2.0, ""),
        ..TestRoad::straight(1, [0.0, 0.0], 0.0, 2.0 * (straight + bend))
    }
}

#[test]
fn a_circuit_of_one_road_is_closed_with_the_bends_of_its_geometry() {
    let track = track_of_network(&network(&[oval()]), &[]).expect("a track");
    assert!(track.survey.closed && track.roads == ["1"] && track.survey.height.is_none());
    for widths in track.survey.widths.as_ref().expect("widths") {
        // The shoulder is no lane for driving.
        assert_relative_eq!(widths[0], 0.0, epsilon = 1e-3);
        assert_relative_eq!(widths[1], 8.0, epsilon = 1e-3);
    }
    let line = TrackLine::from_survey(&track.survey).expect("a line");
    assert_relative_eq!(line.length(), 2.0 * (100.0 + 40.0 * PI), max_relative = 1e-4);
    for (s, kappa) in [(50.0, 0.0), (160.0, 0.025), (275.0, 0.0), (390.0, 0.025)] {
        assert_relative_eq!(line.curvature_at(s), kappa, epsilon = 3e-4);
    }
}

/// The lane on the left runs against the reference line.
#[test]
fn both_directions_make_one_road() {
    let road = TestRoad { left: lane(1, "driving", 3.0, ""), ..TestRoad::straight(1, [5.0, 2.0], 0.5, 60.0) };
    let track = track_of_network(&network(&[road]), &[]).expect("a track");
    assert!(!track.survey.closed);
    let widths = track.survey.widths.expect("widths");
    assert_relative_eq!(widths[7][0], 3.0, epsilon = 1e-3);
    assert_relative_eq!(widths[7][1], 8.0, epsilon = 1e-3);
    let [first, last] = [track.survey.points[0], track.survey.points[track.survey.points.len() - 1]];
    assert_relative_eq!(last[0] - first[0], 60.0 * 0.5_f64.cos(), epsilon = 1e-3);
}

#[test]
fn roads_follow_one_another_to_both_ends() {
    let linked = lane(-1, "driving", 8.0, LINKED);
    let first = TestRoad {
        link: successor(2),
        right: linked.clone(),
        ..TestRoad::straight(1, [0.0, 0.0], 0.0, 40.0)
    };
    let second = TestRoad {
        link: predecessor(1) + &successor(3),
        right: linked.clone(),
        ..TestRoad::straight(2, [40.0, 0.0], 0.0, 90.0)
    };
    let third =
        TestRoad { link: predecessor(2), right: linked, ..TestRoad::straight(3, [130.0, 0.0], 0.0, 30.0) };
    let network = network(&[third, first, second]);
    let track = track_of_network(&network, &[]).expect("a track");
    assert_eq!(
        (track.roads.as_slice(), track.survey.closed),
        (&["1", "2", "3"].map(str::to_owned)[..], false)
    );
    let [first, last] = [track.survey.points[0], track.survey.points[track.survey.points.len() - 1]];
    assert!(first[0].abs() < 1e-3 && (last[0] - 160.0).abs() < 2.0, "{first:?} {last:?}");
    let of = |names: &[&str]| {
        track_of_network(&network, &names.iter().map(|it| (*it).to_owned()).collect::<Vec<_>>())
    };
    assert_eq!(of(&["2", "3"]).expect("a track").roads, ["2", "3"]);
    assert_eq!(
        of(&["1", "3"]).expect_err("a gap").to_string(),
        "road 3 does not follow road 1; what follows it: 2"
    );
    assert_eq!(
        of(&["7"]).expect_err("no such road").to_string(),
        "expected roads of the file, found `7`; it has 3, 1, 2"
    );
}

#[test]
fn roads_without_links_are_joined_where_they_meet() {
    let circle = TestRoad { link: String::new(), right: lane(-1, "driving", 8.0, ""), ..oval() };
    let track = track_of_network(&network(&[circle]), &[]).expect("a track");
    assert!(track.survey.closed, "it ends where it begins");
    let first = TestRoad::straight(1, [0.0, 0.0], 0.0, 100.0);
    let second = TestRoad::straight(2, [100.0, 0.0], 0.0, 40.0);
    let track = track_of_network(&network(&[second, first]), &[]).expect("a track");
    assert_eq!((track.roads.as_slice(), track.survey.closed), (&["1", "2"].map(str::to_owned)[..], false));
}

#[test]
fn roads_that_do_not_meet_are_no_line() {
    let linked = lane(-1, "driving", 8.0, LINKED);
    let first = TestRoad {
        link: successor(2),
        right: linked.clone(),
        ..TestRoad::straight(1, [0.0, 0.0], 0.0, 60.0)
    };
    let second =
        TestRoad { link: predecessor(1), right: linked, ..TestRoad::straight(2, [160.0, 0.0], 0.0, 40.0) };
    let error = track_of_network(&network(&[first, second]), &[]).expect_err("a gap");
    assert!(error.to_string().starts_with("the line jumps by 100.0 m from x = 60.0 m"), "{error}");
}

#[test]
fn hills_and_banks_are_those_of_the_road() {
    let profiles = "<elevationProfile><elevation s=\"0\" a=\"10\" b=\"0.05\" c=\"0\" d=\"0\"/></elevationProfile>\
                    <lateralProfile><superelevation s=\"0\" a=\"0.08\" b=\"0\" c=\"0\" d=\"0\"/></lateralProfile>";
    let road = TestRoad { profiles: profiles.to_owned(), ..TestRoad::straight(1, [0.0, 0.0], 0.0, 80.0) };
    let track = track_of_network(&network(&[road]), &[]).expect("a track");
    let line = TrackLine::from_survey(&track.survey).expect("a line");
    let at = line.road_at(41.0);
    assert_relative_eq!(at.grade, 0.05_f64.atan(), epsilon = 1e-4);
    assert_relative_eq!(at.bank, 0.08, epsilon = 1e-3);
}

#[test]
fn a_map_far_from_its_origin_and_one_without_lanes_are_told() {
    let far = TestRoad::straight(1, [600e3, 5e6], 0.0, 100.0);
    let error = track_of_network(&network(&[far]), &[]).expect_err("single precision");
    assert!(error.to_string().contains("move the map there"), "{error}");
    let walk =
        TestRoad { right: lane(-1, "sidewalk", 2.0, ""), ..TestRoad::straight(1, [0.0, 0.0], 0.0, 50.0) };
    assert_eq!(track_of_network(&network(&[walk]), &[]), Err(Error::NoLanes));
    let short = TestRoad::straight(1, [0.0, 0.0], 0.0, 3.0);
    assert!(matches!(track_of_network(&network(&[short]), &[]), Err(Error::Short { .. })));
}
