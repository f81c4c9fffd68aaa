//! Detects the version of the Magic Formula of a file, and refuses files of other tire models.

use tire::Version;

use crate::Message;
use crate::syntax::{Entry, TirFile, Value};

/// Words of `PROPERTY_FILE_FORMAT` for other models, in capitals and without signs, with the names of the models: those of Adams Tire,
/// RecurDyn, Chrono and of the makers.
const OTHER_MODELS: [(&str, &str); 22] = [
    ("PACMC", MOTORCYCLE),
    ("PACMOTORCYCLE", MOTORCYCLE),
    ("MFMC", MOTORCYCLE),
    ("MFTYREMC", MOTORCYCLE),
    ("MCTYRE", MOTORCYCLE),
    ("PACTIME", "PAC-TIME"),
    ("PAC89", "Pacejka '89"),
    ("PACEJKA89", "Pacejka '89"),
    ("PAC94", "Pacejka '94"),
    ("PACEJKA94", "Pacejka '94"),
    ("521", "the 5.2.1 tire of Adams"),
    ("FIALA", "Fiala"),
    ("UA", "the tire of the University of Arizona"),
    ("UATIRE", "the tire of the University of Arizona"),
    ("RDUA", "the tire of the University of Arizona"),
    ("PUL", "the pulling tire of Ansys Motion"),
    ("FTIRE", "FTire"),
    ("COSINFTIRE", "FTire"),
    ("TMEASY", "TMeasy"),
    ("CDT", "CDTire"),
    ("RMODK", "RMOD-K"),
    ("BRUSH", "a brush model"),
];

const MOTORCYCLE: &str = "a motorcycle tire (PAC MC, MF-MCTyre), which has equations of its own";

/// Sections that only files of other models have.
const OTHER_SECTIONS: [(&str, &str); 3] =
    [("FTIRE_DATA", "FTire"), ("CDTIRE", "CDTire"), ("TMEASY", "TMeasy")];

/// The numbers of `FITTYP` that MF-Tyre knows. 50 to 52 are those of MF-MCTyre, too, which its keys tell.
const FITTYP: [(f64, Version); 10] = [
    (5.0, Version::Mf52),
    (6.0, Version::Mf52),
    (21.0, Version::Mf52),
    (50.0, Version::Mf52),
    (51.0, Version::Mf52),
    (52.0, Version::Mf52),
    (5.2, Version::Mf52),
    (60.0, Version::Mf61),
    (61.0, Version::Mf61),
    (62.0, Version::Mf62),
];

/// The version of the formula, and what there is to tell about how it was found.
///
/// # Errors
/// When the file names another model, or a version that nobody knows.
pub(crate) fn version(file: &TirFile) -> Result<(Version, Option<Message>), Message> {
    let named = entry(file, "PROPERTY_FILE_FORMAT");
    let format = named.map(|entry| letters(&entry.value)).unwrap_or_default();
    refuse_other_models(file, &format, named.map(|entry| entry.line))?;
    let is_pac2002 = format.starts_with("PAC2002");
    if let Some(entry) = entry(file, "FITTYP").filter(|it| it.value != Value::Empty) {
        let line = Some(entry.line);
        let Some((number, version)) = fittyp_version(&entry.value) else {
            let text = format!(
                "FITTYP: expected 5, 6, 21, 50, 51, 52, 60, 61 or 62, found {}",
                entry.value
            );
            return Err(Message::warning(line, text));
        };
        let told = match (is_pac2002, version) {
            (true, Version::Mf52) => return Ok((Version::Pac2002, None)),
            (true, _) => Some(Message::note(
                line,
                format!(
                    "FITTYP = {number} is {version} and PROPERTY_FILE_FORMAT is PAC2002: read as {version}"
                ),
            )),
            (false, _) if number == 60.0 => {
                Some(Message::note(line, "FITTYP = 60 is MF-Tyre 6.0: read as MF 6.1"))
            }
            _ => None,
        };
        return Ok((version, told));
    }
    // Such as MF_05 of MF-Tyre 5.0.
    if let Some((_, version)) = named.and_then(|entry| fittyp_version(&entry.value)) {
        return Ok((version, None));
    }
    let version = by_keys(file);
    let text = format!("no FITTYP in [MODEL]: read as {version}, by its keys");
    Ok((version, Some(Message::note(None, text))))
}

fn refuse_other_models(
    file: &TirFile,
    format: &str,
    format_line: Option<usize>,
) -> Result<(), Message> {
    // Short names are whole words: CDT20, but no UAZ.
    let is_it = |word: &str| {
        format == word || (word.len() > 2 && word != "PUL" && format.starts_with(word))
    };
    let named = OTHER_MODELS.iter().find(|(word, _)| is_it(word));
    let has_section = |name: &str| {
        file.entries
            .iter()
            .map(|it| &it.section)
            .chain(file.tables.iter().map(|it| &it.section))
            .any(|it| it == name)
    };
    let section = OTHER_SECTIONS.iter().find(|(name, _)| has_section(name));
    let kind = entry(file, "TYPE");
    let is_new = entry(file, "FITTYP")
        .and_then(|entry| fittyp_version(&entry.value))
        .is_some_and(|(_, version)| !version.is_before_61());
    let rides = kind.is_some_and(|it| letters(&it.value).starts_with("MOTOR"))
        || file.entry("LATERAL_COEFFICIENTS", "PCY2").is_some();
    let (model, line) = match (named, section) {
        (Some((_, model)), _) => (*model, format_line),
        (None, Some((_, model))) => (*model, None),
        (None, None) if rides && !is_new => (MOTORCYCLE, kind.map(|it| it.line)),
        _ => return Ok(()),
    };
    let text = format!(
        "this is a file of {model}: expected one of the Magic Formula (MF-Tyre 5 to 6.2 or PAC2002)"
    );
    Err(Message::warning(line, text))
}

/// An entry of `[MODEL]`, or of another section in files without it.
fn entry<'f>(file: &'f TirFile, key: &str) -> Option<&'f Entry> {
    file.entry("MODEL", key).or_else(|| file.entry("", key))
}

/// Letters and digits of a value, in capitals.
fn letters(value: &Value) -> String {
    let text = value.to_string();
    text.chars().filter(char::is_ascii_alphanumeric).map(|it| it.to_ascii_uppercase()).collect()
}

/// The number of a `FITTYP` with its version: `61`, `'MF61'` and `'MF-Tyre 6.1'` are the same.
fn fittyp_version(value: &Value) -> Option<(f64, Version)> {
    let letters = letters(value);
    if letters.ends_with("PAC2002") {
        return Some((5.0, Version::Pac2002));
    }
    let number = match value {
        Value::Number(number) => *number,
        _ => letters.trim_start_matches(|letter: char| !letter.is_ascii_digit()).parse().ok()?,
    };
    // 6 is MF-Tyre 5.2, and 6.1 is 61.
    let number = if (6.0..7.0).contains(&number) && number != 6.0 { number * 10.0 } else { number };
    FITTYP.into_iter().find(|(known, _)| (known - number).abs() < 1e-9)
}

/// The version that the keys of a file speak for. Only PAC2002 has camber as 5.2 and pressure together, or its own names of pressure; only
/// newer formulas know the other terms.
fn by_keys(file: &TirFile) -> Version {
    let has = |keys: &[&str]| keys.iter().any(|key| file.entry("", key).is_some());
    let pressure = has(&["PPY1", "PPX1"]);
    if has(&["Q_CAM1", "Q_FYS1", "Q_FCY2"]) {
        Version::Mf62
    } else if has(&["PKY6", "PKY4", "QSX12", "Q_FZ2", "PPY5"]) {
        Version::Mf61
    } else if has(&["IP", "IP_NOM", "QPZ1", "QPX1"]) || (pressure && has(&["PHY3", "PTX1", "PTY1"]))
    {
        Version::Pac2002
    } else if pressure {
        Version::Mf61
    } else {
        Version::Mf52
    }
}
