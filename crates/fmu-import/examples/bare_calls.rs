//! Compares a chain of three instances of an FMU of FMI 2.0, called as they are and through this crate, by turns:
//! `cargo run --release -p fmu-import --example bare_calls -- FMU INPUT OUTPUT STEPS ROUNDS`, with names of Real variables.

#![allow(unsafe_code, reason = "the comparison is with the functions as they are")]

use std::ffi::{CString, c_char, c_int, c_void};
use std::ptr;
use std::sync::Arc;
use std::time::Instant;

use fmu_import::{Fmu, Instance};

type Component = *mut c_void;
type Call = unsafe extern "C" fn(Component) -> c_int;
type Instantiate = unsafe extern "C" fn(
    *const c_char,
    c_int,
    *const c_char,
    *const c_char,
    *const Callbacks,
    c_int,
    c_int,
) -> Component;
type Setup = unsafe extern "C" fn(Component, c_int, f64, f64, c_int, f64) -> c_int;
type Set = unsafe extern "C" fn(Component, *const u32, usize, *const f64) -> c_int;
type Get = unsafe extern "C" fn(Component, *const u32, usize, *mut f64) -> c_int;
type Step = unsafe extern "C" fn(Component, f64, f64, c_int) -> c_int;
type Failure = Box<dyn std::error::Error>;

/// `fmi2CallbackFunctions`; the messages are not read.
#[repr(C)]
struct Callbacks {
    logger: unsafe extern "C" fn(),
    allocate: unsafe extern "C" fn(usize, usize) -> *mut c_void,
    free: unsafe extern "C" fn(*mut c_void),
    step_finished: *const c_void,
    environment: *const c_void,
}

unsafe extern "C" {
    fn calloc(count: usize, size: usize) -> *mut c_void;
    fn free(memory: *mut c_void);
}

/// The caller clears away the arguments that a logger ignores.
unsafe extern "C" fn silent() {}

/// Communication step [s].
const STEP: f64 = 0.1;
const CHAIN: [&str; 3] = ["a", "b", "c"];

fn main() -> Result<(), Failure> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [path, input, output, steps, rounds] = words.as_slice() else {
        return Err("expected FMU INPUT OUTPUT STEPS ROUNDS".into());
    };
    let fmu = Arc::new(Fmu::open(path.as_ref())?);
    let reference = |name: &str| -> Result<u32, Failure> {
        let found = fmu.description.variables.iter().find(|it| it.name == name);
        found.map(|it| it.reference).ok_or_else(|| format!("no variable {name}").into())
    };
    let ports = [reference(input)?, reference(output)?];
    let (steps, rounds): (u32, usize) = (steps.parse()?, rounds.parse()?);
    let mut times = [Vec::new(), Vec::new()];
    for _ in 0..rounds {
        times[0].push(bare(&fmu, ports, steps)?);
        times[1].push(through(&fmu, ports, steps)?);
    }
    let [bare, through] = times.map(|mut times| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    });
    println!(
        "median of {rounds}: {bare:.0} ns per step bare, {through:.0} ns through this crate: {:.2} times as long",
        through / bare
    );
    Ok(())
}

/// Time per step of the chain [ns].
fn per_step(begin: Instant, steps: u32) -> f64 {
    begin.elapsed().as_secs_f64() * 1e9 / f64::from(steps)
}

fn bare(fmu: &Arc<Fmu>, [input, output]: [u32; 2], steps: u32) -> Result<f64, Failure> {
    let callbacks = Callbacks {
        logger: silent,
        allocate: calloc,
        free,
        step_finished: ptr::null(),
        environment: ptr::null(),
    };
    let guid = CString::new(fmu.description.guid.as_str())?;
    // SAFETY: the functions have the types of FMI 2.0, and arguments live until the calls return.
    unsafe {
        let library = libloading::Library::new(fmu.prepare_library()?)?;
        let instantiate = *library.get::<Instantiate>(b"fmi2Instantiate")?;
        let setup = *library.get::<Setup>(b"fmi2SetupExperiment")?;
        let enter = *library.get::<Call>(b"fmi2EnterInitializationMode")?;
        let leave = *library.get::<Call>(b"fmi2ExitInitializationMode")?;
        let set = *library.get::<Set>(b"fmi2SetReal")?;
        let get = *library.get::<Get>(b"fmi2GetReal")?;
        let step = *library.get::<Step>(b"fmi2DoStep")?;
        let free = *library.get::<unsafe extern "C" fn(Component)>(b"fmi2FreeInstance")?;
        let made = CHAIN.map(|name| {
            let name = CString::new(name).unwrap_or_default();
            instantiate(name.as_ptr(), 1, guid.as_ptr(), ptr::null(), &raw const callbacks, 0, 0)
        });
        let mut status = 0;
        for component in made {
            status |= setup(component, 0, 0.0, 0.0, 0, 0.0) | enter(component) | leave(component);
        }
        let begin = Instant::now();
        for tick in 0..steps {
            let mut value = f64::from(tick);
            for component in made {
                status |= set(component, &raw const input, 1, &raw const value);
                status |= step(component, f64::from(tick) * STEP, STEP, 1);
                status |= get(component, &raw const output, 1, &raw mut value);
            }
        }
        let time = per_step(begin, steps);
        made.into_iter().for_each(|component| free(component));
        if status == 0 { Ok(time) } else { Err(format!("the FMU returned {status}").into()) }
    }
}

fn through(fmu: &Arc<Fmu>, [input, output]: [u32; 2], steps: u32) -> Result<f64, Failure> {
    let mut made = Vec::new();
    for name in CHAIN {
        let mut instance = Instance::new(fmu.load_library()?, name, false)?;
        instance.setup_experiment(0.0, None, None)?;
        instance.enter_initialization()?;
        instance.exit_initialization()?;
        made.push(instance);
    }
    let begin = Instant::now();
    for tick in 0..steps {
        let mut value = [f64::from(tick)];
        for instance in &mut made {
            instance.set_real(&[input], &value)?;
            instance.step(f64::from(tick) * STEP, STEP)?;
            instance.get_real(&[output], &mut value)?;
        }
    }
    Ok(per_step(begin, steps))
}
