//! Opens FMUs whose descriptions are damaged.

use std::collections::BTreeMap;
use std::path::Path;

use fmu_import::{Fmu, Terminal};
use zip::write::SimpleFileOptions;

/// What separates the description from the file of the terminals.
const TERMINALS: &str = "<!-- terminals -->";

/// Opens an FMU with this description, and asks for all that it says.
pub fn attempt(bytes: &[u8], folder: &Path) -> bool {
    let path = folder.join("x.fmu");
    write(&path, bytes).expect("it can be written");
    let Ok(mut fmu) = Fmu::open(&path) else { return false };
    look(&fmu);
    let sizes: BTreeMap<u32, u64> = [(1, 3), (2, 0)].into();
    if fmu.resize_arrays(&sizes).is_ok() {
        look(&fmu);
    }
    true
}

fn look(fmu: &Fmu) {
    for variable in &fmu.description.variables {
        let _ = (variable.start_value(), variable.array_name());
        assert!(variable.element.0 < variable.element.1, "{variable:?}");
        if let Some(unit) = variable.dimension {
            let _ = (unit.dimension_text(), unit.powf(2.0), unit.times_power(unit, -1));
            let base = units::Unit::conversion(&unit, &unit);
            assert!(base.is_none_or(|(a, b)| a.is_finite() && b.is_finite()), "{unit:?}");
        }
    }
    let _ = (fmu.supported_platforms(), fmu.library_origin().is_ok(), fmu.read_archive_entry("../x"));
    if let Ok((terminals, _)) = fmu.terminals() {
        for path in Terminal::terminal_paths(&terminals) {
            assert!(Terminal::find_by_path(&terminals, &path).is_some() || path.contains('.'), "{path}");
        }
    }
}

/// Writes an FMU without a library.
fn write(path: &Path, text: &[u8]) -> zip::result::ZipResult<()> {
    use std::io::Write as _;
    let mut archive = zip::ZipWriter::new(std::fs::File::create(path)?);
    let stored = SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    let mark = TERMINALS.as_bytes();
    let split = text.windows(mark.len()).position(|it| it == mark);
    let (description, terminals) = text.split_at(split.unwrap_or(text.len()));
    archive.start_file("modelDescription.xml", stored)?;
    archive.write_all(description)?;
    if !terminals.is_empty() {
        archive.start_file("terminalsAndIcons/terminalsAndIcons.xml", stored)?;
        archive.write_all(&terminals[mark.len()..])?;
    }
    archive.finish()?;
    Ok(())
}
