//! Reads logs of real cars, where they are.

use std::collections::BTreeMap;
use std::path::PathBuf;

use vehicle::VehicleBody;

/// A log: columns of one length.
pub struct Log {
    pub car: Car,
    /// Time between two rows [s].
    pub period: f64,
    pub v_x: Vec<f64>,
    pub v_y: Vec<f64>,
    pub r: Vec<f64>,
    pub r_rate: Vec<f64>,
    pub a_y: Vec<f64>,
    pub delta: Vec<f64>,
    /// Rows that count.
    pub ok: Vec<bool>,
}

/// A car, and from which speed on its rows count [m/s].
#[derive(Clone, Copy)]
pub struct Car {
    pub body: VehicleBody,
    pub v_x_min: f64,
}

/// A car 1:10 of TU Delft; of its yaw inertia the source says a formula with a small box.
pub const DART: Car = Car {
    body: VehicleBody {
        m: 1.58,
        I_zz: 0.00481,
        l_f: 0.1735 * 0.733 / 1.58,
        l_r: 0.1735 * 0.847 / 1.58,
        h: 0.0,
    },
    v_x_min: 0.6,
};

/// A Ferrari 250 LM of the Revs Program.
pub const LM: Car =
    Car { body: VehicleBody { m: 982.0, I_zz: 1605.0, l_f: 1.33, l_r: 1.07, h: 0.0 }, v_x_min: 12.0 };

/// Lag of the small car's steering [s].
const STEERING_LAG: f64 = 0.06;

/// Columns of a table, if the file is there. `TRACKSIDE_DATA` names another folder to look in.
fn columns(file: &str) -> Option<BTreeMap<String, Vec<f64>>> {
    let beside = || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let folder = std::env::var_os("TRACKSIDE_DATA").map_or_else(beside, PathBuf::from);
    let path = folder.join(file);
    let Ok(text) = std::fs::read_to_string(&path) else {
        println!("skipped: {} is not there", path.display());
        return None;
    };
    let mut lines = text.lines();
    let names = lines.next()?.split(',');
    let rows: Vec<Vec<f64>> =
        lines.map(|line| line.split(',').map(|it| it.parse().unwrap_or(f64::NAN)).collect()).collect();
    let column = |i: usize| rows.iter().map(|row| row[i]).collect();
    Some(names.enumerate().map(|(i, name)| (name.to_owned(), column(i))).collect())
}

/// A log of the small car: `circles_tape_left`.
pub fn dart(name: &str) -> Option<Log> {
    let mut columns = columns(&format!("dart_{name}.csv"))?;
    let mut take = |name: &str| columns.remove(name).expect(name);
    let (v_x, gap, told) = (take("v_x"), take("gap"), take("steering_angle_rad"));
    let ok = v_x.iter().zip(&gap).map(|(v, gap)| *v > DART.v_x_min && *gap == 0.0).collect();
    let kept = (-0.01 / STEERING_LAG).exp();
    let mut lagged = told[0];
    let delta = told.iter().map(|now| {
        lagged = now + kept * (lagged - now);
        lagged
    });
    Some(Log {
        car: DART,
        period: 0.01,
        v_y: take("v_y"),
        r: take("yaw_rate"),
        r_rate: take("yaw_acc"),
        a_y: take("a_y"),
        delta: delta.collect(),
        v_x,
        ok,
    })
}

/// The log of the Ferrari, with a_y in the mean of 0.11 s and the yaw acceleration from such means.
pub fn ferrari() -> Option<Log> {
    let mut columns = columns("revs_250lm.csv")?;
    let mut take = |name: &str| columns.remove(name).expect(name);
    let (v_x, r) = (take("vx_mps"), take("yaw_rate_radps"));
    let smooth = mean_of(&r, 5);
    let last = r.len() - 1;
    let r_rate =
        (0..r.len()).map(|k| (smooth[(k + 5).min(last)] - smooth[k.saturating_sub(5)]) / 0.1).collect();
    let ok = v_x.iter().map(|v| *v > LM.v_x_min).collect();
    let (v_y, a_y, delta) = (take("vy_mps"), mean_of(&take("ay_mps2"), 5), take("delta_rad"));
    Some(Log { car: LM, period: 0.01, v_y, r, r_rate, a_y, delta, v_x, ok })
}

/// The mean of the rows up to `reach` before and after each.
fn mean_of(values: &[f64], reach: usize) -> Vec<f64> {
    let mean = |k: usize| {
        let part = &values[k.saturating_sub(reach)..(k + reach + 1).min(values.len())];
        part.iter().sum::<f64>() / part.len() as f64
    };
    (0..values.len()).map(mean).collect()
}
