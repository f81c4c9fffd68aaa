//! Makes a mass on a spring a node: half of a system whose closed form is known.

use std::ops::Range;

use fmu_import::CallError;

use crate::clock::CommunicationClock;
use crate::node::{ExtrapolatedInputs, InputPolynomial, Node, NodeState, Stateful};

/// A mass between two springs: the first one holds it at what is before it, and pulls at that, too. The solution within a step is
/// that of many steps of Runge and Kutta.
#[derive(Clone)]
pub(super) struct Mass {
    pub(super) stiffness: f64,
    pub(super) damping: f64,
    /// Position and speed.
    pub(super) state: [f64; 2],
    /// What the end of the spring moves by, how fast, and the force from behind.
    pub(super) inputs: [f64; 3],
    pub(super) polynomials: Vec<InputPolynomial>,
    pub(super) takes_slopes: bool,
    /// Steps that are longer are discarded [s].
    pub(super) longest: f64,
    pub(super) steps: u64,
}

impl Mass {
    pub(super) fn new(stiffness: f64, damping: f64, position: f64) -> Self {
        Mass {
            stiffness,
            damping,
            state: [position, 0.0],
            inputs: [0.0; 3],
            polynomials: Vec::new(),
            takes_slopes: false,
            longest: f64::INFINITY,
            steps: 0,
        }
    }

    fn force(&self, [x, v]: [f64; 2], [x0, v0, _]: [f64; 3]) -> f64 {
        self.stiffness * (x0 - x) + self.damping * (v0 - v)
    }

    fn inputs_at(&self, time: f64) -> [f64; 3] {
        let mut inputs = self.inputs;
        for InputPolynomial { place, polynomial } in &self.polynomials {
            inputs[*place] = polynomial.value_at(time);
        }
        inputs
    }

    fn slope(&self, state: [f64; 2], time: f64) -> [f64; 2] {
        let inputs = self.inputs_at(time);
        [state[1], self.force(state, inputs) + inputs[2]]
    }
}

impl Node for Mass {
    fn set_inputs(&mut self, inputs: &[f64]) -> Result<(), CallError> {
        self.inputs[..inputs.len()].copy_from_slice(inputs);
        self.polynomials.clear();
        Ok(())
    }

    /// Position, speed, and the force on what is before it.
    fn get_outputs(&mut self, outputs: &mut [f64]) -> Result<(), CallError> {
        outputs[..2].copy_from_slice(&self.state);
        outputs[2] = -self.force(self.state, self.inputs);
        Ok(())
    }

    fn do_step(&mut self, clock: &CommunicationClock, tick: u64) -> Result<(), CallError> {
        self.steps += 1;
        if clock.step > self.longest * 1.000_001 {
            let discarded = CallError::new("step", "is too long");
            return Err(CallError { discarded: true, ..discarded });
        }
        let h = clock.step / 20.0;
        for part in 0..20 {
            let t = clock.time_at(tick) + f64::from(part) * h;
            let [x, v] = self.state;
            let plus = |k: [f64; 2], h: f64| [x + h * k[0], v + h * k[1]];
            let k1 = self.slope([x, v], t);
            let k2 = self.slope(plus(k1, h / 2.0), t + h / 2.0);
            let k3 = self.slope(plus(k2, h / 2.0), t + h / 2.0);
            let k4 = self.slope(plus(k3, h), t + h);
            let all = |i: usize| h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
            self.state = [x + all(0), v + all(1)];
        }
        Ok(())
    }

    fn as_stateful(&mut self) -> Option<&mut dyn Stateful> {
        Some(self)
    }

    fn extrapolated_inputs(&mut self) -> Option<&mut dyn ExtrapolatedInputs> {
        if self.takes_slopes { Some(self) } else { None }
    }
}

impl ExtrapolatedInputs for Mass {
    fn set_extrapolated_inputs(
        &mut self,
        inputs: &mut [f64],
        polynomials: &[InputPolynomial],
        _span: Range<f64>,
    ) -> Result<(), CallError> {
        self.set_inputs(inputs)?;
        self.polynomials = polynomials.to_vec();
        Ok(())
    }
}

impl Stateful for Mass {
    fn save_state(&mut self) -> Result<NodeState, CallError> {
        Ok(NodeState::new(self.clone()))
    }

    fn restore_state(&mut self, state: &NodeState) -> Result<(), CallError> {
        let steps = self.steps;
        *self = state.downcast_ref::<Mass>()?.clone();
        self.steps = steps;
        Ok(())
    }
}
