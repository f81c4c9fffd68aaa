//! Reads channels of ASAM MDF files, over the master channels of their groups.

use std::path::Path;

use mdf_file::{ChannelValueKind as Stored, MasterAxis, MdfFile};

use crate::{ChannelKind, ChunkCallback, ClockTime, Error, LogChannel, LogClock, LogReader};

/// A measurement file.
pub struct MdfLog {
    file: MdfFile,
    channels: Vec<LogChannel>,
    clocks: Vec<LogClock>,
}

impl MdfLog {
    /// Reads what the file describes; values wait until they are wanted.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let file = MdfFile::open(path).map_err(|error| mdf_error(&error))?;
        let channel = |it: &mdf_file::MdfChannel| LogChannel {
            name: it.name.clone(),
            group: it.group.clone(),
            unit: it.unit.clone(),
            clock: it.clock,
            kind: match it.kind {
                Stored::Number | Stored::Integer => ChannelKind::Number,
                Stored::Text => ChannelKind::Text,
            },
        };
        // Rows over an angle or a distance have no time that the file tells.
        let time = |it: &mdf_file::MdfClock| match (it.axis, it.master) {
            (MasterAxis::Time, Some(master)) => ClockTime::Channel(master),
            _ => ClockTime::Unknown,
        };
        let clock = |it: &mdf_file::MdfClock| LogClock { time: time(it), rows: it.rows };
        let channels = file.channels().iter().map(channel).collect();
        let clocks = file.clocks().iter().map(clock).collect();
        Ok(Self { file, channels, clocks })
    }

    /// The name of its format.
    pub fn format_name(&self) -> &'static str {
        match self.file.version() {
            2 => "MDF 2",
            3 => "MDF 3",
            _ => "MDF 4",
        }
    }
}

impl LogReader for MdfLog {
    fn channels(&self) -> &[LogChannel] {
        &self.channels
    }

    fn clocks(&self) -> &[LogClock] {
        &self.clocks
    }

    fn read_chunks(&mut self, clock: usize, wanted: &[usize], take: ChunkCallback) -> Result<(), Error> {
        let visited = self.file.visit_rows(clock, wanted, &mut |stretch| take(stretch));
        visited.map_err(|error| mdf_error(&error))
    }

    fn skipped_contents(&self) -> Vec<String> {
        self.file.warnings().to_vec()
    }

    fn warnings(&self) -> Vec<String> {
        Vec::new()
    }
}

fn mdf_error(error: &mdf_file::Error) -> Error {
    Error::new(error.to_string())
}

#[cfg(test)]
mod tests {
    use mdf_file::{MdfCell, MdfColumn, MdfColumnType, MdfDescription, MdfWriter};

    use crate::{ChannelKind, ChannelValues, ClockTime, LogFile};

    #[test]
    fn channels_have_the_time_of_their_group() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("drive.bin");
        let column = |name: &str, unit: Option<&str>, kind| MdfColumn {
            name: name.into(),
            unit: unit.map(Into::into),
            comment: None,
            kind,
        };
        let columns =
            [column("speed", Some("km/h"), MdfColumnType::Real), column("gear", None, MdfColumnType::Signed)];
        let mut writer = MdfWriter::create(&path, &MdfDescription::default(), &columns).expect("a file");
        for row in 0..3 {
            let speed = MdfCell::Real(36.0 + f64::from(row));
            writer.write_row(0.1 * f64::from(row), &[speed, MdfCell::Signed(row.into())]).expect("a row");
        }
        writer.finish().expect("an end");
        let mut log = LogFile::open(&path).expect("it is read").expect("it is a log");
        assert_eq!(log.format, "MDF 4");
        let place = |log: &LogFile, name: &str| {
            log.channels().iter().position(|it| it.name == name).expect("the channel is there")
        };
        let (speed, gear) = (place(&log, "speed"), place(&log, "gear"));
        assert_eq!(log.channels()[speed].unit.as_deref(), Some("km/h"));
        assert_eq!(log.channels()[speed].kind, ChannelKind::Number);
        let ClockTime::Channel(time) = log.clocks()[log.channels()[speed].clock].time else {
            panic!("{:?}", log.clocks());
        };
        let read = log.read_all_rows(&[time, speed, gear]).expect("the values");
        assert_eq!(read[1], ChannelValues::Numbers(vec![36.0, 37.0, 38.0]));
        assert_eq!((read[0].number_at(1), read[2].number_at(2)), (Some(0.1), Some(2.0)));
    }
}
