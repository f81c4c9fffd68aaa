//! Finds the folder of the resources of an FMU.

use std::path::PathBuf;

/// The folder of the resources behind the place that an importer gives: a path, or a URI (RFC 8089). None of what is neither.
#[must_use]
pub fn resources_folder(place: &str) -> Option<PathBuf> {
    let Some(rest) = place.strip_prefix("file:") else {
        return (!place.is_empty()).then(|| PathBuf::from(place));
    };
    // `file:///path`, `file://localhost/path` and `file:/path` are all in use.
    let path = match rest.strip_prefix("//") {
        Some(rest) => &rest[rest.find('/')?..],
        None => rest,
    };
    let mut bytes = Vec::with_capacity(path.len());
    let mut rest = path.bytes();
    while let Some(byte) = rest.next() {
        bytes.push(match byte {
            b'%' => {
                let digits = [rest.next()?, rest.next()?];
                u8::from_str_radix(std::str::from_utf8(&digits).ok()?, 16).ok()?
            }
            byte => byte,
        });
    }
    // In `file:///C:/path` the drive follows a slash.
    let path = String::from_utf8(bytes).ok()?;
    let drive = path.as_bytes().get(2) == Some(&b':');
    Some(PathBuf::from(if drive { &path[1..] } else { &path }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn resources_are_found_by_path_and_by_any_uri() {
        for (place, found) in [
            ("/tmp/a b/resources/", "/tmp/a b/resources/"),
            ("file:///tmp/a%20b/resources", "/tmp/a b/resources"),
            ("file://localhost/tmp/%C3%A4", "/tmp/ä"),
            ("file:/tmp/x", "/tmp/x"),
            ("file:///C:/tmp", "C:/tmp"),
        ] {
            assert_eq!(resources_folder(place), Some(PathBuf::from(found)), "{place}");
        }
        for wrong in ["", "file://", "file:///tmp/%zz", "file:///tmp/%4"] {
            assert_eq!(resources_folder(wrong), None, "{wrong}");
        }
    }
}
