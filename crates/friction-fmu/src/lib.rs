//! Exports an online estimator of friction and stiffness of both axles as an FMU: the table of its variables, and one step.
#![forbid(unsafe_code)]
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

mod curve;
mod filter;
mod grid;
mod observer;
mod sample;
mod sideslip;
mod table;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use car_file::{CarParameter, implausible_parameters};
use fmu_export::{Info, Member, Model, ModelError, RealValue, Terminal, Variable, real_values, warn};
use serde::{Deserialize, Serialize};
use vehicle::{MagicFormula, VehicleBody};

use curve::TabulatedCurve;
use grid::SurfaceDrift;
use observer::{FrictionObserver, ObserverOutput, ObserverSettings};
use sample::{SensorNoise, SensorSample};

/// The estimator between its inputs and its outputs.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct FrictionNode {
    settings: ObserverSettings,
    tires: [MagicFormula; 2],
    /// What the parameters make; made anew after a state was read.
    #[serde(skip)]
    curves: Option<Arc<[TabulatedCurve; 2]>>,
    sample: SensorSample,
    valid: bool,
    observer: FrictionObserver,
    output: ObserverOutput,
    axles: [AxleFrictionOutput; 2],
    /// Samples that were no measurements of a car.
    missing: i32,
}

/// D and K of an axle as they are shown, with standard deviations [-, 1/rad].
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
struct AxleFrictionOutput {
    D: f64,
    K: f64,
    std_D: f64,
    std_K: f64,
}

impl Default for FrictionNode {
    fn default() -> Self {
        let noise = SensorNoise { v_y: 0.05, r: 0.01, a_y: 0.2, alpha: [0.005, 0.003], force: 0.05 };
        let drift = SurfaceDrift { walk: [1e-4, 1e-4], changes: 0.02, spread: 0.5 };
        FrictionNode {
            settings: ObserverSettings {
                body: VehicleBody::default(),
                noise,
                noise_times: [0.25, 5.0],
                filter_time: 0.05,
                v_x_min: 3.0,
                start_std: [0.15, 0.1],
                drift,
                difference: 0.1,
                process_v_y: 0.1,
                measured_v_y: false,
                change: 0.25,
                deviations: 2.5,
            },
            tires: [MagicFormula::default(); 2],
            curves: None,
            sample: SensorSample { v_x: 0.0, v_y: 0.0, r: 0.0, a_y: 0.0, delta: 0.0 },
            valid: true,
            observer: FrictionObserver::default(),
            output: ObserverOutput::default(),
            axles: [AxleFrictionOutput::default(); 2],
            missing: 0,
        }
    }
}

const SENSORS: &[Member] = &[
    Member::signal("v_x", "v_x_meas"),
    Member::signal("v_y", "v_y_meas"),
    Member::signal("r", "r_meas"),
    Member::signal("a_y", "a_y_meas"),
];

const ACTUATORS: &[Member] = &[Member::signal("delta", "delta")];

impl FrictionNode {
    /// Both curves.
    fn tabulated_curves(&mut self) -> Result<Arc<[TabulatedCurve; 2]>, ModelError> {
        if let Some(curves) = &self.curves {
            return Ok(Arc::clone(curves));
        }
        let curve = |axle: usize| {
            let name = ["tire_f", "tire_r"][axle];
            TabulatedCurve::new(self.tires[axle])
                .map_err(|wrong| ModelError::Error(format!("{name}.{wrong}")))
        };
        let curves = Arc::new([curve(0)?, curve(1)?]);
        self.curves = Some(Arc::clone(&curves));
        Ok(curves)
    }

    fn write_output(&mut self, output: ObserverOutput) {
        self.output = output;
        for (axle, (moments, tire)) in self.axles.iter_mut().zip(output.axles.iter().zip(&self.tires)) {
            let ([D, K], [std_D, std_K]) = (moments.mean, moments.std);
            let stiffness = tire.cornering_stiffness_per_load();
            *axle = AxleFrictionOutput {
                D: tire.D * D,
                K: stiffness * K,
                std_D: tire.D * std_D,
                std_K: stiffness * std_K,
            };
        }
    }
}

impl Model for FrictionNode {
    const INFO: Info = Info::new(
        "friction",
        "Online estimator of friction and stiffness of both axles, which tells when the surface changes",
        0.01,
    )
    .terminals(&[
        Terminal::bus("sensors", "Measured motion of the car", SENSORS),
        Terminal::bus("actuators", "Commands to the car", ACTUATORS),
    ]);

    const VARIABLES: &'static [Variable<Self>] = table::VARIABLES;

    fn initialise(&mut self) -> Result<(), ModelError> {
        self.curves = None;
        let curves = self.tabulated_curves()?;
        if let Some(wrong) = table::wrong_parameter(self) {
            return Err(ModelError::Error(wrong));
        }
        self.missing = 0;
        let (observer, output) = FrictionObserver::new(&self.settings, &curves, 0.0);
        self.observer = observer;
        self.write_output(output);
        Ok(())
    }

    fn review_parameters(&mut self) {
        let parameter =
            |it: &RealValue| CarParameter { name: it.name, value: it.value, is_given: it.is_given };
        let parameters: Vec<_> = real_values(self).iter().map(parameter).collect();
        implausible_parameters(&parameters).into_iter().for_each(warn);
    }

    fn step(&mut self, time: f64, step: f64) -> Result<(), ModelError> {
        let curves = self.tabulated_curves()?;
        let missing = self.sample.missing_channel();
        if let (true, Some((name, value))) = (self.valid, missing) {
            // The first one is told; `missing` counts the others.
            if self.missing == 0 {
                warn(format!(
                    "at {} s: {name}_meas = {value} is no measurement of a car; such samples are left out and counted by `missing`",
                    time + step
                ));
            }
            self.missing = self.missing.saturating_add(1);
        }
        let sample = (self.valid && missing.is_none()).then_some(&self.sample);
        let output = self.observer.step(&self.settings, &curves, sample, [time + step, step]);
        self.write_output(output);
        Ok(())
    }
}

fmu_export::export!(FrictionNode);
