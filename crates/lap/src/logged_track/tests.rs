//! Tracks from simulated logs of a known line: noise, drift, pits, gaps, spikes.

use std::path::Path;

use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use track::{LocalPlane, TrackLine, TrackSurvey};

use super::{LoggedTrack, LoggedTrackOptions};
use crate::Error;
use crate::driven_lap::PositionSample;

fn road_course() -> TrackLine {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios/tracks/road_course.csv");
    TrackLine::from_table_text(&std::fs::read_to_string(path).expect("a track")).expect("a line")
}

/// A drive along a line at 20 m/s, logged at 10 Hz, from one station to another one [m], with a lateral deviation [m] of the way [m].
fn drive(line: &TrackLine, from: f64, to: f64, deviation: impl Fn(f64) -> f64) -> Vec<PositionSample> {
    let count = ((to - from) / 2.0) as usize;
    let sample = |i: usize| {
        let s = from + 2.0 * i as f64;
        let place = line.point_at(s.rem_euclid(line.length()));
        let n = deviation(s);
        let (sin, cos) = place.psi.sin_cos();
        PositionSample { t: 0.1 * i as f64, position: [place.point[0] - n * sin, place.point[1] + n * cos] }
    };
    (0..count).map(sample).collect()
}

/// Adds noise with a standard deviation of 0.17 m.
fn add_noise(samples: &mut [PositionSample]) {
    let mut random = Pcg64::seed_from_u64(4);
    for sample in samples {
        for value in &mut sample.position {
            // The sum of twelve uniform numbers has a variance of 1.
            *value += 0.17 * ((0..12).map(|_| random.random_range(0.0..1.0)).sum::<f64>() - 6.0);
        }
    }
}

fn find(samples: &[PositionSample]) -> LoggedTrack {
    LoggedTrack::find(samples, &LoggedTrackOptions::default()).expect("a track")
}

/// The largest deviation of a track from the line that was driven [m], and that of its curvature [1/m], as the root of the mean square.
fn deviations(found: &TrackSurvey, line: &TrackLine) -> (f64, f64) {
    let track = TrackLine::from_survey(found).expect("a line");
    let (mut farthest, mut squares) = (0.0_f64, 0.0);
    for point in &found.points {
        let driven = line.locate_point(*point, None);
        farthest = farthest.max(driven.lateral.abs());
        squares += (track.locate_point(*point, Some(driven.psi)).kappa - driven.kappa).powi(2);
    }
    (farthest, (squares / found.points.len() as f64).sqrt())
}

#[test]
fn laps_with_noise_give_their_line() {
    let line = road_course();
    let mut samples = drive(&line, 300.0, 300.0 + 4.5 * line.length(), |_| 0.0);
    add_noise(&mut samples);
    let track = find(&samples);
    assert_eq!(track.laps.len(), 4);
    for lap in &track.laps {
        assert!(lap.counts && (lap.lap_time - line.length() / 20.0).abs() < 0.05, "{lap:?}");
    }
    assert!(track.survey.closed && (track.length - line.length()).abs() < 1.0, "{}", track.length);
    // A part of the errors along the way is taken for way.
    assert!((0.1..0.17).contains(&track.noise), "{}", track.noise);
    let (farthest, curvature) = deviations(&track.survey, &line);
    assert!(farthest < 0.25 && curvature < 2e-3, "{farthest} {curvature}");
}

#[test]
fn the_line_is_the_mean_of_laps_on_both_sides_and_the_widths_hold_them() {
    let line = road_course();
    let length = line.length();
    // The first lap goes up to 1 m to the left, the second one to the right.
    let deviation = |s: f64| (std::f64::consts::PI * s / length).sin();
    let samples = drive(&line, -200.0, 2.0 * length + 250.0, deviation);
    let options = LoggedTrackOptions { start: Some([0.0, 0.0]), ..LoggedTrackOptions::default() };
    let track = LoggedTrack::find(&samples, &options).expect("a track");
    assert_eq!(track.laps.len(), 2);
    // A line that leaves the positions 5 cm beside it cuts the corners a little.
    let (farthest, _) = deviations(&track.survey, &line);
    assert!(farthest < 0.3, "{farthest}");
    let widths = track.survey.widths.expect("widths");
    let middle = widths[widths.len() / 2];
    assert!(middle.iter().all(|width| (width - 2.0).abs() < 0.1), "{middle:?}");
    assert!((track.spread - 2.0).abs() < 0.2, "{}", track.spread);
}

#[test]
fn a_lap_of_a_drifting_receiver_is_closed() {
    let line = road_course();
    let mut samples = drive(&line, 0.0, line.length() + 60.0, |_| 0.0);
    for (i, sample) in samples.iter_mut().enumerate() {
        sample.position[1] += 0.004 * i as f64;
    }
    let track = find(&samples);
    assert_eq!(track.laps.len(), 1);
    let (farthest, curvature) = deviations(&track.survey, &line);
    // It has drifted by 3 m.
    assert!(farthest < 3.2 && curvature < 2e-3, "{farthest} {curvature}");
    assert!(track.survey.widths.is_none());
}

#[test]
fn standing_spikes_and_laps_of_another_length_do_not_count() {
    let line = road_course();
    // The second lap takes a way round, 150 m to the side and back.
    let detour = |s: f64| match s - 1.6 * line.length() {
        s if (0.0..300.0).contains(&s) => 150.0 * (std::f64::consts::PI * s / 300.0).sin().powi(2),
        _ => 0.0,
    };
    let mut samples = drive(&line, 100.0, 100.0 + 3.4 * line.length(), detour);
    samples[777].position = [1e5, -1e5];
    samples[900].position[0] = f64::NAN;
    // Before, the car stands for a minute.
    let begin = samples[0].position;
    let standing = (0..600).map(|i| PositionSample { t: 0.1 * f64::from(i) - 60.0, position: begin });
    let mut all: Vec<PositionSample> = standing.collect();
    all.extend(samples);
    add_noise(&mut all);
    let track = find(&all);
    let counted: Vec<bool> = track.laps.iter().map(|lap| lap.counts).collect();
    assert_eq!(counted, [true, false, true]);
    let (farthest, _) = deviations(&track.survey, &line);
    assert!(farthest < 0.4, "{farthest}");
}

/// Times of samples that are put behind one another.
fn at_ten_hertz(positions: impl IntoIterator<Item = [f64; 2]>) -> Vec<PositionSample> {
    let sample = |(i, position)| PositionSample { t: 0.1 * i as f64, position };
    positions.into_iter().enumerate().map(sample).collect()
}

#[test]
fn a_car_that_rolls_back_stands_or_turns_round_leaves_no_loop() {
    let line = road_course();
    let drive: Vec<[f64; 2]> =
        drive(&line, 100.0, 100.0 + 3.4 * line.length(), |_| 0.0).iter().map(|it| it.position).collect();
    let at = 300;
    let back: Vec<[f64; 2]> = drive[at - 10..at].iter().rev().copied().collect();
    let circle = (0..40).map(|i| {
        let angle = 0.2 * f64::from(i);
        [drive[at][0] + 5.0 * (angle.cos() - 1.0), drive[at][1] + 5.0 * angle.sin()]
    });
    let wander = (0..300).map(|i| {
        let angle = 0.37 * f64::from(i);
        [drive[at][0] + 1.5 * angle.sin(), drive[at][1] + 1.5 * (1.7 * angle).cos()]
    });
    for stay in [[&back[..], &drive[at - 10..at]].concat(), circle.collect(), wander.collect()] {
        let track = find(&at_ten_hertz([&drive[..at], &stay, &drive[at..]].concat()));
        let (farthest, _) = deviations(&track.survey, &line);
        assert!((track.length - line.length()).abs() < 5.0 && farthest < 0.6, "{} {farthest}", track.length);
        assert!(track.spread < 4.0, "{}", track.spread);
    }
}

#[test]
fn laps_beside_the_others_and_of_another_layout_do_not_count() {
    let line = road_course();
    let length = line.length();
    // The second of four laps goes through the pits, 15 m aside over 400 m.
    let pits = |s: f64| match s - 1.5 * length {
        s if (0.0..400.0).contains(&s) => 15.0 * (4.0 * (std::f64::consts::PI * s / 400.0).sin()).min(1.0),
        _ => 0.0,
    };
    let track = find(&drive(&line, 100.0, 100.0 + 4.4 * length, pits));
    let counted: Vec<bool> = track.laps.iter().map(|lap| lap.counts).collect();
    assert_eq!(counted.iter().filter(|counts| !**counts).count(), 1, "{:?}", track.laps);
    let (farthest, _) = deviations(&track.survey, &line);
    assert!(farthest < 0.4, "{farthest}");
    // A line of a hill that was driven three times, with the recorder off on the way down.
    let hill: Vec<[f64; 2]> = drive(&line, 0.0, 800.0, |_| 0.0).iter().map(|it| it.position).collect();
    let track = find(&at_ten_hertz([&hill[..], &hill, &hill].concat()));
    assert!(!track.survey.closed && (track.length - 800.0).abs() < 10.0, "{}", track.length);
}

#[test]
fn a_drive_without_a_lap_is_an_open_line() {
    let line = road_course();
    let samples = drive(&line, 0.0, 900.0, |_| 0.0);
    let track = find(&samples);
    assert!(!track.survey.closed && track.laps.is_empty());
    let (farthest, _) = deviations(&track.survey, &line);
    assert!(farthest < 0.3 && (track.length - 900.0).abs() < 5.0, "{farthest} {}", track.length);
}

#[test]
fn the_export_of_one_lap_is_closed() {
    let line = road_course();
    let samples = drive(&line, 400.0, 400.0 + line.length(), |_| 0.0);
    let track = find(&samples);
    assert!(track.survey.closed && track.laps.len() == 1, "{:?}", track.laps);
    assert!((track.laps[0].lap_time - line.length() / 20.0).abs() < 0.02, "{:?}", track.laps);
    let (farthest, curvature) = deviations(&track.survey, &line);
    assert!(farthest < 0.3 && curvature < 2e-3, "{farthest} {curvature}");
}

#[test]
fn the_crossing_of_an_eight_ends_no_lap() {
    let point = |i: i32| {
        let angle = std::f64::consts::TAU * f64::from(i) / 500.0;
        PositionSample {
            t: 0.2 * f64::from(i),
            position: [300.0 * angle.sin(), 200.0 * angle.sin() * angle.cos()],
        }
    };
    let samples: Vec<PositionSample> = (30..1700).map(point).collect();
    let track = find(&samples);
    assert!((2..=3).contains(&track.laps.len()), "{:?}", track.laps);
    assert!(
        track.laps.iter().all(|lap| lap.counts && (lap.lap_time - 100.0).abs() < 0.1),
        "{:?}",
        track.laps
    );
}

#[test]
fn what_is_no_drive_is_told() {
    let error = |samples: &[PositionSample], start: Option<[f64; 2]>| {
        let options = LoggedTrackOptions { start, ..LoggedTrackOptions::default() };
        match LoggedTrack::find(samples, &options) {
            Err(Error::Log(message)) => message,
            other => panic!("{other:?}"),
        }
    };
    let standing: Vec<PositionSample> =
        (0..500).map(|i| PositionSample { t: f64::from(i), position: [3.0, 4.0] }).collect();
    assert!(error(&standing, None).contains("expected the positions of a drive"));
    assert!(error(&[], None).contains("found 0"));
    let line = road_course();
    let drive = drive(&line, 0.0, 2.5 * line.length(), |_| 0.0);
    assert!(error(&drive, Some([1e4, 0.0])).contains("expected a start beside the path"));
    let once: Vec<PositionSample> = drive[..400].to_vec();
    assert!(error(&once, Some(drive[200].position)).contains("passes it 1 times"));
}

#[test]
fn no_log_is_too_odd() {
    let mut random = Pcg64::seed_from_u64(11);
    for round in 0..60 {
        let scale = 10_f64.powi(round % 8);
        let mut t = 0.0;
        let mut position = [0.0; 2];
        let samples: Vec<PositionSample> = (0..300)
            .map(|_| {
                t += random.random_range(-0.1..1.0);
                position = position.map(|value| value + scale * random.random_range(-1.0..1.2));
                PositionSample { t, position }
            })
            .collect();
        if let Ok(track) = LoggedTrack::find(&samples, &LoggedTrackOptions::default()) {
            assert!(track.survey.points.iter().flatten().all(|it| it.is_finite()), "{round}");
        }
    }
}

#[test]
fn a_table_is_read_as_it_was_written() {
    let line = road_course();
    let mut survey = find(&drive(&line, 0.0, 2.2 * line.length(), |_| 0.0)).survey;
    survey.plane = Some(LocalPlane { latitude: -33.801, longitude: 150.870_5 });
    let read = TrackSurvey::from_table_text(&survey.table_text()).expect("a table");
    assert_eq!((read.closed, read.plane, read.points.len()), (true, survey.plane, survey.points.len()));
    for (a, b) in read.points.iter().zip(&survey.points) {
        assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 1e-3);
    }
}
