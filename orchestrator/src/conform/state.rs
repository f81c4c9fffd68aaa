//! Checks that an FMU state, as it is or turned into bytes and back, continues where it was taken.

use super::bench::{Bench, STEPS};
use super::{Verdict, not_applicable};

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
