//! What a page shows of the test that a manoeuvre is: its track, stages and diagrams.

use manoeuvre::{Manoeuvre, TestDiagram, TestStage, TestTrack};

/// What there is to draw of a test.
#[derive(Debug, Clone)]
pub struct TestPicture {
    /// Its name in the scenario.
    pub name: String,
    /// What it is called, with its standard.
    pub title: &'static str,
    /// The speed at which the test begins [m/s].
    pub entry_speed: f64,
    /// Its track on the ground.
    pub track: Option<TestTrack>,
    /// The stages that it came to, each with its beginning [s].
    pub stages: Vec<(f64, &'static str)>,
    /// When it was over [s].
    pub end: Option<f64>,
    /// The diagrams of a completed test, over the time of the run.
    pub diagrams: Vec<TestDiagram>,
}

impl TestPicture {
    /// The picture of a test that nothing is known of but its commands and measurements.
    #[must_use]
    pub fn new(name: &str, manoeuvre: &Manoeuvre, time: &[f64], phase: &[f64], inputs: &[Vec<f64>]) -> Self {
        let names = manoeuvre.kind.stage_names();
        let mut stages: Vec<(f64, &'static str)> = Vec::new();
        let mut before = 0.0;
        for (time, phase) in time.iter().zip(phase).filter(|(_, phase)| **phase > 0.0) {
            if *phase != before {
                stages.extend(names.get(*phase as usize - 1).map(|stage| (*time, *stage)));
                before = *phase;
            }
        }
        let over = phase.iter().position(|phase| *phase == f64::from(TestStage::OVER));
        TestPicture {
            name: name.to_owned(),
            title: manoeuvre.kind.kind_title(),
            entry_speed: manoeuvre.kind.test_entry_speed(&manoeuvre.common),
            track: manoeuvre.test_track(phase, inputs),
            stages,
            end: over.and_then(|place| time.get(place).copied()),
            diagrams: Vec::new(),
        }
    }
}
