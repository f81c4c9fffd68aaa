//! Reads tables as tools write them, and wrong ones.

use car_file::{read_aerodynamic_map, read_brake_curves, read_engine_torque, read_kinematics};
use vehicle::dual_track::EngineTorque;

const C: [f64; 3] = [0.3, 0.1, 0.2];

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-12 * b.abs().max(1e-3)
}

#[test]
fn units_separators_and_spellings_are_those_of_many_tools() {
    for text in [
        "travel [mm], toe [deg], camber [deg]\n-50, 1, 0.5\n50, -1, -2.5\n",
        "\u{feff}# front axle\r\n\r\nWheel Travel (cm);Toe-In (deg);Camber [deg];\r\n-5;1;0,5;\r\n5;-1;-2,5;\r\n",
        "camber [deg]\ttoe [deg]\tjounce [m]\n.5\t1\t-0.05\n-2.5\t-1.\t+5e-2\n// end\n",
        "travel [mm]  toe[deg]  camber[deg]\n  -50  1  0.5\n  50  -1  -2.5",
        "\"travel [mm]\",\"toe [deg]\",\"camber [deg]\"\n\"-50\",\"1\",\"0.5\"\n50,-1,-2.5\n",
    ] {
        let read = read_kinematics(text).unwrap_or_else(|error| panic!("{text}: {error}"));
        let (toe, camber) = (read.toe.expect("toe"), read.camber.expect("camber"));
        assert!(close(toe.interpolate(-0.025), 0.5_f64.to_radians()), "{text}");
        assert!(close(camber.interpolate(0.0), -(1.0_f64.to_radians())), "{text}");
        assert!(close(toe.argument_range().expect("ends")[1], 0.05));
    }
}

#[test]
fn maps_take_their_rows_in_any_order_and_leave_the_rest_constant() {
    let text = "frh [mm], rrh [mm], C_lf [1], C_lr\n40, 60, 0.5, 0.9\n20, 60, 0.7, 1.0\n20, 30, 0.9, 1.3\n40, 30, 0.6, 1.2\n";
    let map = read_aerodynamic_map(text, C).expect("a map");
    assert_eq!(map.interpolate(0.02, 0.03), [0.3, 0.9, 1.3]);
    assert_eq!(map.interpolate(0.04, 0.06), [0.3, 0.5, 0.9]);
    let only_front = read_aerodynamic_map("ride_height_f [mm], C_d\n20, 0.4\n40, 0.36\n", C).expect("a map");
    assert_eq!(only_front.interpolate(0.02, 9.0), [0.4, 0.1, 0.2]);
    assert_eq!(only_front.argument_ranges()[1], None);
}

#[test]
fn an_engine_has_a_full_load_curve_or_a_map() {
    let EngineTorque::FullLoad(curve) =
        read_engine_torque("n [rpm], torque [N.m]\n1000, 200\n6000, 400\n").expect("a curve")
    else {
        panic!("no curve");
    };
    assert!(close(curve.interpolate(3500.0 * std::f64::consts::TAU / 60.0), 300.0));
    let text = "speed [rpm], throttle [%], torque [N.m]\n1000, 0, -20\n1000, 100, 200\n6000, 0, -60\n6000, 100, 400\n";
    let EngineTorque::Pedal(map) = read_engine_torque(text).expect("a map") else { panic!("no map") };
    assert!(close(map.interpolate(0.0, 0.5)[0], 90.0));
    let [front, rear] =
        read_brake_curves("pedal [%], torque_f [kN.m], torque_r [N.m]\n0, 0, 0\n100, 4, 2000\n")
            .expect("torques");
    assert!(close(front.interpolate(0.5), 2000.0) && close(rear.interpolate(0.5), 1000.0));
}

#[test]
fn wrong_tables_are_told_with_line_and_column() {
    let of = |text: &str| read_kinematics(text).expect_err(text).to_string();
    for (text, expected) in [
        ("", "1: expected a table with the columns travel, toe, camber, found none"),
        ("# nothing\n", "1: expected a table with the columns travel, toe, camber, found none"),
        ("travel [m], toe [rad]\n", "1: expected rows of numbers under the head, found none"),
        ("travel, toe [deg]\n0, 1\n", "1: expected a unit of `travel`, such as `travel [m]`"),
        (
            "travel [mm], toe [mm]\n0, 1\n",
            "1: expected a unit of `toe` such as [rad], found [mm]: m is not rad",
        ),
        ("travel [mm], tow [deg]\n0, 1\n", "1: unknown column `tow`, did you mean `toe`?"),
        (
            "travel [mm], steering [deg]\n0, 1\n",
            "1: unknown column `steering`, expected some of `travel`, `toe`, `camber`",
        ),
        (
            "travel [mm], toe [deg], toe_in [rad]\n0, 1, 1\n",
            "1: expected one column `toe`, found another one in `toe_in [rad]`",
        ),
        ("travel [mm], toe [deg\n0, 1\n", "1: expected a unit in brackets, such as `[mm]`, found `toe [deg`"),
        ("toe [deg], camber [deg]\n0, 1\n", "1: expected a column `travel [m]`"),
        ("travel [mm]\n0\n1\n", "1: expected a column `toe [rad]`, `camber [rad]`, or both"),
        ("0, 1\n2, 3\n", "1: unknown column `0`, expected some of `travel`, `toe`, `camber`"),
        ("travel [mm], toe [deg]\n0, 1\n", "1: expected at least two rows, found 1"),
        (
            "travel [mm], toe [deg]\n0, 1\n\n# x\n1, soft\n",
            "5: expected a finite number in column 2 `toe [deg]`, found `soft`",
        ),
        (
            "travel [mm], toe [deg]\n0, 1\nNaN, 1\n",
            "3: expected a finite number in column 1 `travel [mm]`, found `NaN`",
        ),
        (
            "travel [mm], toe [deg]\n0, inf\n",
            "2: expected a finite number in column 2 `toe [deg]`, found `inf`",
        ),
        ("travel [mm], toe [deg]\n0, 1,5\n1, 2\n", "2: expected 2 numbers, found 3"),
        ("travel [mm], toe [deg]\n0\n", "2: expected 2 numbers, found 1"),
        ("travel [mm], toe [deg]\n0, 1\n0, 2\n", "3: expected `travel` to rise, found 0 after 0 [m]"),
    ] {
        assert_eq!(of(text), expected, "{text}");
    }
    assert!(of("travel [mm], toe [degs]\n0, 1\n").contains("deg"));
}

#[test]
fn wrong_maps_are_told_with_the_pair() {
    let of = |text: &str| read_aerodynamic_map(text, C).expect_err(text).to_string();
    let head = "ride_height_f [m], ride_height_r [m], C_d\n";
    let missing = of(&format!("{head}0.02, 0.03, 1\n0.02, 0.06, 1\n0.04, 0.06, 1\n"));
    assert_eq!(
        missing,
        "1: expected a row for each pair, found none for ride_height_f = 0.04 m and ride_height_r = 0.03 m"
    );
    let twice =
        of(&format!("{head}0.02, 0.03, 1\n0.04, 0.03, 1\n0.02, 0.06, 1\n0.04, 0.06, 1\n0.02, 0.03, 2\n"));
    assert_eq!(twice, "6: expected other points than those of line 2");
    let single = of(&format!("{head}0.02, 0.03, 1\n0.04, 0.03, 1\n"));
    assert!(single.contains("two different numbers of `ride_height_r`"), "{single}");
    assert_eq!(of("C_d\n0.3\n"), "1: expected a column `ride_height_r [m]`");
    assert!(of("ride_height_f [m], ride_height_r [m]\n0, 0\n").contains("`C_d`, `C_lf`, `C_lr`"));
    let pedal = read_brake_curves("pedal, torque_f [N.m], torque_r [N.m]\n0, 0, 0\n100, 1, 1\n")
        .expect_err("percent");
    assert_eq!(pedal.to_string(), "3: expected `pedal` from 0 to 1, found 100; one in percent is `[%]`");
    let reverse =
        read_engine_torque("speed [rpm], torque [N.m]\n-1, 0\n1, 0\n").expect_err("a negative speed");
    assert_eq!(reverse.line, 2);
    // Scattered points: the first pair that is missing is told, no grid of all of them is made.
    let scattered: String = (0..20_000).map(|i| format!("{}, {}, 1\n", i, 7 * i + 1)).collect();
    assert!(of(&format!("{head}{scattered}")).contains("a row for each pair"));
}
