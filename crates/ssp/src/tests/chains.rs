//! A chain does what its steps do one after the other.

use std::sync::Arc;

use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

use super::*;
use crate::chain::{ChainOrigin, ChainStep, compose_chain};
use crate::source_position::SourceText;
use crate::{BaseUnit, SourcePosition, SspUnit};

fn unit(random: &mut Pcg64) -> SspUnit {
    let (factor, offset) = (random.random_range(0.1..10.0), random.random_range(-5.0..5.0));
    let base = Some(BaseUnit { exponents: [0; 8], factor, offset });
    SspUnit { name: format!("{factor} {offset}"), base }
}

/// What becomes of `x` step by step, with every conversion in its place.
fn walked(from: &SspUnit, steps: &[(SspUnit, ValueTransformation, bool)], x: f64) -> f64 {
    let (mut value, mut at) = (x, from);
    for (to, transformation, suppress) in steps {
        if !suppress {
            let (factor, offset) = at.conversion_to(to).expect("a conversion");
            value = factor * value + offset;
        }
        let (factor, offset) = factors(transformation);
        (value, at) = (factor * value + offset, to);
    }
    value
}

#[test]
fn a_chain_is_its_steps() {
    let mut random = Pcg64::seed_from_u64(3);
    let text = Arc::new(SourceText { path: "x".into(), text: String::new() });
    let position = SourcePosition::new(&text, 0);
    for case in 0..2_000 {
        let from = unit(&mut random);
        let steps: Vec<_> = (0..random.random_range(1..6))
            .map(|_| {
                let (factor, offset) = (random.random_range(-3.0..3.0), random.random_range(-3.0..3.0));
                // Half of the cases suppress nothing: they take the other way through the code.
                let suppress = case % 2 == 0 && random.random();
                (unit(&mut random), ValueTransformation::Linear { factor, offset }, suppress)
            })
            .collect();
        let given: Vec<_> = steps
            .iter()
            .map(|(to, transformation, suppress)| ChainStep {
                transformation,
                suppress: *suppress,
                to: Some(to),
                inherits_before: random.random(),
                position: &position,
            })
            .collect();
        let found = compose_chain(ChainOrigin::Connector(Some(&from)), &given).expect("a chain");
        let (last, _, _) = steps.last().expect("a step");
        let conversion = if found.suppress { Some((1.0, 0.0)) } else { from.conversion_to(last) };
        let (factor, offset) = conversion.expect("a conversion");
        let (a, b) = factors(&found.transformation);
        for x in [-2.0, 0.0, 1.0, 7.5] {
            let (one, all) = (a * (factor * x + offset) + b, walked(&from, &steps, x));
            assert!((one - all).abs() <= 1e-8 * (1.0 + all.abs()), "{one} {all} {steps:?}");
        }
    }
}
