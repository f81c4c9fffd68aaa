//! Indexes the channels of a log by their names, and finds the time channel of each clock.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use log_file::{Channel, Clock, Log, Time};

use crate::table::title::{self, Title};
use crate::table::{ColumnTitle, ReadRequest, TableError};

/// The names of a log.
pub struct ChannelIndex {
    path: PathBuf,
    format: &'static str,
    channels: Vec<Channel>,
    clocks: Vec<Clock>,
    titles: Vec<Title>,
    /// The channels of each whole name, each name without its unit, both behind their group, and each name with its number among
    /// those of this name: `Speed #2`.
    by_name: [HashMap<String, Vec<usize>>; 5],
}

impl ChannelIndex {
    pub fn new(path: &Path, log: &Log) -> Self {
        let channels = log.channels().to_vec();
        let titles: Vec<Title> = channels.iter().map(|it| Title::read(&it.name)).collect();
        let mut by_name: [HashMap<String, Vec<usize>>; 5] = Default::default();
        for (place, (channel, title)) in channels.iter().zip(&titles).enumerate() {
            let behind = |name: &str| format!("{}.{name}", channel.group);
            let names = [title.text.clone(), title.plain.clone()];
            let grouped = [behind(&title.text), behind(&title.plain)];
            let same = titles[..place].iter().filter(|it| it.plain == title.plain).count();
            let numbered = format!("{} #{}", title.plain, same + 1);
            let names = names.into_iter().chain(grouped).chain([numbered]);
            for (of, name) in by_name.iter_mut().zip(names) {
                of.entry(name).or_default().push(place);
            }
        }
        let (path, clocks) = (path.to_owned(), log.clocks().to_vec());
        Self { path, format: log.format, channels, clocks, titles, by_name }
    }

    fn named(&self, name: &str) -> &[usize] {
        self.by_name.iter().find_map(|of| of.get(name)).map_or(&[], Vec::as_slice)
    }

    /// The channel of a name.
    pub fn place(&self, name: &str) -> Result<usize, TableError> {
        match self.named(name) {
            [place] => Ok(*place),
            [] => Err(TableError::missing(&self.path, name, self.names())),
            several => {
                let each = several.iter().map(|it| self.whole_name(*it)).collect();
                let (path, column) = (self.path.clone(), name.to_owned());
                Err(TableError::Ambiguous { path, column, each })
            }
        }
    }

    /// Its name with the group, or with its number among those of this name.
    fn whole_name(&self, place: usize) -> String {
        let Channel { name, group, .. } = &self.channels[place];
        let grouped = format!("{group}.{name}");
        match self.named(&grouped) {
            [_] if !group.is_empty() => grouped,
            _ => {
                let numbered = self.by_name[4].iter().find(|(_, places)| places[..] == [place]);
                numbered.map_or(grouped, |(name, _)| name.clone())
            }
        }
    }

    /// The shortest name of each channel that tells it from the others.
    fn names(&self) -> Vec<String> {
        let plain = |(place, title): (usize, &Title)| match self.named(&title.plain) {
            [_] => title.plain.clone(),
            _ => self.whole_name(place),
        };
        self.titles.iter().enumerate().map(plain).collect()
    }

    /// The titles as of the columns of a table.
    pub fn titles(&self) -> Vec<ColumnTitle> {
        let title = |(place, name): (usize, String)| {
            let Title { text, plain, .. } = self.titles[place].clone();
            ColumnTitle { text, plain, name, unit: self.unit(place) }
        };
        self.names().into_iter().enumerate().map(title).collect()
    }

    /// Whether each clock has a time of its own.
    pub fn has_times(&self) -> bool {
        self.clocks.iter().all(|it| it.time != Time::Unknown)
    }

    /// The unit of a channel as this program spells it.
    pub fn unit(&self, place: usize) -> Option<String> {
        let of_file = self.channels[place].unit.as_deref();
        if of_file == Some("") {
            return None;
        }
        let Title { plain, unit, .. } = &self.titles[place];
        let known = |text: &str| title::unit(text, plain).unwrap_or_else(|| text.to_owned());
        of_file.map(known).or_else(|| unit.clone())
    }

    pub fn channel(&self, place: usize) -> &Channel {
        &self.channels[place]
    }

    pub fn clock(&self, place: usize) -> usize {
        self.channels[place].clock
    }

    /// The clock of the first channel of a name.
    pub fn clock_of(&self, name: &str) -> Option<usize> {
        self.named(name).first().map(|it| self.clock(*it))
    }

    /// The time of a clock: the wanted channel where it is one of this clock, or else its own.
    pub fn time(&self, clock: usize, request: &ReadRequest) -> Result<Time, TableError> {
        let own = self.clocks[clock].time;
        let Some(name) = &request.time else {
            return match own {
                Time::Unknown => Err(self.no_time(clock)),
                own => Ok(own),
            };
        };
        let named = self.named(name);
        let of_clock = |it: &&usize| self.clock(**it) == clock;
        match (named.iter().find(of_clock), own) {
            (Some(place), _) => Ok(Time::Channel(*place)),
            // It is the time of other columns.
            (None, own) if !named.is_empty() && own != Time::Unknown => Ok(own),
            (None, _) if !named.is_empty() => Err(self.no_time(clock)),
            (None, _) => Err(TableError::missing(&self.path, name, self.names())),
        }
    }

    fn no_time(&self, clock: usize) -> TableError {
        let names = self.names().into_iter().enumerate();
        let present = names.filter(|(place, _)| self.clock(*place) == clock);
        let present = present.map(|(_, name)| name).collect();
        TableError::NoTime { path: self.path.clone(), format: self.format, present }
    }
}
