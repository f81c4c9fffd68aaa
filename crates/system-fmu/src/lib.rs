//! The library of an FMU that is a whole scenario: its resources say which one.

fmu_export::export_instance!(system::ScenarioInstance);
