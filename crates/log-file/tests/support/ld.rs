//! Writes MoTeC files by their published layout, for tests.
#![allow(dead_code, reason = "each test takes some of it")]

/// A channel of a MoTeC file.
pub struct Ld {
    pub name: &'static str,
    pub unit: &'static str,
    /// Class and size of a number, rate.
    pub kind: [u16; 3],
    /// Offset, factor, divisor, decimals.
    pub scale: [i16; 4],
    pub rows: u32,
    pub bytes: Vec<u8>,
}

/// A MoTeC file: header, list of channels, numbers.
pub fn ld(channels: &[Ld]) -> Vec<u8> {
    const HEADER: usize = 0x3448;
    const CHANNEL: usize = 124;
    let mut file = vec![0u8; HEADER];
    file[0] = 0x40;
    let address = |k: usize| (HEADER + k * CHANNEL) as u32;
    let mut data = address(channels.len());
    file[8..12].copy_from_slice(&address(0).to_le_bytes());
    file[12..16].copy_from_slice(&data.to_le_bytes());
    file[0x56..0x5a].copy_from_slice(&(channels.len() as u32).to_le_bytes());
    file[0x9e..0xa4].copy_from_slice(b"driver");
    for (k, it) in channels.iter().enumerate() {
        let next = if k + 1 < channels.len() { address(k + 1) } else { 0 };
        let before = if k > 0 { address(k - 1) } else { 0 };
        for number in [before, next, data, it.rows] {
            file.extend(number.to_le_bytes());
        }
        file.extend([0x12, 0x34]);
        file.extend(it.kind.iter().flat_map(|it| it.to_le_bytes()));
        file.extend(it.scale.iter().flat_map(|it| it.to_le_bytes()));
        for (text, length) in [(it.name, 32), ("short", 8), (it.unit, 12)] {
            let mut bytes = text.as_bytes().to_vec();
            bytes.resize(length, 0);
            file.extend(bytes);
        }
        file.extend([0; 40]);
        data += it.bytes.len() as u32;
    }
    channels.iter().for_each(|it| file.extend(&it.bytes));
    file
}

/// Channels of all storages.
pub fn ld_channels() -> Vec<Ld> {
    let i16s = |it: &[i16]| it.iter().flat_map(|it| it.to_le_bytes()).collect();
    vec![
        Ld {
            name: "Ground Speed",
            unit: "km/h",
            kind: [3, 2, 10],
            scale: [0, 1, 1, 1],
            rows: 3,
            bytes: i16s(&[1000, 1005, -20]),
        },
        Ld {
            name: "G Force Lat",
            unit: "G",
            kind: [0, 4, 20],
            scale: [0, 1, 1, 3],
            rows: 4,
            bytes: [-1500i32, 0, 250, 1000].iter().flat_map(|it| it.to_le_bytes()).collect(),
        },
        // Half precision: 1.5 and -2.
        Ld {
            name: "Steer",
            unit: "deg",
            kind: [7, 2, 10],
            scale: [0, 1, 1, 0],
            rows: 3,
            bytes: [0x3e00u16, 0xc000, 0].iter().flat_map(|it| it.to_le_bytes()).collect(),
        },
        Ld {
            name: "Temp",
            unit: "C",
            kind: [7, 4, 1],
            scale: [-40, 2, 4, -1],
            rows: 1,
            bytes: 100f32.to_le_bytes().to_vec(),
        },
    ]
}
