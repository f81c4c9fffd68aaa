//! Indexes the channels of a log by their names, and finds the time channel of each clock.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use log_file::{ClockTime, LogChannel, LogClock, LogFile};

use crate::table::title::{self, ParsedTitle};
use crate::table::{ColumnTitle, ReadRequest, TableError};

/// The names of a log.
pub struct ChannelIndex {
    path: PathBuf,
    format: &'static str,
    channels: Vec<LogChannel>,
    clocks: Vec<LogClock>,
    titles: Vec<ParsedTitle>,
    /// The channels of each whole name, each name without its unit, both behind their group, and each name with its number among
    /// those of this name: `Speed #2`.
    by_name: [HashMap<String, Vec<usize>>; 5],
}

impl ChannelIndex {
    pub fn new(path: &Path, log: &LogFile) -> Self {
        let channels = log.channels().to_vec();
        let titles: Vec<ParsedTitle> = channels.iter().map(|it| ParsedTitle::parse(&it.name)).collect();
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

    fn channels_named(&self, name: &str) -> &[usize] {
        self.by_name.iter().find_map(|of| of.get(name)).map_or(&[], Vec::as_slice)
    }

    /// The channel of a name.
    pub fn find_channel(&self, name: &str) -> Result<usize, TableError> {
        match self.channels_named(name) {
            [place] => Ok(*place),
            [] => Err(TableError::missing_column(&self.path, name, self.shortest_unique_names())),
            several => {
                let each = several.iter().map(|it| self.qualified_name(*it)).collect();
                let (path, column) = (self.path.clone(), name.to_owned());
                Err(TableError::Ambiguous { path, column, each })
            }
        }
    }

    /// Its name with the group, or with its number among those of this name.
    fn qualified_name(&self, place: usize) -> String {
        let LogChannel { name, group, .. } = &self.channels[place];
        let grouped = format!("{group}.{name}");
        match self.channels_named(&grouped) {
            [_] if !group.is_empty() => grouped,
            _ => {
                let numbered = self.by_name[4].iter().find(|(_, places)| places[..] == [place]);
                numbered.map_or(grouped, |(name, _)| name.clone())
            }
        }
    }

    /// The shortest name of each channel that tells it from the others.
    fn shortest_unique_names(&self) -> Vec<String> {
        let plain = |(place, title): (usize, &ParsedTitle)| match self.channels_named(&title.plain) {
            [_] => title.plain.clone(),
            _ => self.qualified_name(place),
        };
        self.titles.iter().enumerate().map(plain).collect()
    }

    /// The titles as of the columns of a table.
    pub fn column_titles(&self) -> Vec<ColumnTitle> {
        let title = |(place, name): (usize, String)| {
            let ParsedTitle { text, plain, .. } = self.titles[place].clone();
            ColumnTitle { text, plain, name, unit: self.channel_unit(place) }
        };
        self.shortest_unique_names().into_iter().enumerate().map(title).collect()
    }

    /// Whether each clock has a time of its own.
    pub fn all_clocks_have_times(&self) -> bool {
        self.clocks.iter().all(|it| it.time != ClockTime::Unknown)
    }

    /// The unit of a channel as this program spells it.
    pub fn channel_unit(&self, place: usize) -> Option<String> {
        let of_file = self.channels[place].unit.as_deref();
        if of_file == Some("") {
            return None;
        }
        let ParsedTitle { plain, unit, .. } = &self.titles[place];
        let known = |text: &str| title::parse_title_unit(text, plain).unwrap_or_else(|| text.to_owned());
        of_file.map(known).or_else(|| unit.clone())
    }

    pub fn channel(&self, place: usize) -> &LogChannel {
        &self.channels[place]
    }

    pub fn channel_clock(&self, place: usize) -> usize {
        self.channels[place].clock
    }

    /// The clock of the first channel of a name.
    pub fn clock_by_channel_name(&self, name: &str) -> Option<usize> {
        self.channels_named(name).first().map(|it| self.channel_clock(*it))
    }

    /// The time of a clock: the wanted channel where it is one of this clock, or else its own.
    pub fn clock_time(&self, clock: usize, request: &ReadRequest) -> Result<ClockTime, TableError> {
        let own = self.clocks[clock].time;
        let Some(name) = &request.time else {
            return match own {
                ClockTime::Unknown => Err(self.no_time(clock)),
                own => Ok(own),
            };
        };
        let named = self.channels_named(name);
        let of_clock = |it: &&usize| self.channel_clock(**it) == clock;
        match (named.iter().find(of_clock), own) {
            (Some(place), _) => Ok(ClockTime::Channel(*place)),
            // It is the time of other columns.
            (None, own) if !named.is_empty() && own != ClockTime::Unknown => Ok(own),
            (None, _) if !named.is_empty() => Err(self.no_time(clock)),
            (None, _) => Err(TableError::missing_column(&self.path, name, self.shortest_unique_names())),
        }
    }

    fn no_time(&self, clock: usize) -> TableError {
        let names = self.shortest_unique_names().into_iter().enumerate();
        let present = names.filter(|(place, _)| self.channel_clock(*place) == clock);
        let present = present.map(|(_, name)| name).collect();
        TableError::NoTime { path: self.path.clone(), format: self.format, present }
    }
}
