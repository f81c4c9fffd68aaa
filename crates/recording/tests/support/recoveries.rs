//! What tries damaged recordings by recovering them.
#![allow(dead_code, reason = "each user needs a part")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::OnceLock;

use damage::FuzzTarget;
use mcap::records::{MessageHeader, Record};
use recording::recover::recover_recording;

use super::made::{self, TestError};

pub const TARGET: FuzzTarget = FuzzTarget {
    name: "recoveries",
    corpus: concat!(env!("CARGO_MANIFEST_DIR"), "/../recording/tests/corpus/recordings"),
    sound: made::all,
    words: &["/car/outputs", "protobuf", "json", "lz4", "zstd"],
    own: Some(made::own),
    attempt,
};

/// A message: its number, its times and its content. Its channel may be one of another recording, of which a part was spliced in.
type Message = (u32, u64, u64, Vec<u8>);

/// Everything that a recording holds.
#[derive(Default)]
pub struct Contents {
    messages: BTreeSet<Message>,
    /// Channels with their schemas and metadata, other metadata, and attachments.
    others: BTreeSet<String>,
    /// Messages, each one counted that is there twice.
    pub count: u64,
}

/// Whatever the sound recordings hold.
fn sound() -> &'static Contents {
    static SOUND: OnceLock<Contents> = OnceLock::new();
    SOUND.get_or_init(|| {
        let mut all = Contents::default();
        for bytes in made::all() {
            let one = contents(&bytes).expect("it is sound");
            all.messages.extend(one.messages);
            all.others.extend(one.others);
        }
        all
    })
}

/// Recovers the recording. What is recovered can be read by others, and a sound recording has held it.
fn attempt(bytes: &[u8], folder: &Path) -> bool {
    let (broken, into) = (folder.join("broken.mcap"), folder.join("new.mcap"));
    let _ = std::fs::remove_file(&into);
    std::fs::write(&broken, bytes).expect("it can be written");
    let unchecked = recover_recording(&broken, &folder.join("unchecked.mcap"), true);
    let Ok(found) = recover_recording(&broken, &into, false) else { return false };
    assert!(unchecked.is_ok_and(|more| more.messages >= found.messages), "more was lost");
    let new = std::fs::read(&into).expect("it was written");
    let new = contents(&new).unwrap_or_else(|error| panic!("it cannot be read: {error}"));
    assert_eq!(new.count, found.messages, "messages are counted");
    assert!(new.messages.is_subset(&sound().messages), "messages are new");
    let added: Vec<_> = new.others.difference(&sound().others).collect();
    assert!(added.is_empty(), "{added:?} are new");
    true
}

/// Reads a sound recording with the crate `mcap` alone.
///
/// # Errors
/// When it is no recording.
pub fn contents(bytes: &[u8]) -> Result<Contents, TestError> {
    let options = mcap::read::Options::IgnoreEndMagic | mcap::read::Options::ValidateChunkCrcs;
    let (mut found, mut schemas) = (Contents::default(), BTreeMap::new());
    for record in mcap::read::ChunkFlattener::new_with_options(bytes, options)? {
        // A recording of a killed run ends within a record.
        let Ok(record) = record else { break };
        match record {
            Record::Schema { header, data } => {
                schemas.insert(header.id, format!("{:?} {data:?}", (header.name, header.encoding)));
            }
            Record::Channel(channel) => {
                let schema = schemas.get(&channel.schema_id);
                let (topic, encoding) = (&channel.topic, &channel.message_encoding);
                let metadata = &channel.metadata;
                found.others.insert(format!("{topic} {encoding} {metadata:?} {schema:?}"));
            }
            Record::Message { header, data } => {
                let MessageHeader { sequence, log_time, publish_time, .. } = header;
                found.messages.insert((sequence, log_time, publish_time, data.into_owned()));
                found.count += 1;
            }
            Record::Attachment { header, data, .. } => {
                found.others.insert(format!("{header:?} {data:?}"));
            }
            Record::Metadata(metadata) if metadata.name != "recovered" => {
                found.others.insert(format!("{metadata:?}"));
            }
            _ => {}
        }
    }
    Ok(found)
}
