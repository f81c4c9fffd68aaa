//! Prints the range of each number in the JSON messages of an MCAP file, by the readers of others alone: what `trackside inspect` is compared with.
//!
//! `mcap_ranges FILE [--messages]`: with the flag messages are counted and not decoded.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read};

use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("usage: mcap_ranges FILE [--messages]")?;
    let decode = std::env::args().nth(2).is_none();
    let mut file = BufReader::new(File::open(path)?);
    let mut reader = LinearReader::new();
    let mut messages = 0_u64;
    let mut ranges: BTreeMap<String, [f64; 2]> = BTreeMap::new();
    while let Some(event) = reader.next_event() {
        match event? {
            LinearReadEvent::ReadRequest(wanted) => {
                let read = file.read(reader.insert(wanted))?;
                reader.notify_read(read);
            }
            LinearReadEvent::Record { data, opcode: mcap::records::op::MESSAGE } => {
                messages += 1;
                let mcap::records::Record::Message { data, .. } =
                    mcap::parse_record(mcap::records::op::MESSAGE, data)?
                else {
                    continue;
                };
                if decode {
                    let fields: serde_json::Map<String, serde_json::Value> = serde_json::from_slice(&data)?;
                    for (name, value) in fields {
                        let Some(value) = value.as_f64() else { continue };
                        let [low, high] = ranges.entry(name).or_insert([value; 2]);
                        (*low, *high) = (low.min(value), high.max(value));
                    }
                }
            }
            LinearReadEvent::Record { .. } => {}
        }
    }
    println!("{messages} messages");
    for (name, [low, high]) in ranges {
        println!("{name}: {low} … {high}");
    }
    Ok(())
}
