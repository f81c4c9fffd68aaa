//! Checks that an FMU state, as it is or turned into bytes and back, continues where it was taken.

use super::bench::{Bench, STEPS};
use super::order::{InitializationMode, Instantiated, StepComplete, Terminated, bring};
use super::{Objection, Verdict, broken, not_applicable};

pub(super) fn restore(bench: &Bench) -> Verdict {
    if !bench.about().state {
        return not_applicable("canGetAndSetFMUstate is not set");
    }
    let mut instance = bench.ready()?;
    bench.run(&mut instance, 0..STEPS, 0)?;
    let taken = bench.row(&mut instance, bench.time(STEPS.into()))?;
    bench.note("fmi2GetFMUstate");
    let state = instance.get_state()?;
    let expected = bench.run(&mut instance, STEPS..2 * STEPS, 0)?;
    // Twice: a state that is used up by the first time would pass otherwise.
    for _ in 0..2 {
        bench.note("fmi2SetFMUstate");
        instance.set_state(&state)?;
        let restored = bench.row(&mut instance, taken.time)?;
        bench.same(std::slice::from_ref(&taken), &[restored])?;
        bench.same(&expected, &bench.run(&mut instance, STEPS..2 * STEPS, 0)?)?;
    }
    bench.note("fmi2FreeFMUstate");
    instance.free_state(state)?;
    Ok(String::new())
}

pub(super) fn serialise(bench: &Bench) -> Verdict {
    if !bench.about().serialised_state {
        return not_applicable("canSerializeFMUstate is not set");
    }
    let mut instance = bench.ready()?;
    bench.run(&mut instance, 0..STEPS, 0)?;
    bench.note("fmi2GetFMUstate");
    let state = instance.get_state()?;
    bench.note("fmi2SerializeFMUstate");
    let bytes = instance.serialise(&state)?;
    bench.note("fmi2FreeFMUstate");
    instance.free_state(state)?;
    let expected = bench.run(&mut instance, STEPS..2 * STEPS, 0)?;
    bench.note("fmi2DeSerializeFMUstate");
    let state = instance.deserialise(&bytes)?;
    bench.note("fmi2SetFMUstate");
    instance.set_state(&state)?;
    instance.free_state(state)?;
    bench.same(&expected, &bench.run(&mut instance, STEPS..2 * STEPS, 0)?)?;
    Ok(format!("{} bytes", bytes.len()))
}

/// A state can be taken, taken again, restored and freed wherever table 4.2.4 allows it, and the life of
/// the instance goes on as if nothing had happened.
pub(super) fn anywhere(bench: &Bench) -> Verdict {
    if !bench.about().state {
        return not_applicable("canGetAndSetFMUstate is not set");
    }
    let expected = bench.run(&mut bench.ready()?, 0..STEPS, 0)?;
    for at in [Instantiated, InitializationMode, StepComplete, Terminated] {
        let mut instance = bring(bench, at)?;
        bench.note(&format!("fmi2GetFMUstate, fmi2SetFMUstate and fmi2FreeFMUstate in {at:?}"));
        let mut there_and_back = || {
            let mut state = instance.get_state()?;
            instance.refill_state(&mut state)?;
            instance.set_state(&state)?;
            instance.free_state(state)?;
            instance.free_no_state()
        };
        there_and_back().map_err(|mut error| {
            error.what += &format!(" in {at:?}");
            error
        })?;
        match at {
            Instantiated => bench.initialise(&mut instance)?,
            InitializationMode => instance.exit_initialization()?,
            StepComplete => {}
            Terminated => continue,
        }
        bench.same(&expected, &bench.run(&mut instance, 0..STEPS, 0)?)?;
    }
    Ok(String::new())
}

/// After `fmi2Error` a master may try an older state (FMI 2.0, section 2.1.3). An FMU may refuse to take
/// it; one that takes it must go on from there.
pub(super) fn after_error(bench: &Bench) -> Verdict {
    if !bench.about().state {
        return not_applicable("canGetAndSetFMUstate is not set");
    }
    let mut instance = bench.ready()?;
    bench.run(&mut instance, 0..STEPS, 0)?;
    let state = instance.get_state()?;
    let expected = bench.run(&mut instance, STEPS..2 * STEPS, 0)?;
    bench.note("fmi2ExitInitializationMode at a communication point");
    if instance.exit_initialization().is_ok() {
        return not_applicable("the illegal call that should fail is accepted");
    }
    bench.note("reading the outputs after an error");
    let _ = bench.row(&mut instance, bench.time((2 * STEPS).into()));
    if instance.is_lost() {
        return broken("expected fmi2Error, found fmi2Fatal");
    }
    bench.note("fmi2SetFMUstate after an error");
    if let Err(error) = instance.set_state(&state) {
        return Ok(format!("warning: {} {}, so only a reset helps", error.call, error.what));
    }
    let found = bench.run(&mut instance, STEPS..2 * STEPS, 0).map_err(|error| {
        Objection::Broken(format!(
            "{} {}, with a state from before an error",
            error.call, error.what
        ))
    })?;
    bench.same(&expected, &found)?;
    instance.free_state(state)?;
    Ok(String::new())
}
