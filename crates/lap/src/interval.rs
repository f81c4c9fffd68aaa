//! Turns what is not known of a car into an interval of its lap time: one fastest lap for each draw of its parameters.

use std::iter;
use std::sync::atomic::{AtomicBool, Ordering};

use numerics::statistics::{central_95_percent_interval, quantile, std};
use rayon::prelude::*;
use track::TrackLine;

use crate::draws::ParameterDraw;
use crate::interior_point::InteriorPointStatus;
use crate::optimum::LapOptimum;
use crate::parameters::CarParameters;
use crate::{Error, LapOptions};

/// Draws that start from the first lap. Each later round has as many draws as there were before it.
const FIRST_ROUND: usize = 8;

/// Lap times of the draws.
#[derive(Clone, Debug, PartialEq)]
pub struct LapTimeInterval {
    /// Lap times of the draws that were solved [s], from the fastest on.
    pub lap_times: Vec<f64>,
    /// Lap time of each draw [s], in their order; none where it was not solved.
    pub by_draw: Vec<Option<f64>>,
    /// Lateral deviation of each node in the draws [m]: the 2.5 % and the 97.5 % quantile.
    pub deviations: Vec<[f64; 2]>,
    /// Draws whose search did not converge, or that are no car.
    pub unsolved: usize,
    /// Why the first of them was not solved.
    pub first_failure: Option<String>,
}

impl LapTimeInterval {
    /// A quantile of the lap times [s], from 0 to 1, linear between the draws; NaN without a draw that was solved.
    ///
    /// It is that at p (n + 1) of n draws (type 6 of Hyndman and Fan 1996): one more draw, as the truth is where draws are right, is below it with
    /// the probability p. The usual quantile at p (n − 1) lets the middle 95 % of 100 draws hold 93.1 %. With fewer than 39 draws these are all.
    pub fn quantile(&self, share: f64) -> f64 {
        let count = self.lap_times.len() as f64;
        let place = (share * (count + 1.0) - 1.0) / f64::max(count - 1.0, 1.0);
        quantile(&self.lap_times, place.clamp(0.0, 1.0))
    }
}

impl LapOptimum {
    /// The fastest laps of cars with these draws, each from this lap or that of a draw that is nearer. `on_solved` is called after each, on
    /// any thread; `false` leaves out those that have not begun.
    ///
    /// # Errors
    /// When no draw was solved.
    pub fn lap_time_interval(
        &self,
        parameters: &CarParameters,
        draws: &[ParameterDraw],
        line: &TrackLine,
        options: &LapOptions,
        on_solved: impl Fn() -> bool + Sync,
    ) -> Result<LapTimeInterval, Error> {
        let is_cancelled = AtomicBool::new(false);
        let lap_of = |draw: &ParameterDraw, start: &LapOptimum| {
            let mut drawn = parameters.clone();
            for (key, value) in draw {
                drawn.set_number(key, *value).map_err(|message| format!("{}: {message}", key.name))?;
            }
            let (car, _) = drawn.car()?;
            let lap = start.find_similar(&car, line, options).map_err(|error| error.to_string())?;
            match lap.status {
                InteriorPointStatus::Converged => Ok(lap),
                _ => Err("the search did not converge".to_owned()),
            }
        };
        let solve = |draw: &ParameterDraw, start: &LapOptimum| {
            if is_cancelled.load(Ordering::Relaxed) {
                return Err("the search was given up".to_owned());
            }
            let lap = lap_of(draw, start);
            is_cancelled.fetch_or(!on_solved(), Ordering::Relaxed);
            lap
        };
        let scales = scales(draws);
        let car_values: ParameterDraw =
            draws.iter().take(1).flatten().map(|(key, _)| (*key, key.value(parameters))).collect();
        let mut laps: Vec<Result<LapOptimum, String>> = Vec::with_capacity(draws.len());
        // A draw starts from one of an earlier round, so that the laps are the same on any number of threads.
        while laps.len() < draws.len() {
            let round = &draws[laps.len()..draws.len().min(laps.len() + laps.len().max(FIRST_ROUND))];
            let nearest = |draw: &ParameterDraw| {
                let solved =
                    draws.iter().zip(&laps).filter_map(|(other, lap)| Some((other, lap.as_ref().ok()?)));
                let starts = iter::once((&car_values, self)).chain(solved);
                let distances = starts.map(|(other, lap)| (distance(draw, other, &scales), lap));
                distances.min_by(|(a, _), (b, _)| a.total_cmp(b)).map_or(self, |(_, lap)| lap)
            };
            let solved: Vec<_> = round.par_iter().map(|draw| solve(draw, nearest(draw))).collect();
            laps.extend(solved);
        }
        let solved: Vec<&LapOptimum> = laps.iter().flatten().collect();
        let first_failure = laps.iter().find_map(|lap| lap.as_ref().err()).cloned();
        if let (true, Some(why)) = (solved.is_empty(), &first_failure) {
            return Err(Error::Options(format!(
                "no draw of {} has a lap, the first because {why}",
                draws.len()
            )));
        }
        let mut lap_times: Vec<f64> = solved.iter().map(|lap| lap.lap_time).collect();
        lap_times.sort_by(f64::total_cmp);
        let band = |k: usize| {
            central_95_percent_interval(solved.iter().map(|lap| lap.nodes[k].variables.n).collect())
        };
        Ok(LapTimeInterval {
            deviations: (0..self.nodes.len()).map(band).collect(),
            by_draw: laps.iter().map(|lap| lap.as_ref().ok().map(|lap| lap.lap_time)).collect(),
            unsolved: draws.len() - solved.len(),
            first_failure,
            lap_times,
        })
    }
}

/// Standard deviation of each parameter in the draws.
fn scales(draws: &[ParameterDraw]) -> Vec<f64> {
    let parameters = 0..draws.first().map_or(0, Vec::len);
    parameters.map(|i| std(&draws.iter().map(|draw| draw[i].1).collect::<Vec<f64>>())).collect()
}

/// Square of the distance of two draws of the same parameters, each over its scale; a parameter without one does not differ.
fn distance(a: &ParameterDraw, b: &ParameterDraw, scales: &[f64]) -> f64 {
    let parts = a.iter().zip(b).zip(scales).filter(|(_, scale)| **scale > 0.0);
    parts.map(|(((_, a), (_, b)), scale)| ((a - b) / scale).powi(2)).sum()
}
