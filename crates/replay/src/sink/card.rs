//! Writes the run card: the run, its options and its ending.

use re_sdk_types::archetypes::TextDocument;
use recording::RunHeader;

use super::trace::SpeedRange;

/// The facts of a run.
pub(super) struct RunCard {
    title: String,
    scenario: String,
    /// Communication step [s].
    step: f64,
    stop: f64,
    seed: u64,
    /// How many signals have curves, of how many recorded ones.
    signals: [usize; 2],
    /// The last time that was recorded [s].
    pub end: f64,
}

impl RunCard {
    pub fn new(header: &RunHeader) -> Self {
        Self {
            title: header.title.clone(),
            scenario: header.scenario.clone(),
            step: header.step,
            stop: header.stop,
            seed: header.seed,
            signals: [header.view.signals.len(), header.columns.number_columns().len()],
            end: 0.0,
        }
    }

    /// The card before the end.
    pub fn card_while_running(&self) -> TextDocument {
        let state = "*This run has not ended yet, or it was cut off.*";
        TextDocument::from_markdown(format!("# {}\n\n{state}\n\n{}", self.title, self.run_facts_markdown("")))
    }

    /// The card at the end; `speeds` [m/s] are the ends of the colour scale.
    pub fn card_after_end(&self, summary: &str, completed: bool, speeds: Option<SpeedRange>) -> TextDocument {
        let colors = speeds.map_or(String::new(), |SpeedRange { slow, fast }| {
            let (slow, fast) = (slow * 3.6, fast * 3.6);
            format!("| Driven line | blue {slow:.0} km/h to yellow {fast:.0} km/h |\n")
        });
        let state = match completed {
            true => String::new(),
            false => {
                format!("## ⚠ NOT COMPLETED: stopped at {:.3} s of {} s\n\n", self.end, self.stop)
            }
        };
        let facts = self.run_facts_markdown(&colors);
        TextDocument::from_markdown(format!("# {}\n\n{state}{summary}\n\n{facts}", self.title))
    }

    fn run_facts_markdown(&self, more: &str) -> String {
        let Self { scenario, step, stop, seed, signals: [replayed, recorded], .. } = self;
        let signals = match recorded - replayed {
            0 => String::new(),
            _ => format!("| Signals | {replayed} of {recorded}; `signals` of `[view]` names more |\n"),
        };
        format!(
            "| Scenario | {scenario} |\n|:--|:--|\n| Time | {stop} s in steps of {} ms |\n\
             | Seed | {seed} |\n{signals}{more}",
            step * 1e3
        )
    }
}
