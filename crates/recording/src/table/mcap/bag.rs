//! Iterates over the messages of a recording: an MCAP file, the database of a ROS 2 bag, or all files of a bag.

use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use ::mcap::records::MessageHeader;
use ::mcap::{Channel, MAGIC, Schema};
use ros_bag::{BagDatabase, BagFiles};
use tempfile::NamedTempFile;

use super::file::{ChannelsById, McapReader, MessageCallback};
use super::{RecordingError, TableError};
use crate::records::McapStatistics;

/// A recording.
pub struct MessageRecording {
    /// Where it is.
    pub path: PathBuf,
    /// Its format, for people.
    pub format: String,
    /// The channels of all files; those of several files with one topic and one type are one.
    pub channels: ChannelsById,
    /// What is missing in it.
    pub warnings: Vec<String>,
    files: Vec<MessageFile>,
}

/// A file with messages.
struct MessageFile {
    content: MessageStorage,
    /// The channel of the recording for each of the file.
    ids: HashMap<i64, u16>,
    /// The file itself, where it was packed.
    _unpacked: Option<NamedTempFile>,
}

enum MessageStorage {
    Mcap(McapReader),
    Database(BagDatabase),
}

/// What files begin with.
const HEAD: u64 = 16;

fn read_file_head(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut head = Vec::new();
    File::open(path)?.take(HEAD).read_to_end(&mut head)?;
    Ok(head)
}

/// Whether a file begins as a recording does, or a folder can be one. Of a pipe, which can be read once, nobody looks.
pub fn is_message_recording(path: &Path) -> std::io::Result<bool> {
    let about = std::fs::metadata(path)?;
    if ros_bag::bag_folder(path).is_some() {
        return Ok(true);
    }
    if !about.is_file() {
        return Ok(false);
    }
    let head = read_file_head(path)?;
    let name = path.to_string_lossy();
    let packed = [".mcap.zstd", ".db3.zstd"].iter().any(|end| name.ends_with(end));
    Ok(head.starts_with(MAGIC)
        || ros_bag::is_database(&head)
        || ros_bag::is_ros1_bag(&head)
        || packed && ros_bag::is_compressed(&head))
}

impl MessageRecording {
    /// Opens a recording and reads what its channels are.
    ///
    /// # Errors
    /// When a file cannot be read, is damaged, or is no recording.
    pub fn open(path: &Path) -> Result<Self, TableError> {
        let wrong = |error: ros_bag::Error| bag_error(path, error.to_string());
        let files = match ros_bag::bag_folder(path) {
            Some(folder) => ros_bag::find_bag_files(folder).map_err(wrong)?,
            None => BagFiles { files: vec![path.to_owned()], warnings: Vec::new() },
        };
        let mut bag = MessageRecording {
            path: path.to_owned(),
            format: String::new(),
            channels: ChannelsById::new(),
            warnings: files.warnings,
            files: Vec::new(),
        };
        let mut known = HashMap::new();
        for file in &files.files {
            bag.add_file(file, &mut known)?;
        }
        if files.files.len() > 1 || ros_bag::bag_folder(path).is_some() {
            let count = files.files.len();
            bag.format = format!("bag of ROS 2: {count} of {}", bag.format);
        }
        Ok(bag)
    }

    fn add_file(&mut self, path: &Path, known: &mut HashMap<ChannelIdentity, u16>) -> Result<(), TableError> {
        let wrong = |error: ros_bag::Error| bag_error(path, error.to_string());
        let open = |source| TableError::from(RecordingError::Read { path: path.to_owned(), source });
        let mut begin = read_file_head(path).map_err(open)?;
        let mut unpacked = None;
        if ros_bag::is_compressed(&begin) {
            let file = ros_bag::decompress_file(path).map_err(wrong)?;
            begin = read_file_head(file.path()).map_err(open)?;
            unpacked = Some(file);
        }
        let at = unpacked.as_ref().map_or(path, NamedTempFile::path);
        let (content, channels, format) = if begin.starts_with(MAGIC) {
            let mcap = McapReader::open(at)?;
            let channels = mcap.read_channels()?;
            if !mcap.finished {
                let text = "it was not finished: it is read up to the end of its last complete chunk";
                self.warnings.push(format!("{}: {text}", path.display()));
            }
            let channels = channels.into_iter().map(|(id, it)| (i64::from(id), it)).collect();
            (MessageStorage::Mcap(mcap), channels, "MCAP")
        } else if ros_bag::is_database(&begin) {
            let database = BagDatabase::open(at).map_err(wrong)?;
            let channels: Vec<_> = database.topics.iter().map(topic_to_channel).collect();
            (MessageStorage::Database(database), channels, "SQLite (rosbag2)")
        } else if ros_bag::is_ros1_bag(&begin) {
            let cure = "it is a bag of ROS 1, which is not read: `pip install rosbags`, then `rosbags-convert --src OLD.bag --dst NEW` \
                        makes a bag of ROS 2 of it, which is read";
            return Err(bag_error(path, cure.to_owned()));
        } else {
            return Err(bag_error(path, "expected MCAP or a database of rosbag2".to_owned()));
        };
        let mut ids = HashMap::new();
        for (id, channel) in channels {
            let next = self.channels.len();
            let number = *known.entry(ChannelIdentity::new(&channel)).or_insert_with(|| {
                // An MCAP file has at most 65,536 channels, and its numbers stay as they are.
                let number = u16::try_from(id).ok().filter(|id| !self.channels.contains_key(id));
                let number = number.unwrap_or_else(|| free_channel_id(&self.channels, next));
                let channel = Channel { id: number, ..Channel::clone(&channel) };
                self.channels.insert(number, Arc::new(channel));
                number
            });
            ids.insert(id, number);
        }
        self.format = format.to_owned();
        self.files.push(MessageFile { content, ids, _unpacked: unpacked });
        Ok(())
    }

    /// What the writer of a single, finished MCAP file counted.
    ///
    /// # Errors
    /// When its summary is damaged.
    pub fn read_statistics(&self) -> Result<Option<McapStatistics>, TableError> {
        match &self.files[..] {
            [MessageFile { content: MessageStorage::Mcap(mcap), _unpacked: None, .. }] if mcap.finished => {
                Ok(mcap.read_statistics()?)
            }
            _ => Ok(None),
        }
    }

    /// Hands over the messages of some channels, in the order of the files, until `take` says that it has enough.
    ///
    /// # Errors
    /// When a file is damaged, or `take` fails.
    pub fn visit_messages(
        &self,
        wanted: &dyn Fn(u16) -> bool,
        take: &mut MessageCallback,
    ) -> Result<(), TableError> {
        let mut more = true;
        for MessageFile { content, ids, .. } in self.files.iter() {
            if !more {
                break;
            }
            let id = |of_file: i64| ids.get(&of_file).copied().filter(|id| wanted(*id));
            match content {
                MessageStorage::Mcap(mcap) => mcap.visit_messages(&mut |header, data| {
                    let Some(channel_id) = id(header.channel_id.into()) else { return Ok(true) };
                    more = take(&MessageHeader { channel_id, ..*header }, data)?;
                    Ok(more)
                })?,
                MessageStorage::Database(database) => {
                    let is_wanted = |topic| id(topic).is_some();
                    let result = database.visit_messages(&is_wanted, &mut |topic, time, data| {
                        let Some(channel_id) = id(topic) else { return Ok(true) };
                        // There is one time, and none before 1970.
                        let time = u64::try_from(time).unwrap_or(0);
                        let header =
                            MessageHeader { channel_id, sequence: 0, log_time: time, publish_time: time };
                        more = take(&header, data).map_err(MessageVisitError::Taker)?;
                        Ok(more)
                    });
                    result.map_err(|stop| match stop {
                        MessageVisitError::Bag(error) => bag_error(&self.path, error.to_string()),
                        MessageVisitError::Taker(error) => error,
                    })?;
                }
            }
        }
        Ok(())
    }
}

/// Why messages of a database are no more handed over.
enum MessageVisitError {
    Bag(ros_bag::Error),
    Taker(TableError),
}

impl From<ros_bag::Error> for MessageVisitError {
    fn from(error: ros_bag::Error) -> Self {
        MessageVisitError::Bag(error)
    }
}

fn bag_error(path: &Path, what: String) -> TableError {
    RecordingError::Bag { path: path.to_owned(), what }.into()
}

/// What makes channels one, of several files or of several publishers.
#[derive(PartialEq, Eq, Hash)]
struct ChannelIdentity {
    topic: String,
    encoding: String,
    schema: Option<(String, Vec<u8>)>,
    metadata: BTreeMap<String, String>,
}

impl ChannelIdentity {
    fn new(channel: &Channel) -> Self {
        let encoding = channel.message_encoding.clone();
        // Of ROS they are properties of the publishers.
        let metadata = match ros_bag::MessageEncoding::from_name(&encoding) {
            Some(_) => BTreeMap::new(),
            None => channel.metadata.clone(),
        };
        let schema = channel.schema.as_ref().map(|it| (it.name.clone(), it.data.to_vec()));
        ChannelIdentity { topic: channel.topic.clone(), encoding, schema, metadata }
    }
}

/// A number that no channel has.
fn free_channel_id(channels: &ChannelsById, from: usize) -> u16 {
    let from = u16::try_from(from).unwrap_or(0);
    let numbers = (from..=u16::MAX).chain(0..from);
    numbers.into_iter().find(|number| !channels.contains_key(number)).unwrap_or(u16::MAX)
}

/// The topic of a database as a channel.
fn topic_to_channel(topic: &ros_bag::BagTopic) -> (i64, Arc<Channel<'static>>) {
    let schema = Schema {
        id: 1,
        name: topic.kind.clone(),
        encoding: topic.language.clone(),
        data: Cow::Owned(topic.definition.clone().into_bytes()),
    };
    let channel = Channel {
        id: 0,
        topic: topic.name.clone(),
        schema: Some(Arc::new(schema)),
        message_encoding: topic.encoding.clone(),
        metadata: BTreeMap::new(),
    };
    (topic.id, Arc::new(channel))
}
