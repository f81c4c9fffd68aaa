//! Walks through the states of an instance at random, by calls that are legal, for an FMU that counts illegal ones.

use std::path::Path;
use std::sync::Arc;

use fmu_import::{Fmu, FmuLibrary, FmuState, Instance, StepStatus};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

use super::support::archived;

const XML_2: &str = r#"<?xml version="1.0"?>
<fmiModelDescription fmiVersion="2.0" modelName="lawful" guid="{lawful}">
  <CoSimulation modelIdentifier="lawful" canHandleVariableCommunicationStepSize="true" canGetAndSetFMUstate="true" canSerializeFMUstate="true"/>
  <ModelVariables>
    <ScalarVariable name="count" valueReference="0" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="u" valueReference="2" causality="input"><Real start="0"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="1"/></Outputs><InitialUnknowns><Unknown index="1"/></InitialUnknowns></ModelStructure>
</fmiModelDescription>"#;

const XML_3: &str = r#"<?xml version="1.0"?>
<fmiModelDescription fmiVersion="3.0" modelName="lawful" instantiationToken="{lawful}">
  <CoSimulation modelIdentifier="lawful" canHandleVariableCommunicationStepSize="true" canGetAndSetFMUState="true" canSerializeFMUState="true"/>
  <ModelVariables>
    <Float64 name="count" valueReference="0" causality="output"/>
    <Float64 name="u" valueReference="2" causality="input" start="0"/>
  </ModelVariables>
  <ModelStructure><Output valueReference="0"/><InitialUnknown valueReference="0"/></ModelStructure>
</fmiModelDescription>"#;

/// How many lives of an instance are walked through for each version, and how many calls each has.
const LIVES: u64 = 2_000;
const CALLS: usize = 60;

/// No sequence of legal calls of this crate makes an illegal one of the standard.
pub fn legal_calls_stay_legal() {
    for (xml, platform, arguments) in [(XML_2, "linux64", &[][..]), (XML_3, "x86_64-linux", &["-DTHREE"])] {
        let folder = archived("lawful", (xml, platform), arguments);
        let fmu = Arc::new(Fmu::open(&folder.path().join("lawful.fmu")).expect("an FMU"));
        let library = fmu.load_library().expect("a library");
        for seed in 0..LIVES {
            if let Err(error) = live(&library, seed) {
                panic!("FMI {}, seed {seed}: {error}", fmu.description.version);
            }
        }
        // Freeing tells nobody what was wrong with it.
        let mut last = LibrarySearch::new(&library, 0).expect("an instance");
        last.initialise().expect("an initialization");
        assert_eq!(last.violations().expect("a count"), 0.0, "FMI {}", fmu.description.version);
    }
}

/// The walk finds illegal calls: an FMU that is told of none would pass otherwise.
pub fn an_illegal_call_is_told_with_its_state() {
    for (xml, platform, arguments, call) in [
        (XML_2, "linux64", &[][..], "fmi2Terminate is illegal in the state instantiated: not now"),
        (XML_3, "x86_64-linux", &["-DTHREE"], "fmi3Terminate is illegal in the state instantiated: not now"),
    ] {
        let folder = archived("lawful", (xml, platform), arguments);
        let library = Arc::new(Fmu::open(Path::new(&folder.path().join("lawful.fmu"))).expect("an FMU"))
            .load_library()
            .expect("a library");
        let mut walk = LibrarySearch::new(&library, 0).expect("an instance");
        let error = walk.instance.terminate().expect_err("an illegal call");
        assert!(error.what.contains(call), "{error}");
        walk.instance.reset().expect("a reset");
        walk.initialise().expect("an initialization");
        assert_eq!(walk.violations().expect("a count"), 1.0);
    }
}

/// The standard asks for a reset in every state, so that a refusal needs the state to be understood.
pub fn a_refused_reset_names_the_state() {
    for (xml, platform, arguments) in
        [(XML_2, "linux64", &["-DSTUBBORN"][..]), (XML_3, "x86_64-linux", &["-DSTUBBORN", "-DTHREE"])]
    {
        let folder = archived("lawful", (xml, platform), arguments);
        let fmu = Arc::new(Fmu::open(&folder.path().join("lawful.fmu")).expect("an FMU"));
        let library = fmu.load_library().expect("a library");
        let reset = |walk: &mut LibrarySearch| walk.instance.reset().expect_err("a refusal").to_string();
        let mut walk = LibrarySearch::new(&library, 0).expect("an instance");
        let said = reset(&mut walk);
        assert!(said.contains("Reset before the initialization returned fmi"), "{said}");
        // After the error it is another state.
        let said = reset(&mut walk);
        assert!(said.contains("Reset after an error of fmi"), "{said}");
        let mut walk = LibrarySearch::new(&library, 0).expect("an instance");
        walk.initialise().expect("an initialization");
        let said = reset(&mut walk);
        assert!(said.contains("Reset between two steps returned fmi"), "{said}");
        let mut walk = LibrarySearch::new(&library, 0).expect("an instance");
        walk.initialise().expect("an initialization");
        walk.instance.terminate().expect("an end");
        let said = reset(&mut walk);
        assert!(said.contains("Reset after the end of the simulation returned fmi"), "{said}");
    }
}

type Done = Result<(), Box<dyn std::error::Error>>;

#[derive(Clone, Copy, PartialEq)]
enum Phase {
    Fresh,
    SetUp,
    Initialization,
    StepCounter,
    Discarded,
    Ended,
}

/// An instance, and what a caller knows of it.
struct LibrarySearch {
    instance: Instance,
    phase: Phase,
    time: f64,
    /// The states that can be restored, with the phase and the time that they hold.
    states: Vec<(FmuState, Phase, f64)>,
    bytes: Option<(Vec<u8>, Phase, f64)>,
    random: Pcg64,
}

impl LibrarySearch {
    fn new(library: &Arc<FmuLibrary>, seed: u64) -> Result<Self, Box<dyn std::error::Error>> {
        let instance = Instance::new(Arc::clone(library), "walk", false)?;
        let random = Pcg64::seed_from_u64(seed);
        let (states, bytes) = (Vec::new(), None);
        Ok(LibrarySearch { instance, phase: Phase::Fresh, time: 0.0, states, bytes, random })
    }

    fn initialise(&mut self) -> Done {
        self.instance.setup_experiment(0.0, 1000.0, None)?;
        self.instance.enter_initialization()?;
        self.instance.exit_initialization()?;
        self.phase = Phase::StepCounter;
        Ok(())
    }

    fn violations(&mut self) -> Result<f64, Box<dyn std::error::Error>> {
        let mut count = [0.0];
        self.instance.get_numbers(fmu_import::StorageType::Float64, &[0], &mut count)?;
        Ok(count[0])
    }

    fn set(&mut self) -> Done {
        Ok(self.instance.set_numbers(fmu_import::StorageType::Float64, &[2], &[1.0])?)
    }

    /// Takes one call that the phase allows.
    fn go(&mut self) -> Done {
        match (self.phase, self.random.random_range(0..10)) {
            // An FMU of FMI 3.0 hears of the experiment later, so that its states from between hold none.
            (phase, 0) if phase != Phase::SetUp => self.save()?,
            (_, 1) => self.forget(),
            (_, 2) if self.random.random_range(0..4) == 0 => {
                self.instance.reset()?;
                (self.phase, self.time) = (Phase::Fresh, 0.0);
            }
            (_, 3) => self.restore()?,
            (Phase::Fresh, 4) => self.instance.set_in_configuration_mode(|_| Ok(()))?,
            (Phase::Fresh | Phase::SetUp | Phase::Initialization | Phase::StepCounter, 5) => self.set()?,
            (Phase::Fresh, _) => {
                self.time = f64::from(self.random.random_range(0..3));
                self.instance.setup_experiment(self.time, 1000.0, Some(1e-4))?;
                self.phase = Phase::SetUp;
            }
            (Phase::SetUp, _) => {
                self.instance.enter_initialization()?;
                self.phase = Phase::Initialization;
            }
            (Phase::Initialization, 6) => _ = self.violations()?,
            (Phase::Initialization, _) => {
                self.instance.exit_initialization()?;
                self.phase = Phase::StepCounter;
            }
            (Phase::StepCounter, 6) if self.random.random_range(0..5) == 0 => {
                self.instance.terminate()?;
                self.phase = Phase::Ended;
            }
            (Phase::StepCounter, 6 | 7) => _ = self.violations()?,
            (Phase::StepCounter, _) => self.step()?,
            (Phase::Discarded, 4 | 5) => {
                self.instance.terminate()?;
                self.phase = Phase::Ended;
            }
            (Phase::Discarded | Phase::Ended, _) => _ = self.violations()?,
        }
        Ok(())
    }

    fn step(&mut self) -> Done {
        let size = [0.1, 0.25, 1.0][self.random.random_range(0..3)];
        match self.instance.do_step(self.time, size)? {
            StepStatus::Done => self.time += size,
            StepStatus::Discarded { reached, .. } | StepStatus::Terminated { reached, .. } => {
                (self.phase, self.time) = (Phase::Discarded, reached);
            }
        }
        Ok(())
    }

    fn save(&mut self) -> Done {
        let (phase, time) = (self.phase, self.time);
        match self.random.random_range(0..4) {
            0 if !self.states.is_empty() => {
                self.instance.save_into(&mut self.states[0].0)?;
                (self.states[0].1, self.states[0].2) = (phase, time);
            }
            1 => {
                let state = self.instance.save_state()?;
                self.bytes = Some((self.instance.serialise_state(&state)?, phase, time));
                // The bytes may bring the state back.
                self.instance.set_keeps_earlier_states(true);
            }
            2 => {
                if let Some((bytes, phase, time)) = &self.bytes {
                    let state = self.instance.deserialise_state(bytes)?;
                    self.states.push((state, *phase, *time));
                }
            }
            _ => self.states.push((self.instance.save_state()?, phase, time)),
        }
        self.states.truncate(8);
        Ok(())
    }

    fn restore(&mut self) -> Done {
        if let Some((state, phase, time)) = self.states.last() {
            self.instance.restore_state(state)?;
            (self.phase, self.time) = (*phase, *time);
        }
        Ok(())
    }

    /// Frees a state now, or leaves that to the instance.
    fn forget(&mut self) {
        let now = self.random.random();
        if let Some((state, ..)) = self.states.pop()
            && now
        {
            let _ = self.instance.free_saved_state(state);
        }
    }
}

fn live(library: &Arc<FmuLibrary>, seed: u64) -> Done {
    let mut walk = LibrarySearch::new(library, seed)?;
    (0..CALLS).try_for_each(|_| walk.go())
}
