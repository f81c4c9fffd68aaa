//! Writes the fitted tire as the text of a `.tir` file, with the terms in a section that other readers skip.

use std::fmt::Write as _;

use crate::fit::TireFit;
use crate::model::TERMS;

/// The text of a file: how well each coefficient is known stands in comments at its beginning, the terms in `[BENCH_TERMS]` at its end.
pub fn write_tir(fit: &TireFit) -> String {
    let mut about = vec!["Fitted to data of a test bench; value +- standard deviation, verdict".to_owned()];
    about.extend(fit.estimates.iter().map(|it| {
        format!(
            "{:<6} {:.6} +- {:.2e} {}: {}",
            it.name,
            it.value,
            it.std,
            it.verdict.to_display_text(),
            it.reason
        )
    }));
    let mut text = tire_file::write_tir_text(&fit.coefficients, &about);
    let _ = writeln!(
        text,
        "[BENCH_TERMS]\nREFERENCE_TEMPERATURE    = {:<22} $Of tread and carcass [K].",
        fit.reference
    );
    for (term, value) in TERMS.iter().zip(fit.terms) {
        let _ = writeln!(text, "{:<25}= {value:<22} ${}.", term.name, term.doc);
    }
    text
}
