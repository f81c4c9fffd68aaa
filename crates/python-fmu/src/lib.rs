//! The library of an FMU that is a Python script: its resources say which one.

fmu_export::export_instance!(python_model::ScriptInstance);
