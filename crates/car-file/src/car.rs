//! The tables of a car: suspension kinematics, aerodynamic map, brakes, engine; their columns and units.
#![allow(non_snake_case, reason = "coefficients are written as in the equations")]

use vehicle::dual_track::EngineTorque;
use vehicle::{BilinearMap, PiecewiseLinearCurve};

use crate::Error;
use crate::grid::{curve_from_table, map_from_table};
use crate::header::ColumnSpec;
use crate::table::CarTable;

const fn column_spec(names: &'static [&'static str], unit: &'static str) -> ColumnSpec {
    ColumnSpec { names, unit }
}

const KINEMATICS: [ColumnSpec; 3] = [
    column_spec(&["travel", "wheel_travel", "jounce", "bump"], "m"),
    column_spec(&["toe", "toe_in", "toe_angle"], "rad"),
    column_spec(&["camber", "camber_angle"], "rad"),
];

const AERO: [ColumnSpec; 5] = [
    column_spec(&["ride_height_f", "front_ride_height", "ride_height_front", "frh", "h_f"], "m"),
    column_spec(&["ride_height_r", "rear_ride_height", "ride_height_rear", "rrh", "h_r"], "m"),
    column_spec(&["C_d", "cx"], "1"),
    column_spec(&["C_lf", "czf", "C_l_front"], "1"),
    column_spec(&["C_lr", "czr", "C_l_rear"], "1"),
];

const BRAKES: [ColumnSpec; 3] = [
    column_spec(&["pedal", "brake"], "1"),
    column_spec(&["torque_f", "front_torque", "torque_front"], "N.m"),
    column_spec(&["torque_r", "rear_torque", "torque_rear"], "N.m"),
];

const ENGINE: [ColumnSpec; 3] = [
    column_spec(&["speed", "engine_speed", "n", "omega", "revs"], "rad/s"),
    column_spec(&["pedal", "throttle", "accelerator"], "1"),
    column_spec(&["torque", "engine_torque"], "N.m"),
];

/// Angles of the wheels of an axle over their travel.
#[derive(Debug, Clone, PartialEq)]
pub struct WheelKinematics {
    /// Toe-in [rad] over travel towards the body [m].
    pub toe: Option<PiecewiseLinearCurve>,
    /// Camber to the body [rad] over travel towards the body [m]: positive leans the top outwards.
    pub camber: Option<PiecewiseLinearCurve>,
}

/// Reads `travel`, `toe` and `camber` of the wheels of an axle.
///
/// # Errors
/// With line and column, as all tables here; also without toe and camber.
pub fn read_kinematics(text: &str) -> Result<WheelKinematics, Error> {
    let table = CarTable::parse(text, &KINEMATICS)?;
    table.required_column(0)?;
    let of = |column: usize| {
        table.optional_column(column).map(|values| curve_from_table(&table, 0, values)).transpose()
    };
    let found = WheelKinematics { toe: of(1)?, camber: of(2)? };
    if found.toe.is_none() && found.camber.is_none() {
        return Err(table.header_error("expected a column `toe [rad]`, `camber [rad]`, or both".to_owned()));
    }
    Ok(found)
}

/// Reads `C_d`, `C_lf` and `C_lr` over `ride_height_f` and `ride_height_r`. Of each at least one is needed; a coefficient without
/// column is that of `constants`.
///
/// # Errors
/// With line and column; when pairs of ride heights are missing or there twice.
pub fn read_aerodynamic_map(text: &str, constants: [f64; 3]) -> Result<BilinearMap<3>, Error> {
    let table = CarTable::parse(text, &AERO)?;
    if table.optional_column(0).is_none() {
        table.required_column(1)?;
    }
    let given = [2, 3, 4].map(|column| table.optional_column(column));
    if given.iter().all(Option::is_none) {
        return Err(table.header_error("expected a column `C_d`, `C_lf`, `C_lr`, or several".to_owned()));
    }
    let fixed = constants.map(|value| vec![value; table.lines.len()]);
    let values: [&[f64]; 3] = std::array::from_fn(|i| given[i].unwrap_or(&fixed[i]));
    map_from_table(&table, [0, 1], values)
}

/// Reads the torques of both brakes of the front and the rear axle, `torque_f` and `torque_r` [N m], over the `pedal` [0 to 1].
///
/// # Errors
/// With line and column; when the pedal leaves 0 to 1.
pub fn read_brake_curves(text: &str) -> Result<[PiecewiseLinearCurve; 2], Error> {
    let table = CarTable::parse(text, &BRAKES)?;
    check_pedal_range(&table, 0)?;
    Ok([
        curve_from_table(&table, 0, table.required_column(1)?)?,
        curve_from_table(&table, 0, table.required_column(2)?)?,
    ])
}

/// Reads the `torque` [N m] of an engine over its `speed` [rad/s]: its full load, or with a column `pedal` [0 to 1] its map.
///
/// # Errors
/// With line and column; when the pedal leaves 0 to 1, when a speed is negative, when pairs are missing or there twice.
pub fn read_engine_torque(text: &str) -> Result<EngineTorque, Error> {
    let table = CarTable::parse(text, &ENGINE)?;
    let (speed, torque) = (table.required_column(0)?, table.required_column(2)?);
    if let Some(row) = speed.iter().position(|speed| *speed < 0.0) {
        let message = format!("expected a speed of at least 0 rad/s, found {}", speed[row]);
        return Err(Error { line: table.lines[row], message });
    }
    if table.optional_column(1).is_none() {
        return curve_from_table(&table, 0, torque).map(EngineTorque::FullLoad);
    }
    check_pedal_range(&table, 1)?;
    map_from_table(&table, [0, 1], [torque]).map(EngineTorque::Pedal)
}

fn check_pedal_range(table: &CarTable, column: usize) -> Result<(), Error> {
    let pedal = table.required_column(column)?;
    match pedal.iter().position(|pedal| !(0.0..=1.0).contains(pedal)) {
        None => Ok(()),
        Some(row) => {
            let found = pedal[row];
            let message = format!(
                "expected `{}` from 0 to 1, found {found}; one in percent is `[%]`",
                table.column_name(column)
            );
            Err(Error { line: table.lines[row], message })
        }
    }
}
