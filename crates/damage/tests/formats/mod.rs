//! All formats whose inputs are damaged; each one stands beside the tests of its package.

use damage::FuzzTarget;

#[path = "../../.."]
pub mod archive {
    #[path = "archive/tests/support/archives.rs"]
    pub mod archives;
}

#[path = "../../.."]
pub mod bench {
    pub use super::mat::writer;
    #[path = "tire-bench/tests/support/damaged.rs"]
    pub mod damaged;
}

#[path = "../../.."]
pub mod expression {
    #[path = "expression/tests/support/expressions.rs"]
    pub mod expressions;
}

#[path = "../../.."]
pub mod fmu {
    #[path = "fmu-import/tests/support/descriptions.rs"]
    pub mod descriptions;
    #[path = "fmu-import/tests/support/descriptions_3.rs"]
    pub mod descriptions_3;
    #[path = "fmu-import/tests/support/opened.rs"]
    pub mod opened;
}

#[path = "../../.."]
pub mod log {
    pub use super::mat::writer as mat;
    #[path = "log-file/tests/support/damaged.rs"]
    pub mod damaged;
    #[path = "log-file/tests/support/ld.rs"]
    pub mod ld;
    #[path = "log-file/tests/support/writers.rs"]
    pub mod writers;
}

#[path = "../../.."]
pub mod mat {
    #[path = "mat-file/tests/support/damaged.rs"]
    pub mod damaged;
    #[path = "mat-file/tests/support/writer.rs"]
    pub mod writer;
}

#[path = "../../.."]
pub mod mdf {
    #[path = "mdf-file/tests/support/damaged.rs"]
    pub mod damaged;
    #[path = "mdf-file/tests/support/files.rs"]
    pub mod files;
    #[path = "mdf-file/tests/support/made.rs"]
    pub mod made;
    #[path = "mdf-file/tests/support/old.rs"]
    pub mod old;
}

#[path = "../../.."]
pub mod plugin_answers {
    #[path = "plugin/tests/support/plugins.rs"]
    pub mod plugins;
}

#[path = "../../.."]
pub mod recordings {
    #[path = "recording/tests/support/made.rs"]
    pub mod made;
    #[path = "recording/tests/support/readings.rs"]
    pub mod readings;
    #[path = "recording/tests/support/recoveries.rs"]
    pub mod recoveries;
    #[path = "recording/tests/support/tables.rs"]
    pub mod tables;
}

#[path = "../../.."]
pub mod road {
    #[path = "track-file/tests/support/damaged.rs"]
    pub mod damaged;
}

#[path = "../../.."]
pub mod ros {
    #[path = "ros-bag/tests/support/damaged.rs"]
    pub mod damaged;
    #[path = "ros-bag/tests/support/made.rs"]
    pub mod made;
}

#[path = "../../.."]
pub mod scenario {
    #[path = "scenario/tests/support/everything.rs"]
    pub mod everything;
    #[path = "scenario/tests/support/scenarios.rs"]
    pub mod scenarios;
}

#[path = "../../.."]
pub mod system {
    #[path = "ssp/tests/support/systems.rs"]
    pub mod systems;
}

/// What reads them, for the program.
#[allow(dead_code, reason = "the tests name each by itself")]
pub const ALL: [&FuzzTarget; 16] = [
    &archive::archives::TARGET,
    &bench::damaged::TARGET,
    &expression::expressions::TARGET,
    &fmu::descriptions::TARGET,
    &fmu::descriptions_3::TARGET,
    &log::damaged::TARGET,
    &mat::damaged::TARGET,
    &mdf::damaged::TARGET,
    &plugin_answers::plugins::TARGET,
    &recordings::readings::TARGET,
    &recordings::recoveries::TARGET,
    &recordings::tables::TARGET,
    &road::damaged::TARGET,
    &ros::damaged::TARGET,
    &scenario::scenarios::TARGET,
    &system::systems::TARGET,
];
