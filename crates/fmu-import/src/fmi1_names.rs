//! Names functions and statuses of FMI 1.0 by those that FMI 2.0 has in their place.

use std::ffi::CStr;

const fn c_name(text: &'static str) -> &'static CStr {
    match CStr::from_bytes_with_nul(text.as_bytes()) {
        Ok(name) => name,
        Err(_) => panic!("a name ends with NUL"),
    }
}

/// The name in FMI 2.0, in co-simulation and in model exchange of FMI 1.0.
struct NameRow {
    two: &'static CStr,
    slave: &'static CStr,
    model: &'static CStr,
}

macro_rules! names {
    (@name $start:literal $two:literal) => { c_name(concat!($start, $two, "\0")) };
    (@row $two:literal) => { names!(@row $two = $two) };
    (@row $two:literal = $one:literal) => { names!(@row $two = $one | $one) };
    (@row $two:literal = $slave:literal | $model:literal) => {
        NameRow {
            two: names!(@name "fmi2" $two),
            slave: names!(@name "fmi" $slave),
            model: names!(@name "fmi" $model),
        }
    };
    ($($two:literal $(= $slave:literal $(| $model:literal)?)?),* $(,)?) => {
        &[$(names!(@row $two $(= $slave $(| $model)?)?)),*]
    };
}

/// What stands in the place of a call in messages.
const PHRASES: &[NameRow] = &[
    NameRow {
        two: c"reading the text of fmi2GetString",
        slave: c"reading the text of fmiGetString",
        model: c"reading the text of fmiGetString",
    },
    NameRow {
        two: c"fmi2DoStep or a call beside it",
        slave: c"fmiDoStep or a call beside it",
        model: c"fmiGetDerivatives or a call beside it",
    },
];

const NAMES: &[NameRow] = names! {
    "GetVersion",
    "GetTypesPlatform" = "GetTypesPlatform" | "GetModelTypesPlatform",
    "SetDebugLogging",
    "Instantiate" = "InstantiateSlave" | "InstantiateModel",
    "FreeInstance" = "FreeSlaveInstance" | "FreeModelInstance",
    "SetupExperiment" = "InitializeSlave" | "SetTime",
    "EnterInitializationMode" = "InitializeSlave" | "Initialize",
    "ExitInitializationMode" = "InitializeSlave" | "Initialize",
    "Terminate" = "TerminateSlave" | "Terminate",
    "Reset" = "ResetSlave",
    "GetReal",
    "GetInteger",
    "GetBoolean",
    "GetString",
    "SetReal",
    "SetInteger",
    "SetBoolean",
    "SetString",
    "SetRealInputDerivatives",
    "GetRealOutputDerivatives",
    "DoStep",
    "CancelStep",
    "GetStatus",
    "GetRealStatus",
    "GetBooleanStatus",
    "SetTime",
    "SetContinuousStates",
    "GetContinuousStates",
    "GetDerivatives",
    "GetEventIndicators",
    "GetNominalsOfContinuousStates" = "GetNominalContinuousStates",
    "EnterEventMode" = "EventUpdate",
    "NewDiscreteStates" = "EventUpdate",
    "EnterContinuousTimeMode" = "EventUpdate",
    "CompletedIntegratorStep",
    "Warning",
    "Discard",
    "Error",
    "Fatal",
    "Pending",
};

/// A name of FMI 2.0, as Rust or C has it.
pub(crate) trait Fmi2Name: Sized {
    /// The name in FMI 1.0; itself where FMI 1.0 has nothing in its place.
    fn fmi1_name(self, model_exchange: bool) -> Self;
}

impl Fmi2Name for &'static CStr {
    fn fmi1_name(self, model_exchange: bool) -> Self {
        let row = NAMES.iter().chain(PHRASES).find(|row| row.two == self);
        row.map_or(self, |row| if model_exchange { row.model } else { row.slave })
    }
}

impl Fmi2Name for &'static str {
    fn fmi1_name(self, model_exchange: bool) -> Self {
        let row = NAMES.iter().find(|row| row.two.to_bytes() == self.as_bytes());
        let name = row.map(|row| if model_exchange { row.model } else { row.slave });
        name.and_then(|name| name.to_str().ok()).unwrap_or(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functions_have_the_names_of_their_interface() {
        for (two, model_exchange, one) in [
            ("fmi2DoStep", false, "fmiDoStep"),
            ("fmi2Terminate", false, "fmiTerminateSlave"),
            ("fmi2Terminate", true, "fmiTerminate"),
            ("fmi2NewDiscreteStates", true, "fmiEventUpdate"),
            ("fmi2GetFMUstate", false, "fmi2GetFMUstate"),
        ] {
            assert_eq!(two.fmi1_name(model_exchange), one);
        }
        assert_eq!(c"fmi2Instantiate".fmi1_name(true), c"fmiInstantiateModel");
    }
}
