//! Digests of what the results of a sweep depend on: the files of its plan, and the program.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use diagnostics::Error;

use super::file_names::{PLAN, VARIANTS};
use super::plan_metadata::PlanMetadata;

/// SHA-256 of a file.
///
/// # Errors
/// When it cannot be read.
pub(super) fn file_sha256(path: &Path) -> Result<String, Error> {
    let bytes = std::fs::read(path)
        .map_err(|error| Error::invalid_input(format!("cannot read {}: {error}", path.display())))?;
    Ok(fmu_import::sha256_hex(&bytes))
}

/// SHA-256 of this program, which is read once.
///
/// # Errors
/// When it cannot be read.
pub(super) fn program_sha256(path: &Path) -> Result<String, Error> {
    static DIGEST: OnceLock<String> = OnceLock::new();
    if let Some(digest) = DIGEST.get() {
        return Ok(digest.clone());
    }
    file_sha256(path).map(|digest| DIGEST.get_or_init(|| digest).clone())
}

/// One digest of the files of a gathered scenario with their names, of the values, and of all that `plan.json` says but for the digest
/// itself and the program.
pub(super) fn plan_digest(bundle: &Path, variants: &Path, metadata: &PlanMetadata) -> Result<String, Error> {
    let mut files = Vec::new();
    list_files_recursively(bundle, &mut files)?;
    files.sort();
    files.push(variants.to_owned());
    let metadata = PlanMetadata { digest: String::new(), program: String::new(), ..metadata.clone() };
    let text = serde_json::to_string(&metadata);
    let mut all = text.map_err(|error| Error::invalid_input(format!("{PLAN}: {error}")))? + "\n";
    for file in files {
        let name = file.strip_prefix(bundle).unwrap_or(Path::new(VARIANTS));
        all += &format!("{} {}\n", name.display(), file_sha256(&file)?);
    }
    Ok(fmu_import::sha256_hex(all.as_bytes()))
}

fn list_files_recursively(folder: &Path, files: &mut Vec<PathBuf>) -> Result<(), Error> {
    let wrong =
        |error: std::io::Error| Error::invalid_input(format!("cannot read {}: {error}", folder.display()));
    for entry in std::fs::read_dir(folder).map_err(wrong)? {
        let path = entry.map_err(wrong)?.path();
        if path.is_dir() { list_files_recursively(&path, files)? } else { files.push(path) }
    }
    Ok(())
}
