//! `trackside tire`: key figures and curves of a `.tir` file, of two side by side, and files in other axes.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use diagnostics::{Error, escape_for_terminal, read_bounded};
use tire::{MfTire, TireAxes};
use tire_file::{TireFileMessage, TireMessageLevel};
use tire_report::{NamedTire, format_four_digits, key_figures};

use super::{print_text, print_to_stderr};
use orchestrator::nofollow;

/// The largest file [B].
const LARGEST: u64 = 16 << 20;

/// Arguments of `trackside tire`.
#[derive(Args)]
pub struct TireArguments {
    /// The tire.
    file: PathBuf,
    /// A second one, to compare.
    other: Option<PathBuf>,
    /// The folder of the page [default: target/tires].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// The axes that the first file was fitted in: it is converted to ISO-W.
    #[arg(long, value_enum, default_value = "iso")]
    axes: AxesArg,
    /// Writes the first tire anew, with all keys, in SI units and ISO-W axes.
    #[arg(long, value_name = "NEW.tir")]
    write: Option<PathBuf>,
}

/// The axes of a file.
#[derive(Clone, Copy, ValueEnum)]
enum AxesArg {
    /// ISO-W (TYDEX): a slip angle above 0 gives a lateral force below 0.
    Iso,
    /// SAE, as test benches write it.
    Sae,
    /// Adapted SAE of Pacejka's book: a slip angle above 0 gives a lateral force above 0.
    AdaptedSae,
}

impl From<AxesArg> for TireAxes {
    fn from(word: AxesArg) -> Self {
        match word {
            AxesArg::Iso => TireAxes::Iso,
            AxesArg::Sae => TireAxes::Sae,
            AxesArg::AdaptedSae => TireAxes::AdaptedSae,
        }
    }
}

/// Prints the key figures, and writes the page and the new file.
///
/// # Errors
/// When a file cannot be read or is no tire, or something cannot be written.
pub fn run_tire_command(arguments: &TireArguments) -> Result<u8, Error> {
    if let Some(new) = &arguments.write {
        let canonical = |path: &PathBuf| path.canonicalize().ok();
        let is_read = |path: &PathBuf| canonical(path).is_some_and(|it| Some(it) == canonical(new));
        if is_read(&arguments.file) || arguments.other.as_ref().is_some_and(is_read) {
            let message = format!(
                "--write: expected another file than those that are read, found {}: its comments and its axes would be lost",
                new.display()
            );
            return Err(Error::invalid_input(message));
        }
    }
    let first = read_tire_file(&arguments.file, arguments.axes.into())?;
    let second = arguments.other.as_ref().map(|path| read_tire_file(path, TireAxes::Iso)).transpose()?;
    print_text(&key_figure_table(&first, second.as_ref()));
    let folder = arguments.out.clone().unwrap_or_else(|| PathBuf::from("target/tires"));
    std::fs::create_dir_all(&folder).map_err(|error| Error::output_failure(&folder, error))?;
    let page = folder.join(format!("{}.html", file_stem(&arguments.file)));
    nofollow::write_without_following_links(&page, tire_report::tire_page(&first, second.as_ref()))
        .map_err(|error| Error::output_failure(&page, error))?;
    print_text(&format!("  {}\n", page.display()));
    if let Some(new) = &arguments.write {
        let about = format!("Written from {} by Trackside.", arguments.file.display());
        let text = tire_file::write_tir_text(first.tire.coefficients(), &[about]);
        nofollow::write_without_following_links(new, text)
            .map_err(|error| Error::output_failure(new, error))?;
        print_text(&format!("  {}\n", new.display()));
    }
    Ok(0)
}

fn file_stem(path: &Path) -> String {
    path.file_stem().map_or_else(|| "tire".to_owned(), |it| it.to_string_lossy().into_owned())
}

/// The tire of a file, which is told about.
fn read_tire_file(path: &Path, axes: TireAxes) -> Result<NamedTire, Error> {
    let name = escape_for_terminal(&path.display().to_string()).into_owned();
    let bytes = read_bounded(path, LARGEST)
        .map_err(|error| Error::invalid_input(format!("the tire {name} cannot be read: {error}")))?;
    let read = tire_file::read_bytes(&bytes, &name);
    let (coefficients, messages) = read.map_err(|error| {
        Error::invalid_input(format!("{name} is no tire\n{}", escape_for_terminal(&error.to_string())))
    })?;
    let coefficients = coefficients.between_iso_and(axes);
    let tire = MfTire::new(coefficients).map_err(|bad| Error::invalid_input(format!("{name}: {bad}")))?;
    let applies = |message: &TireFileMessage| axes == TireAxes::Iso || !message.text.contains("--axes");
    let first = tire_file::check_plausibility(&tire);
    let mut printed = Vec::new();
    for message in std::iter::once(first).chain(messages).filter(applies) {
        let (level, mark) = match message.level {
            TireMessageLevel::Note => ("note", ""),
            TireMessageLevel::Warning => ("warning", "warning: "),
        };
        print_to_stderr(&format!("{level}: {name}: {}", escape_for_terminal(&message.to_string())));
        printed.push(format!("{mark}{message}"));
    }
    Ok(NamedTire { name, tire, messages: printed })
}

/// The key figures, one in a line.
fn key_figure_table(first: &NamedTire, second: Option<&NamedTire>) -> String {
    let columns: Vec<_> =
        std::iter::once(first).chain(second).map(|named| (&named.name, key_figures(&named.tire))).collect();
    let mut text = format!("{}, {}\n", first.name, first.tire.coefficients().version);
    if let Some(second) = second {
        text += &format!("{}, {}\n", second.name, second.tire.coefficients().version);
    }
    for (row, figure) in columns[0].1.iter().enumerate() {
        let values =
            columns.iter().map(|(_, column)| format!("{:>12}", format_four_digits(column[row].value)));
        let values: String = values.collect();
        text += &format!("  {:<42}{values} {}\n", figure.name, figure.unit);
    }
    text
}
