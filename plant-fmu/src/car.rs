//! Builds the detailed single-track car from the parameters: on the simple Magic Formula, or on tires of files.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use std::sync::Arc;

use fmu_export::Number;
use tire::{MagicFormula, MfSet, MfTire, TireSet};
use tire_file::{TireFileMessage, TireSpecification};
use vehicle::detailed_track::{
    DetailedSingleTrackInput, DetailedSingleTrackParameters, DetailedSingleTrackState, DetailedTrack,
    DetailedTrackEvaluation, TireMounting,
};

/// The car that was built from the parameters, with the tire curves that it was built for.
#[derive(Clone, Debug)]
pub(crate) struct BuiltCar {
    /// The curves of the tires, which may change during a run.
    pub curves: [MagicFormula; 2],
    /// The car with options; `None` for the plain one.
    pub car: Option<DetailedCar>,
}

/// The car with options.
#[derive(Clone, Debug)]
pub(crate) enum DetailedCar {
    Curves(Arc<DetailedTrack<[MagicFormula; 2]>>),
    Files(Arc<DetailedTrack<MfSet>>),
}

impl DetailedCar {
    /// The car of these parameters with what there is to tell about its tire files; `None` without any option.
    ///
    /// # Errors
    /// In words, when the parameters or the files make no car.
    pub fn build(
        parameters: DetailedSingleTrackParameters,
        choices: &[TireSpecification; 2],
        curves: [MagicFormula; 2],
    ) -> Result<(Option<Self>, Vec<TireFileMessage>), String> {
        let given = choices.each_ref().map(|choice| !choice.tir.trim().is_empty());
        match given {
            [false, false] if !parameters.has_options() => Ok((None, Vec::new())),
            [false, false] => {
                let car = DetailedTrack::new(parameters, curves, TireMounting::Alike);
                let car = car.map_err(|bad| bad.to_string())?;
                Ok((Some(Self::Curves(Arc::new(car))), Vec::new()))
            }
            [true, true] => {
                let mut all_messages = Vec::new();
                let mut tire = |choice: &TireSpecification, name: &str| {
                    let (tire, messages) = choice.load_tire(name)?;
                    all_messages.extend(messages);
                    Ok::<_, String>(tire)
                };
                let tires = [tire(&choices[0], "tire_f.tir")?, tire(&choices[1], "tire_r.tir")?];
                let car = DetailedTrack::new(parameters, MfSet::from(tires), TireMounting::Mirrored);
                let car = car.map_err(|bad| bad.to_string())?;
                Ok((Some(Self::Files(Arc::new(car))), all_messages))
            }
            [front, _] => {
                let (has, lacks) =
                    if front { ("tire_f.tir", "tire_r.tir") } else { ("tire_r.tir", "tire_f.tir") };
                Err(format!(
                    "{has} is given and {lacks} is empty, expected a file for both axles or for none"
                ))
            }
        }
    }

    /// Forces and accelerations.
    pub fn compute_motion(
        &self,
        state: &DetailedSingleTrackState,
        input: &DetailedSingleTrackInput,
    ) -> DetailedTrackEvaluation {
        match self {
            Self::Curves(car) => car.evaluate(state, input),
            Self::Files(car) => car.evaluate(state, input),
        }
    }

    /// The same with numbers that carry derivatives along.
    pub fn motion_with_derivatives<T: Number>(
        &self,
        state: &DetailedSingleTrackState<T>,
        input: &DetailedSingleTrackInput<T>,
    ) -> DetailedTrackEvaluation<T> {
        match self {
            Self::Curves(car) => car.with_tires(car.tires().map(|curve| curve.cast())).evaluate(state, input),
            Self::Files(car) => {
                let tires: [MfTire<T>; 2] = car.tires().axle_tires().map(MfTire::cast);
                car.with_tires(tires).evaluate(state, input)
            }
        }
    }

    pub fn advance_state(
        &self,
        state: &DetailedSingleTrackState,
        input: &DetailedSingleTrackInput,
        step: f64,
        longest: f64,
    ) -> DetailedSingleTrackState {
        match self {
            Self::Curves(car) => car.advance(state, input, step, longest),
            Self::Files(car) => car.advance(state, input, step, longest),
        }
    }

    pub fn rolling_state(&self, start: vehicle::PlanarState, delta: f64) -> DetailedSingleTrackState {
        match self {
            Self::Curves(car) => car.rolling_state(start, delta),
            Self::Files(car) => car.rolling_state(start, delta),
        }
    }
}
