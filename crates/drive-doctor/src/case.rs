//! Holds the log under examination, as the checks so far correct it, with what they found.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use std::collections::BTreeMap;
use std::f64::consts::PI;

use preparation::{DriveLog, Signal};
use vehicle::{Aerodynamics, G};

use crate::channel::CHANNELS;
use crate::finding::{LogExamination, LogFinding, UnansweredCheck};
use crate::statistics::median_step;

/// Takes the leaps out of a course that begins again after a turn, and brings it to rad: only degrees go beyond 7.
fn unwrap_course_angle(course: &mut Signal) {
    let is_in_deg = course.value.iter().any(|angle| angle.abs() > 7.0 && angle.is_finite());
    let factor = if is_in_deg { PI / 180.0 } else { 1.0 };
    let mut latest = f64::NAN;
    for angle in course.value.to_mut().iter_mut().filter(|angle| angle.is_finite()) {
        let turned = *angle * factor;
        *angle = match latest.is_nan() {
            true => turned,
            false => latest + (turned - latest + PI).rem_euclid(2.0 * PI) - PI,
        };
        latest = *angle;
    }
}

/// Rows before and after one between whose places the car travels in its direction.
const APART: usize = 5;

/// The direction of travel of a car that was at these places; left turns are positive. `None` of a car that stays.
fn course_from_positions(x: &Signal, y: &Signal) -> Option<(&'static str, Signal<'static>)> {
    let rows = APART..x.time.len().checked_sub(APART).filter(|end| *end > APART)?;
    let moved = |k: usize| [x, y].map(|it| it.value[k + APART] - it.value[k - APART]);
    let stays = rows.clone().all(|k| moved(k) == [0.0; 2]);
    if x.time != y.time || stays {
        return None;
    }
    let direction = |k: usize| {
        let [along, across] = moved(k);
        across.atan2(along)
    };
    let (time, value) = (x.time[rows.clone()].to_vec(), rows.map(direction).collect::<Vec<f64>>());
    let mut course = Signal::new(time, value);
    unwrap_course_angle(&mut course);
    Some(("course", course))
}

/// What is known of the car; each of it makes more checks possible.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CarData {
    /// Distance between the axles [m].
    pub wheelbase: Option<f64>,
    /// Distances of the centre of gravity to the front and the rear axle [m].
    pub axles: Option<[f64; 2]>,
    /// Mass [kg].
    pub m: Option<f64>,
    /// Downforce, by which tires stiffen with speed.
    pub aero: Option<Aerodynamics>,
}

impl CarData {
    /// Distance between the axles [m].
    pub fn wheelbase(&self) -> Option<f64> {
        self.wheelbase.or(self.axles.map(|[l_f, l_r]| l_f + l_r))
    }

    /// The loads of both axles at rest over those at a speed [m/s]; 1 where downforce is not known.
    pub(crate) fn load_ratios(&self, v_x: f64) -> [f64; 2] {
        let (Some(aero), Some(m), Some([l_f, l_r])) = (self.aero, self.m, self.axles) else {
            return [1.0; 2];
        };
        let at_rest = [l_r, l_f].map(|arm| m * G * arm / (l_f + l_r));
        let [front, rear] = aero.downforce(v_x);
        [at_rest[0] / (at_rest[0] + front), at_rest[1] / (at_rest[1] + rear)]
    }
}

/// A log under examination.
#[derive(Debug)]
pub(crate) struct ExaminedLog<'a> {
    pub signals: BTreeMap<&'static str, Signal<'a>>,
    pub car: CarData,
    pub found: LogExamination,
    /// Whether the car turns to one side only, or not at all.
    pub is_one_sided: bool,
    /// Sensors whose end cuts the motion off.
    pub cut_off: Vec<&'static str>,
    /// By how much the yaw rate was moved against all other channels [s].
    pub r_moved: f64,
    /// The longest time for which a sensor holds a value [s]: no clock is known better than to half of it.
    pub held: f64,
    /// Whether the steering ratio was found, and so is known roughly only.
    pub is_ratio_rough: bool,
}

impl<'a> ExaminedLog<'a> {
    pub fn new(log: &'a DriveLog, car: CarData) -> Self {
        let names = CHANNELS.into_iter().map(|(name, _)| name);
        let mut signals: BTreeMap<_, _> =
            names.filter_map(|name| Some((name, log.get(name)?.borrowed()))).collect();
        let places = signals.remove("x").zip(signals.remove("y"));
        match signals.get_mut("course") {
            Some(course) => unwrap_course_angle(course),
            None => signals.extend(places.and_then(|(x, y)| course_from_positions(&x, &y))),
        }
        Self {
            signals,
            car,
            found: LogExamination::default(),
            is_one_sided: false,
            cut_off: Vec::new(),
            r_moved: 0.0,
            held: 0.0,
            is_ratio_rough: false,
        }
    }

    /// For how long a value of a channel stands [s]: over a row, or as long as a sensor holds it.
    pub fn clock_step(&self, name: &str) -> f64 {
        self.signals.get(name).map_or(0.0, |signal| median_step(&signal.time)).max(self.held)
    }

    pub fn has_channels(&self, names: &[&str]) -> bool {
        names.iter().all(|name| self.signals.contains_key(name))
    }

    /// Gives each of two channels the values of the other.
    pub fn swap_channels(&mut self, a: &'static str, b: &'static str) {
        let [of_a, of_b] = [a, b].map(|name| self.signals.remove(name));
        self.signals.extend(of_b.map(|signal| (a, signal)));
        self.signals.extend(of_a.map(|signal| (b, signal)));
    }

    pub fn add_finding(&mut self, finding: LogFinding) {
        self.found.findings.push(finding);
    }

    pub fn add_open_question(&mut self, check: &'static str, reason: String, advice: &'static str) {
        self.found.not_told.push(UnansweredCheck { check, reason, advice });
    }

    /// Divides a channel by a factor and brings it `delay` [s] forward, for the checks that follow.
    pub fn correct_channel(&mut self, name: &str, factor: f64, delay: f64) {
        if let Some(signal) = self.signals.get_mut(name) {
            signal.value.to_mut().iter_mut().for_each(|value| *value /= factor);
            signal.time.to_mut().iter_mut().for_each(|time| *time -= delay);
        }
    }

    pub fn into_examination(mut self) -> LogExamination {
        self.found.sort_findings();
        self.found
    }
}
