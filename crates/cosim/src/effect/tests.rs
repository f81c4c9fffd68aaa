//! Checks each effect, random streams and messages.

use super::*;
use crate::quantity::Quantity;

type Effects<'e> = &'e [&'e dyn SensorEffect];

fn build(effects: Effects, stream: u64) -> Result<EffectChain, String> {
    EffectChain::new(effects, EffectContext { communication_step: 0.01, stream, input: InputUnit::default() })
}

fn chain(effects: Effects, stream: u64) -> EffectChain {
    build(effects, stream).unwrap_or_else(|error| panic!("{error}"))
}

fn noise(std: f64) -> Noise {
    Noise { std: std.into(), seed: None }
}

#[test]
fn each_effect_does_what_it_says() {
    #[rustfmt::skip]
    let cases: &[(Effects, &[f64])] = &[
        (&[], &[1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0]),
        (&[&SensorBias(Quantity::from(0.5))], &[1.5, 2.5, 4.5, 8.5, 16.5, 32.5, 64.5]),
        (&[&SensorGain(-2.0)], &[-2.0, -4.0, -8.0, -16.0, -32.0, -64.0, -128.0]),
        (&[&SensorGain(2.0), &SensorBias(Quantity::from(1.0))], &[3.0, 5.0, 9.0, 17.0, 33.0, 65.0, 129.0]),
        (&[&SensorDelay(0.0)], &[1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0]),
        (&[&SensorDelay(0.03)], &[1.0, 1.0, 1.0, 1.0, 2.0, 4.0, 8.0]),
        (&[&SensorDelay(0.015)], &[1.0, 1.0, 1.5, 3.0, 6.0, 12.0, 24.0]),
        (&[&SensorDelay(0.0025)], &[1.0, 1.75, 3.5, 7.0, 14.0, 28.0, 56.0]),
        (&[&SensorDelay(1e9)], &[1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]),
        (&[&Quantisation(Quantity::from(5.0))], &[0.0, 0.0, 5.0, 10.0, 15.0, 30.0, 65.0]),
        (&[&SampleAndHold(0.0)], &[1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0]),
        (&[&SampleAndHold(0.03)], &[1.0, 1.0, 1.0, 8.0, 8.0, 8.0, 64.0]),
        (&[&SampleAndHold(0.025)], &[1.0, 1.0, 1.0, 8.0, 8.0, 32.0, 32.0]),
        (&[&SampleAndHold(0.001)], &[1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0]),
        (&[&SampleDropout(1.0)], &[1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]),
        (&[&SampleDropout(0.0)], &[1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0]),
        (&[&SensorDelay(0.01), &SensorGain(3.0), &SensorBias(Quantity::from(1.0)), &Quantisation(Quantity::from(4.0)), &SampleAndHold(0.02)], &[4.0, 4.0, 8.0, 8.0, 24.0, 24.0, 96.0]),
    ];
    for (place, (effects, expected)) in cases.iter().enumerate() {
        let mut chain = chain(effects, 1);
        let shown: Vec<f64> = (0..7).map(|i| chain.apply_effects(2_f64.powi(i))).collect();
        for (value, expected) in shown.iter().zip(*expected) {
            assert!((value - expected).abs() < 1e-9, "case {place}: {shown:?}");
        }
    }
}

#[test]
fn noise_has_its_deviation_and_is_white() {
    let mut chain = chain(&[&noise(0.5)], stream_seed(1, "plant.a_y"));
    let count = 20_000;
    let noise: Vec<f64> = (0..count).map(|_| chain.apply_effects(3.0) - 3.0).collect();
    let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / f64::from(count);
    let variance = mean(&mut noise.iter().map(|x| x * x));
    assert!(mean(&mut noise.iter().copied()).abs() < 5.0 * 0.5 / f64::from(count).sqrt());
    assert!((variance.sqrt() / 0.5 - 1.0).abs() < 0.03, "{variance}");
    let neighbours = mean(&mut noise.windows(2).map(|pair| pair[0] * pair[1]));
    assert!((neighbours / variance).abs() < 0.04, "{neighbours}");
}

#[test]
fn dropouts_are_as_frequent_as_they_should_be() {
    let mut chain = chain(&[&SampleDropout(0.25)], 3);
    let shown: Vec<f64> = (0..10_000).map(|i| chain.apply_effects(f64::from(i))).collect();
    let lost = shown.windows(2).filter(|pair| pair[0] == pair[1]).count();
    assert!((2300..2700).contains(&lost), "{lost}");
}

#[test]
fn streams_repeat_and_differ() {
    let draw = |effects: Effects, stream: u64| chain(effects, stream).apply_effects(0.0);
    let (white, seeded) = (noise(1.0), Noise { std: 1.0.into(), seed: Some(5) });
    let noise: Effects = &[&white];
    let fixed: Effects = &[&seeded];
    assert_eq!(draw(noise, 7), draw(noise, 7));
    assert_ne!(draw(noise, 7), draw(noise, 8));
    assert_eq!(draw(fixed, 7), draw(fixed, 8));
    assert_eq!(draw(noise, 7), draw(&[&white, &SampleDropout(0.5)], 7));
    let mut streams: Vec<u64> =
        (0..20).flat_map(|seed| ["a.x", "a.y", "x.a", ""].map(|name| stream_seed(seed, name))).collect();
    streams.sort_unstable();
    streams.dedup();
    assert_eq!(streams.len(), 80);
}

#[test]
fn nan_is_delayed_and_held_but_never_becomes_a_number() {
    let all: Effects = &[
        &noise(1.0),
        &SensorBias(Quantity::from(1.0)),
        &SensorGain(2.0),
        &Quantisation(Quantity::from(0.1)),
    ];
    assert!(chain(all, 1).apply_effects(f64::NAN).is_nan());
    let mut chain = chain(&[&SensorDelay(0.02), &SampleAndHold(0.02)], 1);
    let shown = [1.0, f64::NAN, f64::NAN, 2.0, 3.0, 4.0, 5.0].map(|x| chain.apply_effects(x).is_nan());
    assert_eq!(shown, [false, false, false, false, true, true, false]);
}

#[test]
fn errors_name_the_key() {
    #[rustfmt::skip]
    let cases: [(Effects, &str); 9] = [
        (&[&noise(-1.0)], "at least 0 for `noise.std`, found -1"),
        (&[&noise(f64::NAN)], "`noise.std`, found NaN"),
        (&[&SensorBias(Quantity::from(f64::INFINITY))], "`bias`, found inf"),
        (&[&SensorGain(f64::NAN)], "`gain`"),
        (&[&SensorDelay(-0.1)], "`delay`, found -0.1"),
        (&[&SensorDelay(f64::INFINITY)], "`delay`"),
        (&[&Quantisation(Quantity::from(0.0))], "above 0 for `quantise`, found 0"),
        (&[&SampleAndHold(-1.0)], "`hold`"),
        (&[&SampleDropout(1.5)], "from 0 to 1 for `dropout`, found 1.5"),
    ];
    for (effects, part) in cases {
        let error = build(effects, 0).expect_err(part);
        assert!(error.contains(part), "{part}: {error}");
    }
    assert!(
        EffectChain::new(
            &[],
            EffectContext { communication_step: 0.0, stream: 0, input: InputUnit::default() }
        )
        .is_err()
    );
}

#[test]
fn a_clone_has_the_state_of_its_original() {
    let all: Effects = &[&SensorDelay(0.025), &noise(1.0), &SampleAndHold(0.03), &SampleDropout(0.5)];
    let mut original = chain(all, 1);
    for value in 0..20 {
        original.apply_effects(f64::from(value));
    }
    let mut copy = original.clone();
    for value in 20..60 {
        assert_eq!(original.apply_effects(f64::from(value)), copy.apply_effects(f64::from(value)));
    }
}

#[test]
fn a_chain_goes_on_with_what_another_one_remembered() {
    let all: Effects = &[&SensorDelay(0.025), &noise(1.0), &SampleAndHold(0.03), &SampleDropout(0.5)];
    let mut original = chain(all, 1);
    let mut early = EffectChain::default();
    for value in 0..20 {
        original.apply_effects(f64::from(value));
    }
    assert_eq!(early.restore_states(&original.saved_states()), Ok(()), "effects that are gone are left out");
    let mut other = chain(all, 1);
    assert_eq!(other.restore_states(&original.saved_states()), Ok(()));
    let mut shorter = chain(&[&SensorDelay(0.01)], 1);
    assert_eq!(shorter.restore_states(&original.saved_states()), Ok(()));
    assert_eq!(shorter.apply_effects(100.0), 19.0);
    for value in 20..60 {
        assert_eq!(original.apply_effects(f64::from(value)), other.apply_effects(f64::from(value)));
    }
    for key in ["noise", "hold", "dropout"] {
        let wrong = vec![(key.to_owned(), vec![1, 2, 3, 4])];
        assert_eq!(chain(all, 1).restore_states(&wrong), Err(key.to_owned()));
    }
}
