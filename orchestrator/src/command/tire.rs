//! `trackside tire`: key figures and curves of a `.tir` file, of two side by side, and files in other axes.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use diagnostics::{Error, read_bounded, shown};
use tire::{Axes, MfTire};
use tire_file::{Level, Message};
use tire_report::{NamedTire, digits, figures};

use super::{print, tell};
use orchestrator::nofollow;

/// The largest file [B].
const LARGEST: u64 = 16 << 20;

/// Arguments of `trackside tire`.
#[derive(Args)]
pub struct Arguments {
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

impl From<AxesArg> for Axes {
    fn from(word: AxesArg) -> Self {
        match word {
            AxesArg::Iso => Axes::Iso,
            AxesArg::Sae => Axes::Sae,
            AxesArg::AdaptedSae => Axes::AdaptedSae,
        }
    }
}

/// Prints the key figures, and writes the page and the new file.
///
/// # Errors
/// When a file cannot be read or is no tire, or something cannot be written.
pub fn run(arguments: &Arguments) -> Result<u8, Error> {
    if let Some(new) = &arguments.write {
        let canonical = |path: &PathBuf| path.canonicalize().ok();
        let is_read = |path: &PathBuf| canonical(path).is_some_and(|it| Some(it) == canonical(new));
        if is_read(&arguments.file) || arguments.other.as_ref().is_some_and(is_read) {
            let message = format!(
                "--write: expected another file than those that are read, found {}: its comments and its axes would be lost",
                new.display()
            );
            return Err(Error::input(message));
        }
    }
    let first = read(&arguments.file, arguments.axes.into())?;
    let second = arguments.other.as_ref().map(|path| read(path, Axes::Iso)).transpose()?;
    print(&table(&first, second.as_ref()));
    let folder = arguments.out.clone().unwrap_or_else(|| PathBuf::from("target/tires"));
    std::fs::create_dir_all(&folder).map_err(|error| Error::output(&folder, error))?;
    let page = folder.join(format!("{}.html", stem(&arguments.file)));
    nofollow::write(&page, tire_report::page(&first, second.as_ref()))
        .map_err(|error| Error::output(&page, error))?;
    print(&format!("  {}\n", page.display()));
    if let Some(new) = &arguments.write {
        let about = format!("Written from {} by Trackside.", arguments.file.display());
        let text = tire_file::write(first.tire.coefficients(), &[about]);
        nofollow::write(new, text).map_err(|error| Error::output(new, error))?;
        print(&format!("  {}\n", new.display()));
    }
    Ok(0)
}

fn stem(path: &Path) -> String {
    path.file_stem().map_or_else(|| "tire".to_owned(), |it| it.to_string_lossy().into_owned())
}

/// The tire of a file, which is told about.
fn read(path: &Path, axes: Axes) -> Result<NamedTire, Error> {
    let name = shown(&path.display().to_string()).into_owned();
    let bytes = read_bounded(path, LARGEST)
        .map_err(|error| Error::input(format!("the tire {name} cannot be read: {error}")))?;
    let read = tire_file::read_bytes(&bytes, &name);
    let (coefficients, messages) = read.map_err(|error| {
        Error::input(format!("{name} is no tire\n{}", shown(&error.to_string())))
    })?;
    let coefficients = coefficients.between_iso_and(axes);
    let tire = MfTire::new(coefficients).map_err(|bad| Error::input(format!("{name}: {bad}")))?;
    let applies = |message: &Message| axes == Axes::Iso || !message.text.contains("--axes");
    let first = tire_file::plausibility(&tire);
    let mut printed = Vec::new();
    for message in std::iter::once(first).chain(messages).filter(applies) {
        let (level, mark) = match message.level {
            Level::Note => ("note", ""),
            Level::Warning => ("warning", "warning: "),
        };
        tell(&format!("{level}: {name}: {}", shown(&message.to_string())));
        printed.push(format!("{mark}{message}"));
    }
    Ok(NamedTire { name, tire, messages: printed })
}

/// The key figures, one in a line.
fn table(first: &NamedTire, second: Option<&NamedTire>) -> String {
    let columns: Vec<_> = std::iter::once(first)
        .chain(second)
        .map(|named| (&named.name, figures(&named.tire)))
        .collect();
    let mut text = format!("{}, {}\n", first.name, first.tire.coefficients().version);
    if let Some(second) = second {
        text += &format!("{}, {}\n", second.name, second.tire.coefficients().version);
    }
    for (row, figure) in columns[0].1.iter().enumerate() {
        let values = columns.iter().map(|(_, column)| format!("{:>12}", digits(column[row].value)));
        let values: String = values.collect();
        text += &format!("  {:<42}{values} {}\n", figure.name, figure.unit);
    }
    text
}
