//! Unpacks archives with links, permissions and methods of all kinds.

use std::io::{Cursor, Write as _};
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;

use tempfile::TempDir;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use super::*;

fn unpacked(bytes: &[u8]) -> (TempDir, Result<Vec<String>, Error>) {
    let folder = TempDir::new().expect("a folder");
    let found = unpack_archive(Path::new("x.fmu"), ".fmu", bytes, folder.path(), &mut 10_000);
    (folder, found)
}

fn packed(fill: impl FnOnce(&mut ZipWriter<Cursor<Vec<u8>>>)) -> Vec<u8> {
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    fill(&mut writer);
    writer.finish().expect("an archive").into_inner()
}

fn file(writer: &mut ZipWriter<Cursor<Vec<u8>>>, name: &str, options: SimpleFileOptions) {
    writer.start_file(name, options).expect("an entry");
    writer.write_all(b"contents").expect("an entry");
}

#[test]
fn files_keep_their_permissions_and_no_others() {
    let options = SimpleFileOptions::default();
    let bytes = packed(|writer| {
        for (name, mode) in [("tool", 0o755), ("text", 0o644), ("shut", 0), ("raised", 0o6755)] {
            file(writer, name, options.unix_permissions(mode));
        }
    });
    let (folder, found) = unpacked(&bytes);
    found.expect("an archive");
    let mode = |name| {
        let about = std::fs::metadata(folder.path().join(name)).expect("a file");
        about.permissions().mode() & 0o7777
    };
    assert_eq!(["tool", "text", "shut", "raised"].map(mode), [0o755, 0o644, 0o600, 0o755]);
}

#[test]
fn links_are_made_that_stay_inside() {
    let options = SimpleFileOptions::default();
    let link = |links: &[(&str, &str)]| {
        unpacked(&packed(|writer| {
            file(writer, "a/b/file", options);
            for (name, target) in links {
                writer.add_symlink(*name, *target, options).expect("a link");
            }
        }))
    };
    let (folder, found) = link(&[("c", "a/./b"), ("d/e", "../c/file"), ("dangling", "nothing")]);
    found.expect("an archive");
    assert_eq!(std::fs::read(folder.path().join("d/e")).expect("a file"), b"contents");
    for links in [
        &[("c", "/etc")][..],
        &[("c", "..")],
        &[("a/c", "../../x")],
        &[("c", "a/b"), ("d", "c/../../..")],
        &[("c", "d"), ("d", "c")],
        &[("A", "x")],
        &[("c", "..\\x")],
        &[("c", "C:/x")],
        &[("c", "a"), ("c/d", "x")],
    ] {
        let (folder, found) = link(links);
        assert!(matches!(found, Err(Error::Link { .. })), "{links:?}: {found:?}");
        assert!(std::fs::symlink_metadata(folder.path().join("c")).is_err(), "{links:?}");
    }
}

#[test]
fn a_file_is_not_written_through_a_link() {
    let options = SimpleFileOptions::default();
    let bytes = packed(|writer| {
        writer.add_symlink("c", "a", options).expect("a link");
        file(writer, "c/file", options);
    });
    assert!(matches!(unpacked(&bytes).1, Err(Error::Link { .. })));
}

#[test]
fn each_method_is_read_or_named() {
    use CompressionMethod as Method;
    for method in [Method::Stored, Method::Deflated, Method::Bzip2, Method::Zstd] {
        let options = SimpleFileOptions::default().compression_method(method);
        let (folder, found) = unpacked(&packed(|writer| file(writer, "f", options)));
        found.expect("an archive");
        assert_eq!(std::fs::read(folder.path().join("f")).expect("a file"), b"contents");
    }
    // The methods PPMd and LZMA, and the flag of encryption, by their places in both headers (APPNOTE.TXT of PKWARE, section 4.3).
    let stored = SimpleFileOptions::default().compression_method(Method::Stored);
    let with = |field: usize, value: u16, contents: &[u8]| {
        let mut bytes = packed(|writer| {
            writer.start_file("f", stored).expect("an entry");
            writer.write_all(contents).expect("an entry");
        });
        let central = bytes.windows(4).position(|it| it == b"PK\x01\x02").expect("a header");
        for header in [4, central + 6] {
            bytes[header + field..header + field + 2].copy_from_slice(&value.to_le_bytes());
        }
        unpacked(&bytes).1.expect_err("an error").to_string()
    };
    let (flags, method) = (2, 4);
    assert!(with(method, 98, b"x").contains("compression method"), "{}", with(method, 98, b"x"));
    assert!(with(flags, 1, b"x").contains("is encrypted"));
    let hungry = b"\x09\x14\x05\x00\x5d\xff\xff\xff\xff";
    assert!(with(method, 14, hungry).contains("bytes of memory"));
}

#[test]
fn a_folder_that_cannot_be_written_to_is_named_with_a_cure() {
    let told = |kind: io::ErrorKind| temporary_write_error(Path::new("/x"), kind.into()).to_string();
    for (kind, cure) in [
        (io::ErrorKind::StorageFull, "make room there"),
        (io::ErrorKind::NotFound, "name a folder that exists"),
        (io::ErrorKind::ReadOnlyFilesystem, "that you may write to"),
    ] {
        let told = told(kind);
        assert!(told.contains("/x") && told.contains("TMPDIR") && told.contains(cure), "{told}");
    }
}
