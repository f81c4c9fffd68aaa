//! Reads files up to a size limit: a device or a sparse file may have any size.

use std::fs::File;
use std::io::{self, Read as _};
use std::path::Path;

/// The most that is read of a pipe or a device, which do not tell their size [B].
const UNSIZED: u64 = 256 << 20;

/// Reads a whole file of at most `largest` bytes.
///
/// # Errors
/// When it cannot be read, or is larger.
pub fn read_bounded(path: &Path, largest: u64) -> io::Result<Vec<u8>> {
    let about = std::fs::metadata(path)?;
    let (largest, found) = match about.is_file() {
        true => (largest, about.len()),
        false => (largest.min(UNSIZED), 0),
    };
    let refused = |found: String| {
        let text = format!("expected at most {largest} bytes, found {found}");
        Err(io::Error::new(io::ErrorKind::FileTooLarge, text))
    };
    if found > largest {
        return refused(found.to_string());
    }
    let mut bytes = Vec::with_capacity(found as usize);
    File::open(path)?.take(largest + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > largest { refused("more".to_owned()) } else { Ok(bytes) }
}

/// The same of a text.
///
/// # Errors
/// When it cannot be read, is larger, or is no text in UTF-8.
pub fn read_text_bounded(path: &Path, largest: u64) -> io::Result<String> {
    let text = String::from_utf8(read_bounded(path, largest)?);
    text.map_err(|_| io::Error::new(io::ErrorKind::InvalidData, "stream did not contain valid UTF-8"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_too_large_is_not_read() {
        let path = std::env::temp_dir().join(format!("diagnostics-bounded-{}", std::process::id()));
        std::fs::write(&path, "1234").expect("it can be written");
        let error = |largest| read_bounded(&path, largest).expect_err("it is larger").to_string();
        assert_eq!(error(3), "expected at most 3 bytes, found 4");
        assert_eq!(read_text_bounded(&path, 4).expect("it fits"), "1234");
        std::fs::remove_file(&path).expect("it is there");
        let endless = read_bounded(Path::new("/dev/zero"), 1000).expect_err("it is endless");
        assert_eq!(endless.to_string(), "expected at most 1000 bytes, found more");
    }
}
