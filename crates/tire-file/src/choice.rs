//! A tire by FMU parameters: the text of a file or its path, and scale factors.
#![allow(non_snake_case, reason = "the keys of .tir files")]

use std::path::Path;
use std::sync::Arc;

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use tire::{Coefficients, MfTire};

use crate::{TireFileErrors, TireFileMessage, TireMessageLevel, check_plausibility, read_bytes, read_tir};

/// The largest file [B].
const LARGEST: u64 = 16 << 20;

/// A tire as parameters describe it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TireSpecification {
    /// The text of a `.tir` file, which has line ends, or its path. Empty is [`Coefficients::sports_tire`]. Clones share it: a model
    /// has one before each of its steps.
    #[serde(serialize_with = "serialize_text", deserialize_with = "deserialize_text")]
    pub tir: Arc<String>,
    /// Factor to the longitudinal friction [-].
    pub LMUX: f64,
    /// Factor to the lateral friction [-].
    pub LMUY: f64,
    /// Factor to the longitudinal slip stiffness [-].
    pub LKX: f64,
    /// Factor to the cornering stiffness [-].
    pub LKY: f64,
}

fn serialize_text<S: Serializer>(text: &Arc<String>, serializer: S) -> Result<S::Ok, S::Error> {
    text.as_str().serialize(serializer)
}

fn deserialize_text<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Arc<String>, D::Error> {
    String::deserialize(deserializer).map(Arc::new)
}

impl Default for TireSpecification {
    fn default() -> Self {
        Self { tir: Arc::default(), LMUX: 1.0, LMUY: 1.0, LKX: 1.0, LKY: 1.0 }
    }
}

impl TireSpecification {
    /// The tire, what it is like in one line, and what its file is warned of. `name` stands for the file in messages.
    ///
    /// # Errors
    /// In words, when the file cannot be read or is no tire.
    pub fn load_tire(&self, name: &str) -> Result<(MfTire, Vec<TireFileMessage>), String> {
        let (coefficients, messages) = self.load_coefficients(name)?;
        let scaled = Coefficients {
            LMUX: coefficients.LMUX * self.LMUX,
            LMUY: coefficients.LMUY * self.LMUY,
            LKX: coefficients.LKX * self.LKX,
            LKY: coefficients.LKY * self.LKY,
            ..coefficients
        };
        let tire = MfTire::new(scaled).map_err(|bad| format!("{name}: {bad}"))?;
        if self.tir.trim().is_empty() {
            return Ok((tire, Vec::new()));
        }
        let mut first = check_plausibility(&tire);
        let (warnings, notes): (Vec<_>, Vec<_>) =
            messages.into_iter().partition(|message| message.level == TireMessageLevel::Warning);
        if !notes.is_empty() {
            first.text += &format!(" ({} notes on the file: `trackside tire` has them)", notes.len());
        }
        let named = |message: TireFileMessage| TireFileMessage {
            text: format!("{name}: {message}"),
            line: None,
            ..message
        };
        Ok((tire, std::iter::once(first).chain(warnings).map(named).collect()))
    }

    fn load_coefficients(&self, name: &str) -> Result<(Coefficients, Vec<TireFileMessage>), String> {
        let written = self.tir.trim();
        if written.is_empty() {
            return Ok((Coefficients::sports_tire(), Vec::new()));
        }
        if written.contains(['\n', '\r']) {
            return read_tir(&self.tir, name).map_err(|errors| errors.to_string());
        }
        let wrong =
            |what: String| format!("{name} has one line, so it is the path of a file: `{written}` {what}");
        let path = Path::new(written);
        let size = path.metadata().map_err(|error| wrong(format!("cannot be read: {error}")))?.len();
        if size > LARGEST {
            return Err(wrong(format!("has {size} B, expected at most {LARGEST} B")));
        }
        let bytes = std::fs::read(path).map_err(|error| wrong(format!("cannot be read: {error}")))?;
        let with_name = |errors: TireFileErrors| format!("{name}: {errors}");
        read_bytes(&bytes, written).map_err(with_name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tire_is_chosen_by_text_by_path_and_by_nothing() {
        let choice = |tir: &str| TireSpecification {
            tir: Arc::new(tir.to_owned()),
            LMUY: 0.5,
            ..TireSpecification::default()
        };
        let (tire, messages) = choice("").load_tire("tire_f.tir").expect("the default");
        assert_eq!((tire.coefficients().LMUY, messages.len()), (0.5, 0));
        let text =
            crate::write_tir_text(&Coefficients { FNOMIN: 3210.0, ..Coefficients::sports_tire() }, &[]);
        for text in [text.clone(), text.replace('\n', "\r")] {
            let (tire, messages) = choice(&text).load_tire("tire_f.tir").expect("a tire");
            assert_eq!(tire.coefficients().FNOMIN, 3210.0);
            let first = &messages[0];
            assert_eq!(first.level, TireMessageLevel::Note, "{first}");
            assert!(first.text.starts_with("tire_f.tir: MF 6.2: lateral friction 0.5"), "{first}");
        }
        let error = choice("none.tir").load_tire("tire_f.tir").expect_err("no file");
        assert!(error.starts_with("tire_f.tir has one line"), "{error}");
        assert!(error.contains("`none.tir` cannot be read"), "{error}");
        let error = choice(&text.replace("= 3210", "= soft")).load_tire("tire_f.tir").expect_err("no number");
        assert!(error.starts_with("tire_f.tir:") && error.contains("found `soft"), "{error}");
    }
}
