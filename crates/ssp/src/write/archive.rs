//! Packs files into an archive whose bytes depend on nothing but them.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};

use archive::TemporaryFolder;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use crate::{Error, SspSystem};

/// What an entry of an archive holds.
#[derive(Debug, Clone)]
pub enum ArchiveEntryContent {
    /// A copy of this file.
    File(PathBuf),
    /// A text.
    Text(String),
}

/// Packs the entries into the archive `path`, which appears under its name when it is complete.
///
/// # Errors
/// When a file cannot be read or written; the path of it is in the text.
pub fn pack_archive(path: &Path, entries: &BTreeMap<String, ArchiveEntryContent>) -> std::io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder)?;
    // Another process may write the same archive: each has a file of its own, and the last one to rename wins.
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let partial = folder.join(format!(".{name}.{}", std::process::id()));
    let done = write_archive(&partial, entries).and_then(|()| std::fs::rename(&partial, path));
    if done.is_err() {
        let _ = std::fs::remove_file(&partial);
    }
    done
}

/// The system of these entries as it will be read, with empty files in place of copies. They are gone when this returns.
///
/// # Errors
/// When the entries make no system, or a file cannot be written.
pub fn read_back(entries: &BTreeMap<String, ArchiveEntryContent>) -> Result<SspSystem, Error> {
    let failed = |path: &Path| {
        let path = path.to_owned();
        move |source| Error::Read { path, source }
    };
    let folder = TemporaryFolder::new().map_err(failed(&std::env::temp_dir()))?;
    for (name, content) in entries {
        let path = folder.folder_path().join(name);
        let parent = path.parent().unwrap_or(folder.folder_path());
        std::fs::create_dir_all(parent).map_err(failed(parent))?;
        let text = match content {
            ArchiveEntryContent::Text(text) => text.as_str(),
            ArchiveEntryContent::File(_) => "",
        };
        std::fs::write(&path, text).map_err(failed(&path))?;
    }
    crate::open_system(folder.folder_path(), None)
}

fn write_archive(path: &Path, entries: &BTreeMap<String, ArchiveEntryContent>) -> std::io::Result<()> {
    let mut archive = ZipWriter::new(BufWriter::new(File::create(path)?));
    for (name, content) in entries {
        // An FMU is packed already.
        let packed = Path::new(name).extension().is_some_and(|ending| ending == "fmu");
        let method = if packed { CompressionMethod::Stored } else { CompressionMethod::Deflated };
        let options = SimpleFileOptions::default()
            .last_modified_time(DateTime::default())
            .unix_permissions(0o644)
            .compression_method(method);
        match content {
            ArchiveEntryContent::Text(text) => {
                archive.start_file(name.as_str(), options)?;
                archive.write_all(text.as_bytes())?;
            }
            ArchiveEntryContent::File(source) => {
                let failed = |error: std::io::Error| {
                    std::io::Error::new(error.kind(), format!("{}: {error}", source.display()))
                };
                let mut file = File::open(source).map_err(failed)?;
                let long = file.metadata().map_err(failed)?.len() > u64::from(u32::MAX / 2);
                archive.start_file(name.as_str(), options.large_file(long))?;
                std::io::copy(&mut file, &mut archive).map_err(failed)?;
            }
        }
    }
    archive.finish()?.flush()
}
