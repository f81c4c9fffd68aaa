//! Reads channels of ASAM MDF files, over the master channels of their groups.

use std::path::Path;

use mdf_file::{Axis, File, Kind as Stored};

use crate::{Channel, ChannelKind, ChunkCallback, Clock, Error, LogReader, Time};

/// A measurement file.
pub struct Mdf {
    file: File,
    channels: Vec<Channel>,
    clocks: Vec<Clock>,
}

impl Mdf {
    /// Reads what the file describes; values wait until they are wanted.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let file = File::open(path).map_err(|error| wrong(&error))?;
        let channel = |it: &mdf_file::Channel| Channel {
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
        let time = |it: &mdf_file::Clock| match (it.axis, it.master) {
            (Axis::Time, Some(master)) => Time::Channel(master),
            _ => Time::Unknown,
        };
        let clock = |it: &mdf_file::Clock| Clock { time: time(it), rows: it.rows };
        let channels = file.channels().iter().map(channel).collect();
        let clocks = file.clocks().iter().map(clock).collect();
        Ok(Self { file, channels, clocks })
    }

    /// The name of its format.
    pub fn format(&self) -> &'static str {
        match self.file.version() {
            2 => "MDF 2",
            3 => "MDF 3",
            _ => "MDF 4",
        }
    }
}

impl LogReader for Mdf {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn clocks(&self) -> &[Clock] {
        &self.clocks
    }

    fn read_chunks(
        &mut self,
        clock: usize,
        wanted: &[usize],
        take: ChunkCallback,
    ) -> Result<(), Error> {
        let visited = self.file.visit(clock, wanted, &mut |stretch| take(stretch));
        visited.map_err(|error| wrong(&error))
    }

    fn left_out(&self) -> Vec<String> {
        self.file.notes().to_vec()
    }

    fn warnings(&self) -> Vec<String> {
        Vec::new()
    }
}

fn wrong(error: &mdf_file::Error) -> Error {
    Error::new(error.to_string())
}

#[cfg(test)]
mod tests {
    use mdf_file::{About, Cell, Column, Type, Writer};

    use crate::{ChannelKind, Log, Time, Values};

    #[test]
    fn channels_have_the_time_of_their_group() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("drive.bin");
        let column = |name: &str, unit: Option<&str>, kind| Column {
            name: name.into(),
            unit: unit.map(Into::into),
            comment: None,
            kind,
        };
        let columns =
            [column("speed", Some("km/h"), Type::Real), column("gear", None, Type::Signed)];
        let mut writer = Writer::create(&path, &About::default(), &columns).expect("a file");
        for row in 0..3 {
            let speed = Cell::Real(36.0 + f64::from(row));
            writer.row(0.1 * f64::from(row), &[speed, Cell::Signed(row.into())]).expect("a row");
        }
        writer.finish().expect("an end");
        let mut log = Log::open(&path).expect("it is read").expect("it is a log");
        assert_eq!(log.format, "MDF 4");
        let place = |log: &Log, name: &str| {
            log.channels().iter().position(|it| it.name == name).expect("the channel is there")
        };
        let (speed, gear) = (place(&log, "speed"), place(&log, "gear"));
        assert_eq!(log.channels()[speed].unit.as_deref(), Some("km/h"));
        assert_eq!(log.channels()[speed].kind, ChannelKind::Number);
        let Time::Channel(time) = log.clocks()[log.channels()[speed].clock].time else {
            panic!("{:?}", log.clocks());
        };
        let read = log.read(&[time, speed, gear]).expect("the values");
        assert_eq!(read[1], Values::Numbers(vec![36.0, 37.0, 38.0]));
        assert_eq!((read[0].number(1), read[2].number(2)), (Some(0.1), Some(2.0)));
    }
}
