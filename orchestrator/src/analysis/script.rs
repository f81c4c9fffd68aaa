//! Analyses by Python scripts: each runs in a process of its own, which ends when the run has to.

use std::sync::{Mutex, PoisonError};

use diagnostics::{Error, print_to_stderr};
use plugin::{AnalysisRequest, AnalysisServices as _, Signal};
use python::analysis::{AnalysisScript, DerivedSignals, ScriptMessage, SignalColumn};
use scenario::plan::{AnalysisPlan, SANDBOX_HINT};
use serde_json::{Number, Value};

use super::AnalysisHost;

/// The largest file of a script that goes into the folder of the run [bytes].
const LARGEST: u64 = 1 << 30;

/// Hands the signals of the request to the script that is `waiting`, or to a new process of it, and takes what it finds.
///
/// # Errors
/// When the script fails, or what it leaves cannot be written.
pub(super) fn run_analysis_script(
    plan: &AnalysisPlan,
    waiting: &Mutex<Option<AnalysisScript>>,
    request: &AnalysisRequest,
    host: &mut AnalysisHost,
) -> Result<Value, Error> {
    let name = &plan.name;
    let failed = |what: String| {
        let confined = plan.sandbox.as_ref().map(|_| format!("; {SANDBOX_HINT}"));
        Error::analysis_failure(name, what + &confined.unwrap_or_default())
    };
    let script = waiting.lock().unwrap_or_else(PoisonError::into_inner).take();
    let mut script = match script {
        Some(script) => script,
        None => plan.load_script_again().map_err(|failure| failed(failure.to_string()))?,
    };
    let columns = request.signals.iter().map(|Signal { name, unit, time, values }| SignalColumn {
        name,
        unit,
        time,
        values,
    });
    let config = toml_config_to_json(request.config).map_err(|error| failed(error.to_string()))?;
    let mut last = (0.0, String::new());
    let outcome = script.run_analysis(&columns.collect::<Vec<_>>(), &config, &mut |told| {
        match told {
            ScriptMessage::Printed(line) => print_to_stderr(&format!("{name}: {line}")),
            ScriptMessage::Signals(derived) => record_derived_signals(host, &derived),
            ScriptMessage::Progress(news) => last = news.unwrap_or_else(|| std::mem::take(&mut last)),
        }
        host.report_progress(last.0, &last.1)
    });
    if let Some(error) = host.error.take() {
        return Err(error);
    }
    let result = outcome.map_err(|failure| failed(failure.to_string()))?;
    store_script_files(&script, host)?;
    Ok(result)
}

fn record_derived_signals(host: &mut AnalysisHost, DerivedSignals { group, time, columns }: &DerivedSignals) {
    let signals = columns.iter().map(|(name, unit, values)| Signal { name, unit, time, values });
    host.record_signals(group, &signals.collect::<Vec<_>>());
}

/// Puts the files of the script into the folder of the run.
fn store_script_files(script: &AnalysisScript, host: &mut AnalysisHost) -> Result<(), Error> {
    let folder = script.output_folder();
    let wrong = |error: std::io::Error| Error::output_failure(&folder, error);
    let mut found: Vec<_> = std::fs::read_dir(&folder).and_then(Iterator::collect).map_err(wrong)?;
    found.sort_by_key(std::fs::DirEntry::file_name);
    for entry in found {
        let (name, metadata) = (entry.file_name(), entry.metadata().map_err(wrong)?);
        let Some(name) = name.to_str().filter(|_| metadata.is_file() && metadata.len() <= LARGEST) else {
            let what = format!(
                "expected files of at most {LARGEST} bytes with names in UTF-8 in `run.folder`, and no folders, found {}",
                name.display()
            );
            return Err(Error::analysis_failure(host.name, what));
        };
        host.write_result_file(name, std::fs::read(entry.path()).map_err(wrong)?)?;
    }
    Ok(())
}

/// The configuration as JSON. Dates are texts there, and what is no number is null.
fn toml_config_to_json(text: &str) -> Result<Value, toml::de::Error> {
    fn toml_value_to_json(value: toml::Value) -> Value {
        match value {
            toml::Value::String(text) => text.into(),
            toml::Value::Integer(number) => number.into(),
            toml::Value::Float(number) => Number::from_f64(number).map_or(Value::Null, Value::from),
            toml::Value::Boolean(truth) => truth.into(),
            toml::Value::Datetime(date) => date.to_string().into(),
            toml::Value::Array(list) => list.into_iter().map(toml_value_to_json).collect(),
            toml::Value::Table(table) => {
                table.into_iter().map(|(key, value)| (key, toml_value_to_json(value))).collect()
            }
        }
    }
    Ok(toml_value_to_json(toml::Value::Table(toml::from_str(text)?)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_configuration_of_every_type_becomes_json() {
        let text = "a = 1\nb = [1.5, nan]\nc = 2026-11-24\nd = { e = true, f = 'x' }\n";
        let expected = serde_json::json!({
            "a": 1, "b": [1.5, null], "c": "2026-11-24", "d": { "e": true, "f": "x" },
        });
        assert_eq!(toml_config_to_json(text).expect("TOML"), expected);
    }
}
