//! Damaged inputs of all formats: those that were hard once, and new ones.

mod formats;

/// Tests that replay a target, with so many new inputs.
macro_rules! replays {
    ($($name:ident: $group:ident::$target:ident, $count:literal;)*) => {
        $(
            #[test]
            fn $name() {
                damage::replay_corpus(&formats::$group::$target::TARGET, $count);
            }
        )*
    };
}

replays! {
    archives_are_taken_or_refused: archive::archives, 2_000;
    files_of_test_benches_are_taken_or_refused: bench::damaged, 10_000;
    conditions_are_taken_or_refused: expression::expressions, 2_000;
    descriptions_of_fmi_2_are_taken_or_refused: fmu::descriptions, 1_000;
    descriptions_of_fmi_3_are_taken_or_refused: fmu::descriptions_3, 1_000;
    logs_are_taken_or_refused: log::damaged, 2_000;
    mat_files_are_taken_or_refused: mat::damaged, 20_000;
    measurement_files_are_taken_or_refused: mdf::damaged, 20_000;
    configurations_and_answers_of_plugins_are_taken_or_refused: plugin_answers::plugins, 2_000;
    recordings_that_are_read_are_taken_or_refused: recordings::readings, 300;
    recordings_that_are_recovered_are_taken_or_refused: recordings::recoveries, 300;
    tables_are_taken_or_refused: recordings::tables, 2_000;
    roads_are_taken_or_refused: road::damaged, 2_000;
    bags_are_taken_or_refused: ros::damaged, 2_000;
    scenarios_are_taken_or_refused: scenario::scenarios, 500;
    systems_are_taken_or_refused: system::systems, 1_000;
}
