//! Makes an .fmu archive of a built library, with the description that the library itself gives.

mod platform;

use std::ffi::c_void;
use std::io::{Cursor, Write as _};
use std::path::{Path, PathBuf};

use zip::write::SimpleFileOptions;

use crate::memory;
pub use crate::table::is_identifier;
pub use platform::{Platform, PlatformLibrary};

/// Name of the function by which a library describes itself; [`crate::export!`] makes it.
pub const DESCRIBE: &str = "fmu_export_describe";

/// The file of the terminals inside an archive.
const TERMINALS: &str = "terminalsAndIcons/terminalsAndIcons.xml";

/// Hands over a model's name (`what` 0), its `modelDescription.xml` of FMI 2.0 (1), its mistakes (2), its description of FMI 3.0
/// (3), and its terminals, if it has any (4).
pub type DescribeFn = unsafe extern "C" fn(context: *mut c_void, take: TextCallback);
/// Takes a text of a library, UTF-8, valid during the call.
pub type TextCallback = unsafe extern "C" fn(context: *mut c_void, what: u32, text: *const u8, length: usize);

/// The version of FMI of an archive. The library in it has the functions of both.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FmiVersion {
    /// 2.0.
    Two,
    /// 3.0.
    Three,
}

impl FmiVersion {
    /// The end of the name of an archive.
    #[must_use]
    pub const fn archive_suffix(self) -> &'static str {
        match self {
            FmiVersion::Two => ".fmu",
            FmiVersion::Three => "_fmi3.fmu",
        }
    }
}

/// Failure to pack a library.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PackError {
    /// The library does not load or is no FMU of ours.
    #[error("{path}: not a library made with fmu-export: {source}")]
    Library {
        /// The library.
        path: PathBuf,
        /// The loader's message.
        source: libloading::Error,
    },
    /// The library gives no description.
    #[error("{path}: the library does not describe itself")]
    Description {
        /// The library.
        path: PathBuf,
    },
    /// The table of variables is wrong.
    #[error("{path}: {problems}")]
    Table {
        /// The library.
        path: PathBuf,
        /// Its mistakes.
        problems: String,
    },
    /// A file could not be read or written.
    #[error("{path}: {source}")]
    File {
        /// The file.
        path: PathBuf,
        /// The system's message.
        source: std::io::Error,
    },
    /// The archive could not be made.
    #[error("cannot make the archive: {0}")]
    Zip(#[from] zip::result::ZipError),
}

#[derive(Default)]
struct LibraryTexts {
    name: String,
    xml: String,
    xml3: String,
    problems: String,
    terminals: String,
}

/// # Safety
/// `context` is null or points to a [`LibraryTexts`], and `text` to `length` bytes.
unsafe extern "C" fn take(context: *mut c_void, what: u32, text: *const u8, length: usize) {
    // SAFETY: `describe` hands over a description, and the library a text, as this function demands.
    let (description, text) =
        unsafe { (context.cast::<LibraryTexts>().as_mut(), memory::read_array(text, length)) };
    let (Some(description), Ok(text)) = (description, text) else { return };
    let text = String::from_utf8_lossy(text).into_owned();
    match what {
        0 => description.name = text,
        1 => description.xml = text,
        2 => description.problems = text,
        3 => description.xml3 = text,
        4 => description.terminals = text,
        // A later version of this crate may have more to say.
        _ => {}
    }
}

fn read_library_texts(library: &Path) -> Result<LibraryTexts, PackError> {
    let error = |source| PackError::Library { path: library.to_owned(), source };
    let mut description = LibraryTexts::default();
    // SAFETY: the function is made by `export!`, with the type that is given here.
    unsafe {
        let loaded = libloading::Library::new(library).map_err(error)?;
        let describe = loaded.get::<DescribeFn>(DESCRIBE).map_err(error)?;
        describe((&raw mut description).cast(), take);
        // The model has run: threads that it started may still be in the code of the library.
        std::mem::forget(loaded);
    }
    let path = library.to_owned();
    if !description.problems.is_empty() {
        return Err(PackError::Table { path, problems: description.problems });
    }
    if [&description.name, &description.xml, &description.xml3].iter().any(|text| text.is_empty()) {
        return Err(PackError::Description { path });
    }
    Ok(description)
}

/// Packs the built `library` and those of the same model for `others` into the folder `into`, as `<model name>.fmu` for FMI 2.0 and as
/// `<model name>_fmi3.fmu` for FMI 3.0, and returns the archive's path. `library`, which is one for this machine, describes the model.
///
/// The same libraries give the same bytes. The archive appears under its name when it is complete; one
/// with the same content is left alone.
///
/// # Errors
/// When the library is not made with this crate, or a file cannot be read or written.
pub fn pack_fmu(
    library: &Path,
    others: &[PlatformLibrary],
    into: &Path,
    version: FmiVersion,
) -> Result<PathBuf, PackError> {
    let LibraryTexts { name, xml, xml3, terminals, .. } = read_library_texts(library)?;
    let (xml, files) = match version {
        FmiVersion::Two => (xml, Vec::new()),
        FmiVersion::Three if terminals.is_empty() => (xml3, Vec::new()),
        FmiVersion::Three => (xml3, vec![(TERMINALS.to_owned(), terminals.into_bytes())]),
    };
    let path = into.join(format!("{name}{}", version.archive_suffix()));
    let own = PlatformLibrary { platform: Platform::of_this_program(), path: library.to_owned() };
    let libraries = [&[own], others].concat();
    write_fmu_archive(&path, &name, version, &xml, &libraries, &files)?;
    Ok(path)
}

/// Writes the archive at `path`: a description of this version, each library under the model's name, and other files by their paths.
///
/// The same content gives the same bytes. The archive appears under its name when it is complete; one with the same content is left
/// alone.
///
/// # Errors
/// When a file cannot be read or written.
pub fn write_fmu_archive(
    path: &Path,
    name: &str,
    version: FmiVersion,
    xml: &str,
    libraries: &[PlatformLibrary],
    files: &[(String, Vec<u8>)],
) -> Result<(), PackError> {
    let file = |path: &Path| {
        let path = path.to_owned();
        move |source| PackError::File { path, source }
    };
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().last_modified_time(zip::DateTime::default());
    archive.start_file("modelDescription.xml", options)?;
    archive.write_all(xml.as_bytes()).map_err(file(path))?;
    for PlatformLibrary { platform, path: library } in libraries {
        let binary = std::fs::read(library).map_err(file(library))?;
        let (folder, extension) = (platform.archive_folder(version), platform.library_extension());
        archive.start_file(format!("{folder}/{name}.{extension}"), options.unix_permissions(0o755))?;
        archive.write_all(&binary).map_err(file(path))?;
    }
    for (name, bytes) in files {
        archive.start_file(name.as_str(), options)?;
        archive.write_all(bytes).map_err(file(path))?;
    }
    let bytes = archive.finish()?.into_inner();

    if std::fs::read(path).is_ok_and(|old| old == bytes) {
        return Ok(());
    }
    let into = path.parent().unwrap_or(Path::new("."));
    std::fs::create_dir_all(into).map_err(file(into))?;
    // Another process may pack the same archive at the same time: each writes its own file, and
    // the last one to rename wins.
    let shown = path.file_name().unwrap_or_default().to_string_lossy();
    let partial = into.join(format!(".{shown}.{}", std::process::id()));
    std::fs::write(&partial, bytes).map_err(file(&partial))?;
    std::fs::rename(&partial, path).map_err(file(path))
}

#[cfg(test)]
#[allow(unsafe_code, reason = "a library hands over what it wants")]
mod tests {
    use std::ptr;

    use super::*;

    #[test]
    fn texts_of_a_library_may_be_null_empty_or_broken() {
        let mut found = LibraryTexts::default();
        let context = (&raw mut found).cast();
        unsafe {
            take(context, 0, ptr::null(), 0);
            take(context, 1, ptr::null(), 5);
            take(ptr::null_mut(), 1, b"x".as_ptr(), 1);
            take(context, 2, b"a\xff".as_ptr(), 2);
        }
        assert_eq!((found.name.as_str(), found.xml.as_str()), ("", ""));
        assert_eq!(found.problems, "a\u{fffd}");
    }
}
