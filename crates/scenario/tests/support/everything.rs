//! A scenario with all keys that have numbers, and its files.

use std::fs::File;
use std::io::Write as _;
use std::path::Path;

use zip::write::SimpleFileOptions;

pub const TEXT: &str = include_str!("everything.toml");

const RELAY: &str = include_str!("../../../../tests/acceptance/fmu/relay.xml");

/// Files of data by their names.
pub const FILES: [(&str, &str); 3] = [
    ("log.csv", "t,v_x [m/s],w\n0,1,2\n0.5,2,3\n1,4,3\n2,8,1\n"),
    ("track.csv", "x_m,y_m\n0,0\n10,1\n20,0\n"),
    ("golden.csv", "time,s.sine,s.step\n0,0,1\n0.25,0,1\n0.5,0,2\n0.75,0,2\n1,0,2\n"),
];

/// Writes the files into a folder. The FMU has a library that does not work: a plan loads none.
///
/// # Errors
/// When they cannot be written.
pub fn write(folder: &Path) -> zip::result::ZipResult<()> {
    for (name, text) in FILES {
        std::fs::write(folder.join(name), text)?;
    }
    let mut fmu = zip::ZipWriter::new(File::create(folder.join("relay.fmu"))?);
    fmu.start_file("modelDescription.xml", SimpleFileOptions::default())?;
    fmu.write_all(RELAY.as_bytes())?;
    fmu.start_file("binaries/linux64/relay.so", SimpleFileOptions::default())?;
    fmu.write_all(b"no library")?;
    fmu.finish()?;
    Ok(())
}
