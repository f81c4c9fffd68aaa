//! Makes an .fmu archive of a built library, with the description that the library itself gives.

use std::ffi::c_void;
use std::io::{Cursor, Write as _};
use std::path::{Path, PathBuf};

use zip::write::SimpleFileOptions;

use crate::memory;

/// Name of the function by which a library describes itself; [`crate::export!`] makes it.
pub const DESCRIBE: &str = "fmu_export_describe";

/// Hands over a model's name (`what` 0), its `modelDescription.xml` (1) and its mistakes (2).
pub type Describe = unsafe extern "C" fn(context: *mut c_void, take: TakeText);
/// Takes a text of a library, UTF-8, valid during the call.
pub type TakeText =
    unsafe extern "C" fn(context: *mut c_void, what: u32, text: *const u8, length: usize);

/// The folder of this platform's library inside an archive.
pub const PLATFORM: &str = if cfg!(all(target_os = "linux", target_pointer_width = "64")) {
    "linux64"
} else if cfg!(target_os = "linux") {
    "linux32"
} else if cfg!(all(target_os = "windows", target_pointer_width = "64")) {
    "win64"
} else if cfg!(target_os = "windows") {
    "win32"
} else {
    "darwin64"
};

/// Failure to pack a library.
#[derive(Debug, thiserror::Error)]
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
struct Description {
    name: String,
    xml: String,
    problems: String,
}

/// # Safety
/// `context` is null or points to a [`Description`], and `text` to `length` bytes.
unsafe extern "C" fn take(context: *mut c_void, what: u32, text: *const u8, length: usize) {
    // SAFETY: `describe` hands over a description, and the library a text, as this function demands.
    let (description, text) =
        unsafe { (context.cast::<Description>().as_mut(), memory::read(text, length)) };
    let (Some(description), Ok(text)) = (description, text) else { return };
    let text = String::from_utf8_lossy(text).into_owned();
    match what {
        0 => description.name = text,
        1 => description.xml = text,
        _ => description.problems = text,
    }
}

fn describe(library: &Path) -> Result<Description, PackError> {
    let error = |source| PackError::Library { path: library.to_owned(), source };
    let mut description = Description::default();
    // SAFETY: the function is made by `export!`, with the type that is given here.
    unsafe {
        let loaded = libloading::Library::new(library).map_err(error)?;
        let describe = loaded.get::<Describe>(DESCRIBE).map_err(error)?;
        describe((&raw mut description).cast(), take);
        // The model has run: threads that it started may still be in the code of the library.
        std::mem::forget(loaded);
    }
    let path = library.to_owned();
    if !description.problems.is_empty() {
        return Err(PackError::Table { path, problems: description.problems });
    }
    if description.name.is_empty() || description.xml.is_empty() {
        return Err(PackError::Description { path });
    }
    Ok(description)
}

/// Packs the built `library` as `<model name>.fmu` into the folder `into`, and returns the archive's path.
///
/// The same library gives the same bytes. The archive appears under its name when it is complete; one
/// with the same content is left alone.
///
/// # Errors
/// When the library is not made with this crate, or a file cannot be read or written.
pub fn pack(library: &Path, into: &Path) -> Result<PathBuf, PackError> {
    let file = |path: &Path| {
        let path = path.to_owned();
        move |source| PackError::File { path, source }
    };
    let Description { name, xml, .. } = describe(library)?;
    let binary = std::fs::read(library).map_err(file(library))?;
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().last_modified_time(zip::DateTime::default());
    archive.start_file("modelDescription.xml", options)?;
    archive.write_all(xml.as_bytes()).map_err(file(into))?;
    let extension = std::env::consts::DLL_EXTENSION;
    let entry = format!("binaries/{PLATFORM}/{name}.{extension}");
    archive.start_file(entry, options.unix_permissions(0o755))?;
    archive.write_all(&binary).map_err(file(into))?;
    let bytes = archive.finish()?.into_inner();

    let path = into.join(format!("{name}.fmu"));
    if std::fs::read(&path).is_ok_and(|old| old == bytes) {
        return Ok(path);
    }
    std::fs::create_dir_all(into).map_err(file(into))?;
    // Another process may pack the same archive at the same time: each writes its own file, and
    // the last one to rename wins.
    let partial = into.join(format!(".{name}.fmu.{}", std::process::id()));
    std::fs::write(&partial, bytes).map_err(file(&partial))?;
    std::fs::rename(&partial, &path).map_err(file(&path))?;
    Ok(path)
}

#[cfg(test)]
#[allow(unsafe_code, reason = "a library hands over what it wants")]
mod tests {
    use std::ptr;

    use super::*;

    #[test]
    fn texts_of_a_library_may_be_null_empty_or_broken() {
        let mut found = Description::default();
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
