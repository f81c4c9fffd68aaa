//! Unpacks an archive, and refuses one that would do harm.

use std::fs::File;
use std::io::{self, Read as _};
use std::path::Path;

use zip::CompressionMethod;
use zip::result::ZipError;

use crate::Error;
use crate::duplicates::check_names;
use crate::folder::temporary_write_error;
use crate::links::ArchiveLinks;

/// Memory that an entry may need to be unpacked [bytes]: that of the strongest setting of common tools, four times.
const DICTIONARY: u32 = 256 << 20;

/// What a path of a link may have [bytes], as in Linux.
const LONGEST_LINK: u64 = 4096;

/// The kinds of files in a mode of Unix (inode(7)).
const KIND: u32 = 0o170_000;
const FILE: u32 = 0o100_000;

/// Unpacks the bytes of the archive `path`, which is of a kind such as `.fmu`, into a folder; `left` is how many bytes may still be
/// unpacked. Files keep their permissions, which never raise those of the user, and links inside the archive are made. Returns what
/// there is to tell about the archive.
///
/// # Errors
/// When it is no archive, or one that would do harm, and when the folder cannot be written to.
pub fn unpack_archive(
    path: &Path,
    kind: &'static str,
    bytes: &[u8],
    into: &Path,
    left: &mut u64,
) -> Result<Vec<String>, Error> {
    let broken = |source| Error::Zip { path: path.to_owned(), kind, source };
    let failed = |source| Error::Read { path: path.to_owned(), source: temporary_write_error(into, source) };
    let mut archive = zip::ZipArchive::new(io::Cursor::new(bytes)).map_err(broken)?;
    check_names(path, bytes, archive.len())?;
    // An archive that says so itself is refused before the disk is filled.
    if archive.decompressed_size().is_some_and(|size| size > u128::from(*left)) {
        return Err(Error::TooLarge { path: path.to_owned() });
    }
    let (mut links, mut windows) = (ArchiveLinks::default(), false);
    for index in 0..archive.len() {
        let raw = archive.by_index_raw(index).map_err(broken)?;
        let name = String::from_utf8_lossy(raw.name_raw()).into_owned();
        let unfit = |what| Error::Entry { path: path.to_owned(), entry: name.clone(), what };
        check_readable(raw).map_err(unfit)?;
        let mut entry = archive.by_index(index).map_err(|error| open_error(error, broken, unfit))?;
        let Some(inside) = entry.enclosed_name() else {
            return Err(Error::Escapes { path: path.to_owned(), entry: name });
        };
        windows |= name.contains('\\');
        let target = into.join(&inside);
        if entry.is_dir() {
            std::fs::create_dir_all(&target).map_err(failed)?;
            links.note_entry(&inside);
            continue;
        }
        if entry.is_symlink() {
            let mut text = String::new();
            let length = entry.take(LONGEST_LINK + 1).read_to_string(&mut text);
            let length = length.map_err(|error| unfit(format!("cannot be read: {error}")))? as u64;
            if length > LONGEST_LINK {
                return Err(unfit("is a link with a path that is too long".to_owned()));
            }
            *left = left.checked_sub(length).ok_or_else(|| Error::TooLarge { path: path.to_owned() })?;
            links.add_link(name, inside, text);
            continue;
        }
        let mode = entry.unix_mode().unwrap_or(FILE);
        if !matches!(mode & KIND, 0 | FILE) {
            return Err(unfit("is no file, folder or link".to_owned()));
        }
        if let Some(parent) = target.parent() {
            std::fs::create_dir_all(parent).map_err(failed)?;
        }
        let mut file = File::create(&target).map_err(failed)?;
        // What the entry claims about its size is not believed: one byte over the limit is enough.
        let written = copy_entry(&mut entry.by_ref().take(*left + 1), &mut file).map_err(failed)?;
        let written = written.map_err(|error| unfit(format!("cannot be read: {error}")))?;
        *left = left.checked_sub(written).ok_or_else(|| Error::TooLarge { path: path.to_owned() })?;
        set_permissions(&file, mode).map_err(failed)?;
        links.note_entry(&inside);
    }
    links.create_links(path, into)?;
    let note = "the names of its entries have `\\` where the standard has `/`";
    Ok(windows.then(|| note.to_owned()).into_iter().collect())
}

/// Why an entry cannot be read that is raw yet, if so.
fn check_readable<R: io::Read>(mut raw: zip::read::ZipFile<'_, R>) -> Result<(), String> {
    if raw.encrypted() {
        return Err("is encrypted: pack the archive without a password".to_owned());
    }
    match raw.compression() {
        CompressionMethod::Stored
        | CompressionMethod::Deflated
        | CompressionMethod::Deflate64
        | CompressionMethod::Bzip2
        | CompressionMethod::Zstd => Ok(()),
        CompressionMethod::Lzma => {
            // Version and length of the properties, one of them, the dictionary (APPNOTE.TXT of PKWARE, section 5.8.8).
            let mut head = [0; 9];
            let read = raw.read_exact(&mut head);
            let size = u32::from_le_bytes([head[5], head[6], head[7], head[8]]);
            if read.is_ok() && size > DICTIONARY {
                return Err(format!(
                    "needs {size} bytes of memory to be unpacked, which is more than {DICTIONARY}"
                ));
            }
            Ok(())
        }
        other => Err(format!(
            "has the compression method {other}, which is not read here: pack the archive with deflate, as the standard says"
        )),
    }
}

/// The error of an entry that cannot be opened.
fn open_error(error: ZipError, broken: impl Fn(ZipError) -> Error, unfit: impl Fn(String) -> Error) -> Error {
    match error {
        ZipError::UnsupportedArchive(_) | ZipError::CompressionMethodNotSupported(_) => {
            unfit(format!("cannot be read: {error}"))
        }
        error => broken(error),
    }
}

/// Copies an entry to a file: how many bytes, or the error of the entry; or else that of the file.
fn copy_entry(entry: &mut impl io::Read, file: &mut impl io::Write) -> io::Result<io::Result<u64>> {
    let (mut block, mut written) = (vec![0; 1 << 16], 0);
    loop {
        let length = match entry.read(&mut block) {
            Ok(0) => return Ok(Ok(written)),
            Ok(length) => length,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Err(error) => return Ok(Err(error)),
        };
        file.write_all(&block[..length])?;
        written += length as u64;
    }
}

/// Gives a file the permissions of the archive. Its owner can read and write it in any case.
#[cfg(unix)]
fn set_permissions(file: &File, mode: u32) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt as _;
    file.set_permissions(std::fs::Permissions::from_mode(mode & 0o777 | 0o600))
}

#[cfg(not(unix))]
fn set_permissions(_: &File, _: u32) -> io::Result<()> {
    Ok(())
}

/// Whether the file begins as archives do.
///
/// # Errors
/// When it cannot be read.
pub fn is_archive(path: &Path) -> io::Result<bool> {
    let mut start = Vec::new();
    File::open(path)?.take(4).read_to_end(&mut start)?;
    Ok(start.starts_with(b"PK\x03\x04") || start.starts_with(b"PK\x05\x06"))
}
