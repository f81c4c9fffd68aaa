//! Reads the database of a bag, SQLite as rosbag2 writes it: topics with their definitions, and messages in the order in which they came.

use std::path::Path;

use rusqlite::limits::Limit;
use rusqlite::types::ValueRef;
use rusqlite::{Connection, OpenFlags};

use crate::Error;

/// A message that would take more memory than this [B] is not read.
const LARGEST: i32 = 256 << 20;

/// Whether a file begins as a database does.
#[must_use]
pub fn is_database(head: &[u8]) -> bool {
    head.starts_with(b"SQLite format 3\0")
}

/// A topic of a bag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BagTopic {
    /// Its number in the database.
    pub id: i64,
    /// Its name.
    pub name: String,
    /// The name of its messages' type, such as `sensor_msgs/msg/Imu`.
    pub kind: String,
    /// How its messages are serialized, such as `cdr`.
    pub encoding: String,
    /// The language of its definition; empty where the bag has none.
    pub language: String,
    /// The definition of its messages; empty where the bag has none.
    pub definition: String,
}

/// The database of a bag.
pub struct BagDatabase {
    connection: Connection,
    /// Its topics.
    pub topics: Vec<BagTopic>,
}

/// Takes the topic, the time of the recorder [ns] and the bytes of a message, and says whether it wants more.
pub type BagMessageCallback<'t, E> = &'t mut dyn FnMut(i64, i64, &[u8]) -> Result<bool, E>;

impl BagDatabase {
    /// Opens a database and reads its topics.
    ///
    /// # Errors
    /// When it cannot be read, is damaged, or is no bag.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let connection = connect_read_only(path).map_err(|error| database_error(&error))?;
        let table = |name: &str| {
            let query = "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name = ?1";
            connection.query_row(query, [name], |row| row.get::<_, i64>(0))
        };
        let there = |name: &str| table(name).map(|count| count > 0).map_err(|error| database_error(&error));
        if !there("topics")? || !there("messages")? {
            let text = "expected a bag of ROS 2, found a database of SQLite without the tables `topics` and `messages`";
            return Err(Error::new(text));
        }
        let topics = match there("message_definitions")? {
            true => query_topics(&connection, DEFINED),
            false => query_topics(&connection, BARE),
        };
        let topics = topics.map_err(|error| database_error(&error))?;
        Ok(BagDatabase { connection, topics })
    }

    /// Hands over the messages of some topics, by their numbers: topic, time of the recorder [ns], bytes; until `take` says that it has enough.
    ///
    /// # Errors
    /// When the database is damaged, or `take` fails.
    pub fn visit_messages<E: From<Error>>(
        &self,
        wanted: &dyn Fn(i64) -> bool,
        take: BagMessageCallback<E>,
    ) -> Result<(), E> {
        let wrong = |error: rusqlite::Error| E::from(database_error(&error));
        let query = "SELECT topic_id, timestamp, data FROM messages ORDER BY id";
        let mut statement = self.connection.prepare(query).map_err(wrong)?;
        let mut rows = statement.query([]).map_err(wrong)?;
        while let Some(row) = rows.next().map_err(wrong)? {
            let topic = row.get(0).map_err(wrong)?;
            if !wanted(topic) {
                continue;
            }
            let time = row.get(1).map_err(wrong)?;
            let (ValueRef::Blob(data) | ValueRef::Text(data)) = row.get_ref(2).map_err(wrong)? else {
                return Err(E::from(Error::new("expected bytes in each message, found none in one")));
            };
            if !take(topic, time, data)? {
                break;
            }
        }
        Ok(())
    }
}

const BARE: &str = "SELECT id, name, type, serialization_format, '', '' FROM topics ORDER BY id";

const DEFINED: &str = "SELECT topics.id, name, type, serialization_format, \
    coalesce(max(message_definitions.encoding), ''), coalesce(max(encoded_message_definition), '') \
    FROM topics LEFT JOIN message_definitions ON topic_type = type GROUP BY topics.id ORDER BY topics.id";

fn query_topics(connection: &Connection, query: &str) -> rusqlite::Result<Vec<BagTopic>> {
    let mut statement = connection.prepare(query)?;
    let topics = statement.query_map([], |row| {
        Ok(BagTopic {
            id: row.get(0)?,
            name: row.get(1)?,
            kind: row.get(2)?,
            encoding: row.get(3)?,
            language: row.get(4)?,
            definition: row.get(5)?,
        })
    })?;
    topics.collect()
}

/// Opens the file so that nothing is written, not beside it either.
fn connect_read_only(path: &Path) -> rusqlite::Result<Connection> {
    let beside = |end: &str| {
        let mut name = path.as_os_str().to_owned();
        name.push(end);
        std::fs::metadata(name).is_ok_and(|about| about.len() > 0)
    };
    // What a recorder that was killed left beside the file belongs to it.
    let immutable = !beside("-wal") && !beside("-journal");
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let connection = match immutable {
        true => {
            let uri = format!("file:{}?immutable=1", encode_uri_path(path));
            Connection::open_with_flags(uri, flags | OpenFlags::SQLITE_OPEN_URI)?
        }
        false => Connection::open_with_flags(path, flags)?,
    };
    connection.set_limit(Limit::SQLITE_LIMIT_LENGTH, LARGEST)?;
    connection.pragma_update(None, "trusted_schema", false)?;
    connection.pragma_update(None, "cell_size_check", true)?;
    Ok(connection)
}

/// A path as it stands in an address.
fn encode_uri_path(path: &Path) -> String {
    let mut text = String::new();
    for byte in path.as_os_str().as_encoded_bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'/' | b'.' | b'-' | b'_' => {
                text.push(char::from(*byte));
            }
            _ => text.push_str(&format!("%{byte:02x}")),
        }
    }
    text
}

fn database_error(error: &rusqlite::Error) -> Error {
    use rusqlite::ErrorCode::{CannotOpen, DatabaseCorrupt, NotADatabase, ReadOnly};
    match error.sqlite_error_code() {
        Some(DatabaseCorrupt | NotADatabase) => Error::new(format!(
            "the bag is damaged ({error}): `sqlite3 OLD.db3 .recover | sqlite3 NEW.db3` saves what can be read of it"
        )),
        Some(CannotOpen | ReadOnly) => Error::new(format!(
            "the bag cannot be read ({error}): where its recorder was killed, `sqlite3 BAG.db3 .tables` completes it first"
        )),
        _ => Error::new(format!("the bag cannot be read: {error}")),
    }
}
