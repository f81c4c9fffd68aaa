//! Plays any bytes as the recording of a run, and recovers what is left of it. Checksums are made right first: changes reach the records in chunks.
#![no_main]

use libfuzzer_sys::fuzz_target;
use recording::{CsvSink, Recording};

/// Records with checksums, by their numbers in the specification of MCAP.
const CHUNK: u8 = 0x06;
const ATTACHMENT: u8 = 0x09;
const DATA_END: u8 = 0x0f;
const MAGIC: usize = 8;
/// Number and length of a record [bytes].
const HEAD: usize = 9;

fuzz_target!(|bytes: &[u8]| {
    let mut bytes = bytes.to_vec();
    correct_checksums(&mut bytes);
    let folder = tempfile::tempdir_in("/dev/shm").expect("room in memory");
    let path = folder.path().join("run.mcap");
    std::fs::write(&path, &bytes).expect("room in memory");
    if let Ok(recording) = Recording::open(&path)
        && let Ok(mut sink) = CsvSink::create(&recording.header, &folder.path().join("run.csv"))
    {
        let _ = recording.replay_into(&mut sink);
    }
    let _ = recording::recover::recover_recording(&path, &folder.path().join("recovered.mcap"), false);
});

/// Gives each record that has a checksum the right one, as far as records follow one another.
fn correct_checksums(bytes: &mut [u8]) {
    let mut at = MAGIC;
    while let Some(head) = bytes.get(at..at + HEAD) {
        let number = head[0];
        let Some(body) =
            number_at(head, 1, 8).and_then(|length| Some(at + HEAD..(at + HEAD).checked_add(length)?))
        else {
            return;
        };
        if bytes.get(body.clone()).is_none() {
            return;
        }
        match number {
            CHUNK => correct_chunk(&mut bytes[body.clone()]),
            ATTACHMENT if body.len() >= 4 => {
                let end = body.end - 4;
                let sum = crc32fast::hash(&bytes[body.start..end]);
                bytes[end..body.end].copy_from_slice(&sum.to_le_bytes());
            }
            DATA_END if body.len() >= 4 => {
                let sum = crc32fast::hash(&bytes[..at]);
                bytes[body.start..body.start + 4].copy_from_slice(&sum.to_le_bytes());
            }
            _ => {}
        }
        at = body.end;
    }
}

/// The checksum of a chunk that is not compressed: its begin, end, length, checksum, the name of the compression, and the records.
fn correct_chunk(body: &mut [u8]) {
    if number_at(body, 28, 4) != Some(0) || body.len() < 40 {
        return;
    }
    let (head, records) = body.split_at_mut(40);
    let (length, sum) = (records.len() as u64, crc32fast::hash(records));
    head[16..24].copy_from_slice(&length.to_le_bytes());
    head[24..28].copy_from_slice(&sum.to_le_bytes());
    head[32..40].copy_from_slice(&length.to_le_bytes());
}

/// A number of so many bytes.
fn number_at(bytes: &[u8], at: usize, size: usize) -> Option<usize> {
    let mut number = [0; 8];
    number[..size].copy_from_slice(bytes.get(at..at + size)?);
    usize::try_from(u64::from_le_bytes(number)).ok()
}
