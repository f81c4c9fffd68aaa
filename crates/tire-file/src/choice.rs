//! Lets the parameters of an FMU choose a tire: by the text of a file or its path, and by scale factors.
#![allow(non_snake_case, reason = "the keys of .tir files")]

use std::path::Path;

use serde::{Deserialize, Serialize};
use tire::{Coefficients, MfTire};

use crate::{Message, decode, read};

/// The largest file [B].
const LARGEST: u64 = 16 << 20;

/// A tire as parameters describe it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TireChoice {
    /// The text of a `.tir` file, or its path, which has no line end. Empty is [`Coefficients::sports_tire`].
    pub tir: String,
    /// Factor to the longitudinal friction [-].
    pub LMUX: f64,
    /// Factor to the lateral friction [-].
    pub LMUY: f64,
    /// Factor to the longitudinal slip stiffness [-].
    pub LKX: f64,
    /// Factor to the cornering stiffness [-].
    pub LKY: f64,
}

impl Default for TireChoice {
    fn default() -> Self {
        Self { tir: String::new(), LMUX: 1.0, LMUY: 1.0, LKX: 1.0, LKY: 1.0 }
    }
}

impl TireChoice {
    /// The tire, and what there is to tell about its file; `name` stands for it in errors.
    ///
    /// # Errors
    /// In words, when the file cannot be read or is no tire.
    pub fn tire(&self, name: &str) -> Result<(MfTire, Vec<Message>), String> {
        let (coefficients, messages) = self.coefficients(name)?;
        let scaled = Coefficients {
            LMUX: coefficients.LMUX * self.LMUX,
            LMUY: coefficients.LMUY * self.LMUY,
            LKX: coefficients.LKX * self.LKX,
            LKY: coefficients.LKY * self.LKY,
            ..coefficients
        };
        let tire = MfTire::new(scaled).map_err(|bad| format!("{name}: {bad}"))?;
        Ok((tire, messages))
    }

    fn coefficients(&self, name: &str) -> Result<(Coefficients, Vec<Message>), String> {
        let written = self.tir.trim();
        if written.is_empty() {
            return Ok((Coefficients::sports_tire(), Vec::new()));
        }
        if written.contains('\n') {
            return read(&self.tir, name).map_err(|errors| errors.to_string());
        }
        let wrong = |what: String| format!("{name}: the tire file {written} {what}");
        let path = Path::new(written);
        let size =
            path.metadata().map_err(|error| wrong(format!("cannot be read: {error}")))?.len();
        if size > LARGEST {
            return Err(wrong(format!("has {size} B, expected at most {LARGEST} B")));
        }
        let bytes =
            std::fs::read(path).map_err(|error| wrong(format!("cannot be read: {error}")))?;
        read(&decode(&bytes), written).map_err(|errors| format!("{name}: {errors}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tire_is_chosen_by_text_by_path_and_by_nothing() {
        let choice =
            |tir: &str| TireChoice { tir: tir.to_owned(), LMUY: 0.5, ..TireChoice::default() };
        let (tire, messages) = choice("").tire("tire_f.tir").expect("the default");
        assert_eq!((tire.coefficients().LMUY, messages.len()), (0.5, 0));
        let text =
            crate::write(&Coefficients { FNOMIN: 3210.0, ..Coefficients::sports_tire() }, &[]);
        let (tire, _) = choice(&text).tire("tire_f.tir").expect("a tire");
        assert_eq!(tire.coefficients().FNOMIN, 3210.0);
        let error = choice("none.tir").tire("tire_f.tir").expect_err("no file");
        assert!(error.starts_with("tire_f.tir: the tire file none.tir cannot be read"), "{error}");
        let error =
            choice(&text.replace("= 3210", "= soft")).tire("tire_f.tir").expect_err("no number");
        assert!(error.starts_with("tire_f.tir:") && error.contains("found `soft"), "{error}");
    }
}
