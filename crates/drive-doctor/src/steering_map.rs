//! Finds what road-wheel angle a steering command makes, and the play of the linkage, from a staircase: steps of the command, each held
//! while the car rolls slowly.
//!
//! In steady slow turns the angle is atan(L r/v_x), but for the slip of the tires, which stays in the map. A linkage with play p
//! follows p behind: the angle is map(command) − p after a step up and map(command) + p after one down.

use serde::Serialize;

use crate::statistics::median;

/// Shortest time for which a command is held [s], and the beginning of it in which actuator and car follow.
const HELD: f64 = 1.5;
const FOLLOWS: f64 = 0.5;
/// Parts of a held command, from whose scatter its interval comes, and the 97.5 % quantile of Student's distribution for them.
const PARTS: usize = 4;
const T_PARTS: f64 = 3.18;
/// Fewest levels of a map.
const LEAST_LEVELS: usize = 3;
/// Slowest speed, as a share of the median of those above 0, at which a curvature is told.
const SLOWEST: f64 = 0.5;
/// 97.5 % quantiles of Student's distribution, by degrees of freedom from 1 on.
const STUDENT: [f64; 9] = [12.7, 4.30, 3.18, 2.78, 2.57, 2.45, 2.36, 2.31, 2.26];

/// A point of the map.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SteeringPoint {
    /// The command.
    pub command: f64,
    /// The angle of the road wheels [rad], in the middle of the play where that is told.
    pub angle: f64,
    /// Its 95 % interval [rad].
    pub interval: [f64; 2],
}

/// What a staircase tells of a steering.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SteeringMap {
    /// Points in the order of their commands; lines between them.
    pub points: Vec<SteeringPoint>,
    /// Half of the distance between both sides of the play [rad]. `None` where no command was reached from both sides.
    pub play: Option<f64>,
    /// Its 95 % interval [rad], from two commands on.
    pub play_interval: Option<[f64; 2]>,
    /// The angle at the command 0 [rad], where the map reaches it.
    pub trim: Option<f64>,
    /// What else would have to be driven.
    pub advice: Option<&'static str>,
}

/// A command that was held.
#[derive(Clone, Copy, Debug)]
struct ConstantCommand {
    command: f64,
    /// Whether it was reached from below (1), from above (−1), or nobody knows (0).
    side: f64,
    angle: f64,
    std: f64,
}

/// The map of a steering, from columns of one length: time [s], command, forward speed [m/s], yaw rate [rad/s]; `wheelbase` in m.
/// Values that are no numbers are left out.
///
/// # Errors
///
/// What the log lacks, and what to drive instead.
pub fn steering_map(
    time: &[f64],
    command: &[f64],
    v_x: &[f64],
    r: &[f64],
    wheelbase: f64,
) -> Result<SteeringMap, String> {
    let lengths = [time.len(), command.len(), v_x.len(), r.len()];
    if lengths.iter().any(|len| *len != lengths[0]) {
        return Err(format!("expected time, command, v_x and r of one length, found {lengths:?} values"));
    }
    if !(wheelbase > 0.0 && wheelbase.is_finite()) {
        return Err(format!("expected a wheelbase above 0 m, found {wheelbase}"));
    }
    let slowest = SLOWEST * median(v_x.iter().copied().filter(|v| *v > 0.0));
    let angle = |k: usize| match v_x[k] > slowest {
        true => (wheelbase * r[k] / v_x[k]).atan(),
        false => f64::NAN,
    };
    let angles: Vec<f64> = (0..time.len()).map(angle).collect();
    let held = held_commands(time, command, &angles);
    let levels = group_by_command(&held);
    if levels.len() < LEAST_LEVELS {
        return Err(format!(
            "the map of the steering is not identifiable: {} commands are held for {HELD} s or more while the car rolls, of {LEAST_LEVELS} that are needed. Drive a staircase: slow turns with steps of the command over its range, up and down again, each held for some seconds",
            levels.len()
        ));
    }
    Ok(steering_map_from_commands(&levels))
}

/// The commands that are held, one after the other.
fn held_commands(time: &[f64], command: &[f64], angles: &[f64]) -> Vec<ConstantCommand> {
    let mut all = Vec::new();
    let (mut from, mut before) = (0, f64::NAN);
    for run in command.chunk_by(|a, b| a == b) {
        let rows = from..from + run.len();
        from = rows.end;
        let settled = time[rows.start] + FOLLOWS;
        let long = time[rows.end - 1] - time[rows.start] >= HELD && run[0].is_finite();
        let used: Vec<f64> =
            rows.filter(|&k| time[k] >= settled && angles[k].is_finite()).map(|k| angles[k]).collect();
        if long && used.len() >= 2 * PARTS {
            let parts: Vec<f64> =
                used.chunks(used.len().div_ceil(PARTS)).map(|part| median(part.iter().copied())).collect();
            let count = parts.len() as f64;
            let angle = parts.iter().sum::<f64>() / count;
            let squares: f64 = parts.iter().map(|part| (part - angle).powi(2)).sum();
            let side = if before.is_nan() { 0.0 } else { (run[0] - before).signum() };
            let std = (squares / (count * (count - 1.0).max(1.0))).sqrt();
            all.push(ConstantCommand { command: run[0], side, angle, std });
        }
        if run[0].is_finite() {
            before = run[0];
        }
    }
    all
}

/// Those of each command, in the order of the commands.
fn group_by_command(held: &[ConstantCommand]) -> Vec<Vec<ConstantCommand>> {
    let mut held = held.to_vec();
    held.sort_by(|a, b| a.command.total_cmp(&b.command));
    held.chunk_by(|a, b| a.command == b.command).map(<[ConstantCommand]>::to_vec).collect()
}

/// The mean angle of those that were reached from a side.
fn from_side(level: &[ConstantCommand], side: f64) -> Option<f64> {
    let angles: Vec<f64> = level.iter().filter(|it| it.side == side).map(|it| it.angle).collect();
    (!angles.is_empty()).then(|| angles.iter().sum::<f64>() / angles.len() as f64)
}

fn steering_map_from_commands(levels: &[Vec<ConstantCommand>]) -> SteeringMap {
    let plays: Vec<f64> = levels
        .iter()
        .filter_map(|level| Some(0.5 * (from_side(level, -1.0)? - from_side(level, 1.0)?)))
        .collect();
    let count = plays.len() as f64;
    let play = (!plays.is_empty()).then(|| plays.iter().sum::<f64>() / count);
    let play_interval = play.filter(|_| plays.len() > 1).map(|play| {
        let squares: f64 = plays.iter().map(|it| (it - play).powi(2)).sum();
        let std = (squares / (count * (count - 1.0))).sqrt();
        let reach = STUDENT.get(plays.len() - 2).unwrap_or(&2.2) * std;
        [play - reach, play + reach]
    });
    let point = |level: &Vec<ConstantCommand>| {
        // The side of the play on which a log begins nobody knows.
        let (known, unknown): (Vec<ConstantCommand>, Vec<ConstantCommand>) =
            level.iter().partition(|it| it.side != 0.0);
        let level = if known.is_empty() { unknown } else { known };
        let count = level.len() as f64;
        let middle = |it: &ConstantCommand| it.angle + it.side * play.unwrap_or(0.0);
        let angle = level.iter().map(middle).sum::<f64>() / count;
        let std = level.iter().map(|it| it.std.powi(2)).sum::<f64>().sqrt() / count;
        let interval = [angle - T_PARTS * std, angle + T_PARTS * std];
        SteeringPoint { command: level[0].command, angle, interval }
    };
    let points: Vec<SteeringPoint> = levels.iter().map(point).collect();
    let around = points.windows(2).find(|pair| pair[0].command <= 0.0 && pair[1].command >= 0.0);
    let trim = around.map(|pair| {
        let share = -pair[0].command / (pair[1].command - pair[0].command);
        pair[0].angle + share * (pair[1].angle - pair[0].angle)
    });
    let advice = match (play, trim) {
        (None, _) => Some(
            "No command was reached from both sides, so the play is in the angles: drive the staircase up and down.",
        ),
        (_, None) => Some("The commands stay on one side of 0: turn to both sides for the trim."),
        _ => None,
    };
    SteeringMap { points, play, play_interval, trim, advice }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A staircase with a play of 0.015 rad and a bent map, at 20 Hz.
    fn staircase(commands: &[f64]) -> [Vec<f64>; 4] {
        let (mut columns, mut before) = ([const { Vec::new() }; 4], 0.0);
        for (step, &command) in commands.iter().enumerate() {
            let side = (command - before).signum();
            before = command;
            let angle = true_angle(command) - 0.015 * side;
            for row in 0..80 {
                let t = 4.0 * step as f64 + 0.05 * f64::from(row);
                let follows = if row < 6 { angle - 0.02 * side } else { angle };
                let v_x = 0.4 + 0.05 * (1.3 * t).sin();
                let noise = 0.02 * (7.1 * t).sin();
                let row = [t, command, v_x, v_x * follows.tan() / 0.1735 + noise];
                columns.iter_mut().zip(row).for_each(|(column, value)| column.push(value));
            }
        }
        columns
    }

    fn true_angle(command: f64) -> f64 {
        if command > 0.0 { 0.42 * command - 0.01 } else { 0.46 * command - 0.01 }
    }

    #[test]
    fn map_play_and_trim_of_a_staircase_up_and_down_are_found() {
        let up = (0..=8).map(|k| 0.2 * f64::from(k) - 0.8);
        let down = (0..8).rev().map(|k| 0.2 * f64::from(k) - 0.8);
        let commands: Vec<f64> = up.chain(down).collect();
        let [t, command, v_x, r] = staircase(&commands);
        let found = steering_map(&t, &command, &v_x, &r, 0.1735).expect("a map");
        let play = found.play.expect("play");
        assert!((play - 0.015).abs() < 0.002, "{found:#?}");
        let [low, high] = found.play_interval.expect("an interval");
        assert!(low < 0.015 && 0.015 < high && high - low < 0.006, "{found:#?}");
        assert!(found.trim.is_some_and(|trim| (trim + 0.01).abs() < 0.005), "{found:#?}");
        for point in &found.points {
            let truth = true_angle(point.command);
            assert!((point.angle - truth).abs() < 0.006, "{point:?}, {truth}");
        }
    }

    #[test]
    fn a_staircase_to_one_side_has_no_play_and_says_so() {
        let [t, command, v_x, r] = staircase(&[0.2, 0.4, 0.6, 0.8]);
        let found = steering_map(&t, &command, &v_x, &r, 0.1735).expect("a map");
        assert!(found.play.is_none() && found.trim.is_none());
        assert!(found.advice.is_some_and(|advice| advice.contains("up and down")), "{found:?}");
    }

    #[test]
    fn circles_and_nonsense_are_refused() {
        let [t, command, v_x, r] = staircase(&[0.5]);
        let circle = steering_map(&t, &command, &v_x, &r, 0.1735).expect_err("one command");
        assert!(circle.contains("not identifiable: 1 commands"), "{circle}");
        assert!(steering_map(&t, &command, &v_x, &r, 0.0).is_err());
        assert!(steering_map(&t, &command[1..], &v_x, &r, 0.1735).is_err());
        assert!(steering_map(&[], &[], &[], &[], 1.0).is_err());
        let none = vec![f64::NAN; t.len()];
        assert!(steering_map(&t, &none, &none, &none, 1.0).is_err());
    }
}
