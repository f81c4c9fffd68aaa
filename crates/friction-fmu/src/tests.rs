//! Tests the estimator.

use fmu_export::description;

use super::*;

#[test]
fn the_table_agrees_with_the_model() {
    assert_eq!(description::problems::<Friction>(), Vec::<String>::new());
}
