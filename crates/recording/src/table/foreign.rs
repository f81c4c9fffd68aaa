//! Names files of other formats that are taken for logs, and says what to do with them.

use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom};
use std::path::Path;

/// What a file is, and a remedy.
pub(super) type FormatAndRemedy = (&'static str, &'static str);

/// The first bytes of a file, what it is and what to do.
const MAGICS: [(&[u8], &str, &str); 16] = [
    (b"\xd0\xcf\x11\xe0", "an old Excel workbook or another OLE file", EXPORT),
    (b"\x93NUMPY", "a NumPy array", "save it as CSV with titles, or as Parquet"),
    (b"#ROSBAG V", "a bag of ROS 1", "convert it to MCAP, for example by `rosbags-convert`"),
    (b"SQLite format 3\0", "an SQLite database", "export its table as CSV"),
    (b"TDSm", "a TDMS file of LabVIEW", EXPORT),
    (b"LOGG", "a BLF file of Vector", "export it as MDF 4 with the signals of its database"),
    (b"MLVLG", "an MLG log of TunerStudio", "save it as CSV or MSL"),
    (b"%DataLog%", "a Haltech log, whose titles are in lines of their own", "export it as MoTeC CSV"),
    (b"<?xml", "an XML file", EXPORT),
    (b"%PDF", "a PDF", EXPORT),
    (b"7z\xbc\xaf", "a 7z archive", UNPACK),
    (b"Rar!", "a RAR archive", UNPACK),
    (b"BZh", "packed by bzip2", UNPACK),
    (b"\xfd7zXZ", "packed by xz", UNPACK),
    (b"\x28\xb5\x2f\xfd", "packed by zstd", UNPACK),
    (b"<h", "an AiM log (.xrk)", "export it as CSV in Race Studio"),
];

const EXPORT: &str = "export its data as CSV";
const UNPACK: &str = "unpack it";

/// The end of the name of an entry of a ZIP archive, what such an archive is and what to do.
const ARCHIVES: [(&str, &str, &str); 9] = [
    ("xl/workbook.xml", "an Excel workbook", "export the sheet as CSV"),
    ("xl/workbook.bin", "an Excel workbook", "export the sheet as CSV"),
    ("content.xml", "an OpenDocument file", "export the sheet as CSV"),
    (".npy", "an archive of NumPy arrays (.npz)", "save it as CSV with titles, or as Parquet or MAT"),
    ("session.json", "a RaceChrono session (.rcz)", "export it in RaceChrono as CSV v3 or VBO"),
    ("modelDescription.xml", "an FMU", "give it to `trackside inspect`, or name it in [[fmu]]"),
    ("SystemStructure.ssd", "a system of SSP", "give it the ending .ssp"),
    ("doc.kml", "a KMZ file", "export it as CSV"),
    ("", "a ZIP archive", "unpack it and take the log in it"),
];

/// What a file is that begins with these bytes, if it is none of the known logs.
pub(super) fn detect_foreign_format(path: &Path, head: &[u8]) -> Option<FormatAndRemedy> {
    if head.starts_with(b"PK\x03\x04") {
        let entries = zip_entry_names(path);
        let is = |(end, ..): &&(&str, _, _)| end.is_empty() || entries.iter().any(|it| it.ends_with(end));
        return ARCHIVES.iter().find(is).map(|(_, what, cure)| (*what, *cure));
    }
    let found = MAGICS.iter().find(|(magic, ..)| head.starts_with(magic));
    found.map(|(_, what, cure)| (*what, *cure))
}

/// Whether a file is a ZIP archive with the description of an FMU.
///
/// A file that cannot be read is none.
#[must_use]
pub fn is_fmu(path: &Path) -> bool {
    zip_entry_names(path).iter().any(|it| it.ends_with("modelDescription.xml"))
}

/// The directory of a ZIP archive is looked for in so many bytes at its end.
const DIRECTORY: u64 = 4 << 20;

/// The names of the entries of a ZIP archive, by its directory; none of another file.
fn zip_entry_names(path: &Path) -> Vec<String> {
    let read = || -> std::io::Result<Vec<u8>> {
        let mut file = File::open(path)?;
        let length = file.metadata()?.len();
        file.seek(SeekFrom::Start(length.saturating_sub(DIRECTORY)))?;
        let mut bytes = Vec::new();
        file.take(DIRECTORY).read_to_end(&mut bytes)?;
        Ok(bytes)
    };
    let bytes = read().unwrap_or_default();
    let name = |at: usize| {
        let length = bytes.get(at + 28..at + 30)?;
        let length = usize::from(u16::from_le_bytes([length[0], length[1]]));
        let name = bytes.get(at + 46..at + 46 + length)?;
        Some(String::from_utf8_lossy(name).into_owned())
    };
    let windows = bytes.windows(4).enumerate();
    windows.filter(|(_, it)| *it == b"PK\x01\x02").filter_map(|(at, _)| name(at)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The directory of an archive with one empty entry.
    fn archive(name: &str) -> Vec<u8> {
        let length = u8::try_from(name.len()).expect("a short name");
        let mut bytes = b"PK\x03\x04".to_vec();
        bytes.extend(b"PK\x01\x02");
        bytes.extend([0; 24]);
        bytes.extend([length, 0]);
        bytes.extend([0; 16]);
        bytes.extend(name.as_bytes());
        bytes
    }

    #[test]
    fn archives_are_named_by_what_is_in_them() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("log");
        for (entry, expected) in [
            ("xl/workbook.xml", "an Excel workbook"),
            ("time.npy", "an archive of NumPy arrays (.npz)"),
            ("session.json", "a RaceChrono session (.rcz)"),
            ("car/modelDescription.xml", "an FMU"),
            ("drive.csv", "a ZIP archive"),
        ] {
            std::fs::write(&path, archive(entry)).expect("a file");
            let found = detect_foreign_format(&path, b"PK\x03\x04").map(|(what, _)| what);
            assert_eq!(found, Some(expected));
            assert_eq!(is_fmu(&path), expected == "an FMU");
        }
        assert_eq!(detect_foreign_format(&path, b"t,v\n"), None);
    }
}
