//! Damages descriptions of both versions as careless tools and bad disks do: bytes, tags, attributes, numbers, depth, ends.

use std::io::Write as _;
use std::panic::AssertUnwindSafe;
use std::path::Path;
use std::time::Duration;

use fmu_import::Fmu;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

const TWO: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="m" guid="{1}" variableNamingConvention="structured">
  <CoSimulation modelIdentifier="m" canGetAndSetFMUstate="true" maxOutputDerivativeOrder="1"/>
  <UnitDefinitions><Unit name="m/s"><BaseUnit m="1" s="-1" factor="2.5"/><DisplayUnit name="kn"/></Unit></UnitDefinitions>
  <TypeDefinitions>
    <SimpleType name="Speed"><Real unit="m/s" min="-2" max="1e3"/></SimpleType>
    <SimpleType name="Mode"><Enumeration><Item name="a" value="-1"/><Item name="b" value="2"/></Enumeration></SimpleType>
  </TypeDefinitions>
  <LogCategories><Category name="logAll"/></LogCategories>
  <DefaultExperiment startTime="0" stopTime="1" stepSize="0.1" tolerance="1e-4"/>
  <ModelVariables>
    <ScalarVariable name="a.u" valueReference="0" causality="input"><Real declaredType="Speed" start="1"/></ScalarVariable>
    <ScalarVariable name="a.y[1]" valueReference="1" causality="output"><Real unit="m/s"/></ScalarVariable>
    <ScalarVariable name="n" valueReference="2" causality="parameter" variability="fixed"><Integer start="3" max="7"/></ScalarVariable>
    <ScalarVariable name="mode" valueReference="3" causality="output" variability="discrete"><Enumeration declaredType="Mode"/></ScalarVariable>
    <ScalarVariable name="der(x)" valueReference="4"><Real derivative="2"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="2" dependencies="1 3" dependenciesKind="constant fixed"/><Unknown index="4"/></Outputs>
    <InitialUnknowns><Unknown index="2"/><Unknown index="4"/></InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"#;

const THREE: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="m" instantiationToken="{1}">
  <CoSimulation modelIdentifier="m" canGetAndSetFMUState="1" hasEventMode="true"/>
  <UnitDefinitions><Unit name="kph"><BaseUnit m="1" s="-1" factor="0.25"/></Unit></UnitDefinitions>
  <TypeDefinitions>
    <Float64Type name="Speed" unit="kph" min="-2"/>
    <EnumerationType name="Mode"><Item name="b" value="2"/><Item name="a" value="-1"/></EnumerationType>
  </TypeDefinitions>
  <DefaultExperiment stopTime="1"/>
  <ModelVariables>
    <Float64 name="time" valueReference="0" causality="independent"/>
    <UInt64 name="n" valueReference="1" causality="structuralParameter" variability="tunable" start="2"/>
    <Float32 name="A" valueReference="2" causality="parameter" variability="tunable" start="1 2 3 4 5 6"><Dimension valueReference="1"/><Dimension start="3"/></Float32>
    <Float64 name="v" valueReference="3" causality="input" declaredType="Speed" start="1"><Alias name="speed"/></Float64>
    <Float64 name="y" valueReference="4" causality="output"><Dimension valueReference="1"/></Float64>
    <Enumeration name="mode" valueReference="5" declaredType="Mode" causality="input" start="2"/>
    <String name="s" valueReference="6" causality="input"><Start value="a &lt; b"/></String>
    <Binary name="b" valueReference="7" causality="input"><Start value="C0ffee"/></Binary>
    <Clock name="c" valueReference="9" causality="input" intervalVariability="triggered"/>
  </ModelVariables>
  <ModelStructure><Output valueReference="4" dependencies="2 3"/><InitialUnknown valueReference="4"/></ModelStructure>
</fmiModelDescription>
"#;

/// Numbers that overflow something.
const NUMBERS: [&str; 9] = [
    "-1",
    "4294967295",
    "4294967296",
    "18446744073709551615",
    "99999999999999999999999999",
    "1e999",
    "-9223372036854775808",
    "NaN",
    "",
];

/// What became of the descriptions.
#[derive(Debug, Default)]
pub struct Outcome {
    /// They were opened all the same.
    pub opened: usize,
    /// They were refused with a reason.
    pub refused: usize,
    /// The seeds at which opening them panicked.
    pub panicked: Vec<u64>,
    /// The longest time that opening one took.
    pub longest: Duration,
}

/// Opens `count` damaged descriptions; the first one has this seed, the next ones those that follow.
pub fn open_damaged(count: u64, seed: u64) -> Outcome {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("x.fmu");
    let mut outcome = Outcome::default();
    for seed in seed..seed + count {
        write(&path, &damaged(seed));
        let start = std::time::Instant::now();
        let found = std::panic::catch_unwind(AssertUnwindSafe(|| Fmu::open(&path)));
        outcome.longest = outcome.longest.max(start.elapsed());
        match found {
            Ok(Ok(_)) => outcome.opened += 1,
            Ok(Err(_)) => outcome.refused += 1,
            Err(_) => outcome.panicked.push(seed),
        }
    }
    outcome
}

fn write(path: &Path, xml: &[u8]) {
    let file = std::fs::File::create(path).expect("a file");
    let mut archive = zip::ZipWriter::new(file);
    let stored =
        zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    archive.start_file("modelDescription.xml", stored).expect("an entry");
    archive.write_all(xml).expect("an entry");
    archive.finish().expect("an archive");
}

/// A description with one to four damages.
pub fn damaged(seed: u64) -> Vec<u8> {
    let mut random = Pcg64::seed_from_u64(seed);
    let text = if random.random() { TWO } else { THREE };
    let mut bytes = text.as_bytes().to_vec();
    for _ in 0..random.random_range(1..5) {
        let pick = random.random_range(0..8);
        damage(&mut bytes, pick, &mut random);
    }
    bytes
}

fn damage(bytes: &mut Vec<u8>, pick: u32, random: &mut Pcg64) {
    if bytes.len() < 2 {
        return;
    }
    let mut at = random.random_range(0..bytes.len());
    match pick {
        0 => bytes[at] ^= 1 << random.random_range(0..8),
        1 => bytes.truncate(at),
        2 => {
            // A tag, moved to another place.
            let Some(tag) = between(bytes, at, b'<', b'>') else { return };
            let moved: Vec<u8> = bytes.drain(tag).collect();
            at = at.min(bytes.len());
            let to = random.random_range(0..=bytes.len().min(at + 400));
            bytes.splice(to..to, moved);
        }
        3 => {
            // A tag twice.
            let Some(tag) = between(bytes, at, b'<', b'>') else { return };
            let again = bytes[tag.clone()].to_vec();
            bytes.splice(tag.end..tag.end, again);
        }
        4 => {
            // A number that is too large, or none.
            let Some(value) = between(bytes, at, b'"', b'"') else { return };
            let number = NUMBERS[random.random_range(0..NUMBERS.len())];
            bytes.splice(value.start + 1..value.end - 1, number.bytes());
        }
        5 => {
            // A value for one attribute that belongs to another.
            let (Some(from), Some(to)) = (
                between(bytes, at, b'"', b'"'),
                between(bytes, random.random_range(0..bytes.len()), b'"', b'"'),
            ) else {
                return;
            };
            let value = bytes[from].to_vec();
            bytes.splice(to, value);
        }
        6 => {
            let depth = [3, 300, 30_000][random.random_range(0..3)];
            let deep = "<Terminal>".repeat(depth) + &"</Terminal>".repeat(depth);
            let place = bytes[at..].iter().position(|it| *it == b'<').map_or(at, |it| at + it);
            bytes.splice(place..place, deep.bytes());
        }
        _ => {
            // An attribute twice.
            let Some(value) = between(bytes, at, b' ', b' ') else { return };
            let again = bytes[value.clone()].to_vec();
            bytes.splice(value.end..value.end, again);
        }
    }
}

/// The next part that begins and ends with these bytes.
fn between(bytes: &[u8], from: usize, begin: u8, end: u8) -> Option<std::ops::Range<usize>> {
    let start = from + bytes[from..].iter().position(|byte| *byte == begin)?;
    let length = bytes[start + 1..].iter().position(|byte| *byte == end)?;
    Some(start..start + length + 2)
}
