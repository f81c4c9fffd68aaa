//! Uses the program as a person does, from the command line, and judges what it prints, returns and writes.

use std::process::ExitCode;

// Lists and runs the tests.
#[macro_use]
#[path = "acceptance/suite.rs"]
mod suite;
// The requirements of tests besides the workspace.
#[path = "acceptance/requirement.rs"]
mod requirement;

// Scenario files, built section by section.
#[path = "acceptance/fixture.rs"]
mod fixture;
// Starts the program in folders of its own.
#[path = "acceptance/harness.rs"]
mod harness;
// Makes FMUs: ours packed, a broken one compiled, archives with something wrong.
#[path = "acceptance/fmus.rs"]
mod fmus;
// Other people's programs: a virtual environment with fmpy, mcap and the Rerun viewer.
#[path = "acceptance/python.rs"]
mod python;

// Starts Slurm and HyperQueue on this machine.
#[path = "acceptance/engines.rs"]
mod engines;

// Archives packed in unusual ways, unfit temporary folders.
#[path = "acceptance/archives.rs"]
mod archives;
// FMUs that bring libraries along, share symbols or leave threads.
#[path = "acceptance/libraries.rs"]
mod libraries;
// Dependencies, and crates with `unsafe`.
#[path = "acceptance/architecture.rs"]
mod architecture;
// The Python package.
#[path = "acceptance/python_package.rs"]
mod python_package;
// Golden recordings.
#[path = "acceptance/baselines.rs"]
mod baselines;
// Mistakes of users, and the messages about them.
#[path = "acceptance/bad_input.rs"]
mod bad_input;
// Immense names, absurd numbers, very many of something.
#[path = "acceptance/hostile_inputs.rs"]
mod hostile_inputs;
// Causes of the difference between two runs.
#[path = "acceptance/why.rs"]
mod why;
#[path = "acceptance/wine.rs"]
mod wine;
// Two runs in one recording.
#[cfg(feature = "rerun")]
#[path = "acceptance/comparing.rs"]
mod comparing;
// Checkpoints: runs that go on, in another process or in the same one.
#[path = "acceptance/checkpoints.rs"]
mod checkpoints;
// Checkpoints that do not fit, are damaged, or of FMUs that forget.
#[path = "acceptance/checkpoint_mistakes.rs"]
mod checkpoint_mistakes;
// Calls of FMUs that fail on demand.
#[path = "acceptance/call_faults.rs"]
mod call_faults;
// Inspect, test, --set, several scenarios.
#[path = "acceptance/cli.rs"]
mod cli;
// The player of a report, in a browser.
#[path = "acceptance/player.rs"]
mod player;
// What FMUs log.
#[path = "acceptance/messages.rs"]
mod messages;
// FMUs for model exchange, whose equations this program integrates.
#[path = "acceptance/model_exchange.rs"]
mod model_exchange;
// Our FMUs and one that breaks rules, judged by the rules of FMI 2.0.
#[path = "acceptance/conform.rs"]
mod conform;
// The same for FMI 3.0; references in archives, descriptions that cannot be read.
#[path = "acceptance/conform3.rs"]
mod conform3;
// Sweeps of this machine.
#[path = "acceptance/sweeps.rs"]
mod sweeps;
// Mistakes in sweeps.
#[path = "acceptance/sweep_mistakes.rs"]
mod sweep_mistakes;
// Sweeps by a real Slurm and a real HyperQueue.
#[path = "acceptance/cluster.rs"]
mod cluster;
// Sweeps that are submitted to processes of this machine, and mistakes in it.
#[path = "acceptance/submitting.rs"]
mod submitting;
// Halves of known systems, coupled by each algorithm.
#[path = "acceptance/coupling.rs"]
mod coupling;
// Loops and orders of scenarios, and mistakes in their words.
#[path = "acceptance/coupling_words.rs"]
mod coupling_words;
// Parts of couplings that depend on each other.
#[path = "acceptance/coupling_together.rs"]
mod coupling_together;
// The same scenario gives the same numbers, and a report that is complete.
#[path = "acceptance/determinism.rs"]
mod determinism;
// Schema and reference of scenarios.
#[path = "acceptance/editors.rs"]
mod editors;
// The contents of the documents: commands, scenarios, recipes, links.
#[path = "acceptance/documents.rs"]
mod documents;
// The Modelica Reference FMUs, if they are at hand.
#[path = "acceptance/reference_fmus.rs"]
mod reference_fmus;
// Disks that are full.
#[path = "acceptance/full_disks.rs"]
mod full_disks;
// Runs that are killed, and what is recovered of them.
#[path = "acceptance/killed.rs"]
mod killed;
// Inputs of any size.
#[path = "acceptance/sizes.rs"]
mod sizes;
// Errors of logs.
#[path = "acceptance/doctor.rs"]
mod doctor;
// Scenarios that extend others, and mistakes in them.
#[path = "acceptance/extending.rs"]
mod extending;
// Failures of FMUs, and the recordings they leave.
#[path = "acceptance/failing_fmu.rs"]
mod failing_fmu;
#[path = "acceptance/fastest_lap.rs"]
mod fastest_lap;
// Signals that end runs.
#[path = "acceptance/signals.rs"]
mod signals;
// FMUs in processes of their own.
#[path = "acceptance/isolated.rs"]
mod isolated;
// An FMU of FMI 3.0 with event mode and clocks.
#[path = "acceptance/clocks.rs"]
mod clocks;
// FMUs of FMI 1.0.
#[path = "acceptance/fmi1.rs"]
mod fmi1;
// An FMU of FMI 3.0, with arrays.
#[path = "acceptance/fmi3.rs"]
mod fmi3;
// FMUs whose descriptions break the standard.
#[path = "acceptance/descriptions.rs"]
mod descriptions;
// An FMU that does what foreign ones do.
#[path = "acceptance/foreign.rs"]
mod foreign;
// Features of dependencies, which decide what cargo compiles.
#[path = "acceptance/features.rs"]
mod features;
// Tires out of recordings, against the truth and against scipy.
#[path = "acceptance/identification.rs"]
mod identification;
// Other masters with our FMUs: libcosim and Ecos.
#[path = "acceptance/importers.rs"]
mod importers;
// Ends of the program: by foreign code, by limits, by signals.
#[path = "acceptance/ending.rs"]
mod ending;
// Crashes of foreign code, in calls and outside of them.
#[path = "acceptance/crashes.rs"]
mod crashes;
// Texts of others, with what a terminal obeys.
#[path = "acceptance/escapes.rs"]
mod escapes;
// What foreign code changes for the whole process.
#[path = "acceptance/surroundings.rs"]
mod surroundings;
// A second opinion on our FMUs.
#[path = "acceptance/interop.rs"]
mod interop;
// Whoever looks runs nothing.
#[path = "acceptance/looking.rs"]
mod looking;
// Runs that are watched by a viewer.
#[cfg(feature = "rerun")]
#[path = "acceptance/live.rs"]
mod live;
// The report as a page.
#[path = "acceptance/packed_system.rs"]
mod packed_system;
#[path = "acceptance/pages.rs"]
mod pages;
// Analyses that are Python scripts.
#[path = "acceptance/python_analyses.rs"]
mod python_analyses;
// FMUs that are Python scripts.
#[path = "acceptance/python_fmus.rs"]
mod python_fmus;
// Scenarios that Python steps.
#[path = "acceptance/python_sessions.rs"]
mod python_sessions;
// Folders of FMUs against a plain loop of the same calls.
#[path = "acceptance/plain_loop.rs"]
mod plain_loop;
// Recordings of runs and of other people's programs, played back.
#[path = "acceptance/playback.rs"]
mod playback;
// Bags of ROS 2, of other programs.
#[path = "acceptance/ros_bags.rs"]
mod ros_bags;
// Analyses, and mistakes in them.
#[path = "acceptance/plugins.rs"]
mod plugins;
// Instructions of small workloads, by valgrind.
#[path = "acceptance/instructions.rs"]
mod instructions;
// Memory errors in our FMUs, by valgrind.
#[path = "acceptance/memory.rs"]
mod memory;
// A second opinion on our recordings, also of a run that was killed.
#[path = "acceptance/recordings.rs"]
mod recordings;
// Suites from FMUs and reference results, and runs that are taken as right.
#[path = "acceptance/first_suite.rs"]
mod first_suite;
// The obstacles of a first day.
#[path = "acceptance/first_day.rs"]
mod first_day;
// Files of parameters.
#[path = "acceptance/parameters.rs"]
mod parameters;
// Driving tests of standards.
#[path = "acceptance/manoeuvres.rs"]
mod manoeuvres;
// Tire property files.
#[path = "acceptance/tires.rs"]
mod tires;
// Folders of results, and all that can happen to them.
#[path = "acceptance/releasing.rs"]
mod releasing;
#[path = "acceptance/results.rs"]
mod results;
// States of FMUs that are saved and restored.
#[path = "acceptance/state.rs"]
mod state;
// Scenarios that are packed as systems of SSP, and read back.
#[path = "acceptance/ssp_export.rs"]
mod ssp_export;
// FMUs of C sources, which are compiled.
#[path = "acceptance/source_fmus.rs"]
mod source_fmus;
// Systems of SSP.
#[path = "acceptance/systems.rs"]
mod systems;
// Archives with libraries for several platforms.
#[path = "acceptance/targets.rs"]
mod targets;
// Groups of variables that are connected at once.
#[path = "acceptance/terminals.rs"]
mod terminals;
// Systems of SSP that are parts of scenarios.
#[path = "acceptance/subsystems.rs"]
mod subsystems;
// Mistakes with them.
#[path = "acceptance/subsystem_mistakes.rs"]
mod subsystem_mistakes;
// Values of every type of FMI: connections, start values, recordings, checks.
#[path = "acceptance/types.rs"]
mod types;
// Tunable parameters that change during a run.
#[path = "acceptance/tunable.rs"]
mod tunable;
// Units of connections, checks, diagrams and analyses, declared and missing.
#[path = "acceptance/units.rs"]
mod units;
// Scenarios that validate the results of another one, and mistakes in them.
#[path = "acceptance/validating.rs"]
mod validating;

fn main() -> ExitCode {
    let mut tests = Vec::new();
    architecture::register(&mut tests);
    archives::register(&mut tests);
    bad_input::register(&mut tests);
    baselines::register(&mut tests);
    why::register(&mut tests);
    wine::register(&mut tests);
    call_faults::register(&mut tests);
    checkpoint_mistakes::register(&mut tests);
    checkpoints::register(&mut tests);
    cli::register(&mut tests);
    clocks::register(&mut tests);
    cluster::register(&mut tests);
    #[cfg(feature = "rerun")]
    comparing::register(&mut tests);
    conform::register(&mut tests);
    conform3::register(&mut tests);
    coupling::register(&mut tests);
    coupling_together::register(&mut tests);
    coupling_words::register(&mut tests);
    crashes::register(&mut tests);
    descriptions::register(&mut tests);
    determinism::register(&mut tests);
    doctor::register(&mut tests);
    documents::register(&mut tests);
    editors::register(&mut tests);
    ending::register(&mut tests);
    escapes::register(&mut tests);
    extending::register(&mut tests);
    failing_fmu::register(&mut tests);
    fastest_lap::register(&mut tests);
    features::register(&mut tests);
    first_day::register(&mut tests);
    first_suite::register(&mut tests);
    fmi1::register(&mut tests);
    fmi3::register(&mut tests);
    foreign::register(&mut tests);
    full_disks::register(&mut tests);
    hostile_inputs::register(&mut tests);
    identification::register(&mut tests);
    importers::register(&mut tests);
    instructions::register(&mut tests);
    interop::register(&mut tests);
    isolated::register(&mut tests);
    killed::register(&mut tests);
    libraries::register(&mut tests);
    #[cfg(feature = "rerun")]
    live::register(&mut tests);
    looking::register(&mut tests);
    manoeuvres::register(&mut tests);
    memory::register(&mut tests);
    messages::register(&mut tests);
    model_exchange::register(&mut tests);
    packed_system::register(&mut tests);
    pages::register(&mut tests);
    player::register(&mut tests);
    parameters::register(&mut tests);
    plain_loop::register(&mut tests);
    playback::register(&mut tests);
    plugins::register(&mut tests);
    python_analyses::register(&mut tests);
    python_fmus::register(&mut tests);
    python_package::register(&mut tests);
    python_sessions::register(&mut tests);
    recordings::register(&mut tests);
    reference_fmus::register(&mut tests);
    releasing::register(&mut tests);
    results::register(&mut tests);
    ros_bags::register(&mut tests);
    signals::register(&mut tests);
    sizes::register(&mut tests);
    source_fmus::register(&mut tests);
    ssp_export::register(&mut tests);
    state::register(&mut tests);
    submitting::register(&mut tests);
    subsystem_mistakes::register(&mut tests);
    subsystems::register(&mut tests);
    surroundings::register(&mut tests);
    sweep_mistakes::register(&mut tests);
    sweeps::register(&mut tests);
    systems::register(&mut tests);
    targets::register(&mut tests);
    terminals::register(&mut tests);
    tires::register(&mut tests);
    tunable::register(&mut tests);
    types::register(&mut tests);
    units::register(&mut tests);
    validating::register(&mut tests);
    suite::run(&libtest_mimic::Arguments::from_args(), tests)
}
