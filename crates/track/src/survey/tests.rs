//! Tests what tables of points look like, and what is said about wrong ones.

use approx::assert_relative_eq;

use super::*;

const ROWS: &str = "0,0,4,5\n10,0,4,5\n10,10,4,5\n0,10,4,5\n";

fn read(text: &str) -> TrackSurvey {
    TrackSurvey::from_table_text(text).expect("a table")
}

fn message(text: &str) -> String {
    TrackSurvey::from_table_text(text).expect_err("a mistake").to_string()
}

#[test]
fn an_origin_is_two_numbers_and_no_other_words() {
    let plane = |comment: &str| read(&format!("{comment}\nx,y\n0,0\n50,0\n100,50\n50,100\n")).plane;
    assert_eq!(plane("# origin -37.85 144.97"), Some(LocalPlane { latitude: -37.85, longitude: 144.97 }));
    for comment in
        ["# origin of the data: a survey of 2019", "# origin 37.85", "# origin 137.85 144.97", "# 1 2"]
    {
        assert_eq!(plane(comment), None, "{comment}");
    }
}

#[test]
fn headers_of_many_spellings_mean_the_same() {
    for header in [
        "x,y,left,right",
        "# x_m,y_m,w_tr_left_m,w_tr_right_m",
        "// somebody's track\n\nx [m]; y [m]; left (m); right (m)",
        "\u{feff}\"X_M\"\tY_M\twidth_left_m\twidth_right_m",
        "# made by hand\n# X Y left right",
    ] {
        let survey = read(&format!("{header}\n{ROWS}"));
        assert_eq!(survey.points, [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]], "{header}");
        assert_eq!(survey.widths, Some(vec![[4.0, 5.0]; 4]), "{header}");
        assert!(survey.closed && survey.bank.is_none(), "{header}");
    }
    let survey = read("0 0\n1 0\n2 0\n3 0");
    assert!(!survey.closed && survey.widths.is_none());
}

#[test]
fn units_become_metres_and_radians() {
    let text = "s_m,x_km,y,width,bank_deg,grade_percent,z\n\
                0,0,0,8,-90,100,1\n1,1,0,8,0,0,2\n2,2,0,8,0,0,3\n3,3,0,8,0,0,4\n";
    let survey = read(text);
    assert_eq!(survey.points[3], [3000.0, 0.0]);
    assert_eq!(survey.widths, Some(vec![[4.0; 2]; 4]));
    assert_relative_eq!(survey.bank.expect("banks")[0], -std::f64::consts::FRAC_PI_2);
    assert_relative_eq!(survey.grade.expect("grades")[0], std::f64::consts::FRAC_PI_4);
    assert_eq!(survey.height, Some(vec![1.0, 2.0, 3.0, 4.0]));
}

#[test]
fn speeds_come_from_lines_that_others_planned() {
    let planned = "# s_m; x_m; y_m; psi_rad; kappa_radpm; vx_mps; ax_mps2\n\
                   0; 0; 0; 0; 0; 20; 1\n1; 9; 0; 0; 0; 21; 1\n2; 18; 0; 0; 0; 22; 1\n3; 27; 0; 0; 0; 23; 1\n";
    assert_eq!(read(planned).speed, Some(vec![20.0, 21.0, 22.0, 23.0]));
    let logged = "x,y,v [km/h],speed\n0,0,36,9\n9,0,,9\n18,0,72,9\n27,0,72,9\n";
    let speed = read(logged).speed.expect("speeds");
    assert!((speed[0] - 10.0).abs() < 1e-12 && speed[1].is_nan() && (speed[2] - 20.0).abs() < 1e-12);
}

#[test]
fn a_line_is_closed_by_its_points_or_by_a_word() {
    let repeated = format!("x,y,left,right\n{ROWS}0,0,4,5\n");
    let survey = read(&repeated);
    assert!(survey.closed && survey.points.len() == 4);
    assert_eq!(survey.widths.expect("widths").len(), 4);
    assert!(!read(&format!("# open\nx,y,left,right\n{ROWS}")).closed);
    assert!(read("# closed\nx,y\n0,0\n9,0\n18,1\n9,8").closed);
    assert!(!read("x,y\n0,0\n9,0\n18,1\n27,8").closed);
}

#[test]
fn mistakes_are_told_with_their_line() {
    for (text, wanted) in [
        ("x,z\n0,0\n", "line 1: expected a column `y`"),
        ("x,y,east\n0,0,0\n", "line 1: expected one column `x`, found 2"),
        ("x,y,left\n0,0,1\n", "line 1: expected `left` and `right`, found one"),
        ("x,y,left,right,width\n", "found more"),
        ("0,0,4,5\n", "line 1: expected x and y, found 4 numbers"),
        ("x,y\n0,0\n1,1e999\n", "line 3: expected a number in column `y`, found `1e999`"),
        ("x,y\n0,0\n1,one\n", "line 3: expected a number in column `y`, found `one`"),
        ("x,y\n0,0\n1\n", "line 3: expected 2 numbers, found 1"),
        ("x,y\n0,0\n\n# here\n0,0\n", "line 5: expected another point than that of line 2"),
        ("x,y,width\n0,0,-1\n", "line 2: expected widths of at least 0 m"),
        ("x,y\n0,0\n1,0\n2,0\n", "expected at least 4 points of a line, found 3"),
        ("", "found 0"),
    ] {
        let found = message(text);
        assert!(found.contains(wanted), "{text:?}: {found}");
    }
}
