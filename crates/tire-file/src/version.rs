//! Detects the version of the Magic Formula of a file, and refuses files of other tire models.

use tire::MagicFormulaVersion;

use crate::TireFileMessage;
use crate::syntax::{TirEntry, TirFile, TirValue};

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
const FITTYP: [(f64, MagicFormulaVersion); 10] = [
    (5.0, MagicFormulaVersion::Mf52),
    (6.0, MagicFormulaVersion::Mf52),
    (21.0, MagicFormulaVersion::Mf52),
    (50.0, MagicFormulaVersion::Mf52),
    (51.0, MagicFormulaVersion::Mf52),
    (52.0, MagicFormulaVersion::Mf52),
    (5.2, MagicFormulaVersion::Mf52),
    (60.0, MagicFormulaVersion::Mf61),
    (61.0, MagicFormulaVersion::Mf61),
    (62.0, MagicFormulaVersion::Mf62),
];

/// The version of the formula, and what there is to tell about how it was found.
///
/// # Errors
/// When the file names another model, or a version that nobody knows.
pub(crate) fn detect_version(
    file: &TirFile,
) -> Result<(MagicFormulaVersion, Option<TireFileMessage>), TireFileMessage> {
    let named = model_entry(file, "PROPERTY_FILE_FORMAT");
    let format = named.map(|entry| letters_and_digits(&entry.value)).unwrap_or_default();
    refuse_other_models(file, &format, named.map(|entry| entry.line))?;
    let is_pac2002 = format.starts_with("PAC2002");
    if let Some(entry) = model_entry(file, "FITTYP").filter(|it| it.value != TirValue::Empty) {
        let line = Some(entry.line);
        let Some((number, version)) = fittyp_version(&entry.value) else {
            let text = format!("FITTYP: expected 5, 6, 21, 50, 51, 52, 60, 61 or 62, found {}", entry.value);
            return Err(TireFileMessage::warning(line, text));
        };
        let told = match (is_pac2002, version) {
            (true, MagicFormulaVersion::Mf52) => return Ok((MagicFormulaVersion::Pac2002, None)),
            (true, _) => Some(TireFileMessage::note(
                line,
                format!(
                    "FITTYP = {number} is {version} and PROPERTY_FILE_FORMAT is PAC2002: read as {version}"
                ),
            )),
            (false, _) if number == 60.0 => {
                Some(TireFileMessage::note(line, "FITTYP = 60 is MF-Tyre 6.0: read as MF 6.1"))
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
    Ok((version, Some(TireFileMessage::note(None, text))))
}

fn refuse_other_models(
    file: &TirFile,
    format: &str,
    format_line: Option<usize>,
) -> Result<(), TireFileMessage> {
    // Short names are whole words: CDT20, but no UAZ.
    let is_it = |word: &str| format == word || (word.len() > 2 && word != "PUL" && format.starts_with(word));
    let named = OTHER_MODELS.iter().find(|(word, _)| is_it(word));
    let has_section = |name: &str| {
        file.entries
            .iter()
            .map(|it| &it.section)
            .chain(file.tables.iter().map(|it| &it.section))
            .any(|it| it == name)
    };
    let section = OTHER_SECTIONS.iter().find(|(name, _)| has_section(name));
    let kind = model_entry(file, "TYPE");
    let is_new = model_entry(file, "FITTYP")
        .and_then(|entry| fittyp_version(&entry.value))
        .is_some_and(|(_, version)| !version.is_before_61());
    let rides = kind.is_some_and(|it| letters_and_digits(&it.value).starts_with("MOTOR"))
        || file.find_entry("LATERAL_COEFFICIENTS", "PCY2").is_some();
    let (model, line) = match (named, section) {
        (Some((_, model)), _) => (*model, format_line),
        (None, Some((_, model))) => (*model, None),
        (None, None) if rides && !is_new => (MOTORCYCLE, kind.map(|it| it.line)),
        _ => return Ok(()),
    };
    let text =
        format!("this is a file of {model}: expected one of the Magic Formula (MF-Tyre 5 to 6.2 or PAC2002)");
    Err(TireFileMessage::warning(line, text))
}

/// An entry of `[MODEL]`, or of another section in files without it.
fn model_entry<'f>(file: &'f TirFile, key: &str) -> Option<&'f TirEntry> {
    file.find_entry("MODEL", key).or_else(|| file.find_entry("", key))
}

/// Letters and digits of a value, in capitals.
fn letters_and_digits(value: &TirValue) -> String {
    let text = value.to_string();
    text.chars().filter(char::is_ascii_alphanumeric).map(|it| it.to_ascii_uppercase()).collect()
}

/// The number of a `FITTYP` with its version: `61`, `'MF61'` and `'MF-Tyre 6.1'` are the same.
fn fittyp_version(value: &TirValue) -> Option<(f64, MagicFormulaVersion)> {
    let letters = letters_and_digits(value);
    if letters.ends_with("PAC2002") {
        return Some((5.0, MagicFormulaVersion::Pac2002));
    }
    let number = match value {
        TirValue::Number(number) => *number,
        _ => letters.trim_start_matches(|letter: char| !letter.is_ascii_digit()).parse().ok()?,
    };
    // 6 is MF-Tyre 5.2, and 6.1 is 61.
    let number = if (6.0..7.0).contains(&number) && number != 6.0 { number * 10.0 } else { number };
    FITTYP.into_iter().find(|(known, _)| (known - number).abs() < 1e-9)
}

/// The version that the keys of a file speak for. Only PAC2002 has camber as 5.2 and pressure together, or its own names of pressure; only
/// newer formulas know the other terms.
fn by_keys(file: &TirFile) -> MagicFormulaVersion {
    let has = |keys: &[&str]| keys.iter().any(|key| file.find_entry("", key).is_some());
    let pressure = has(&["PPY1", "PPX1"]);
    if has(&["Q_CAM1", "Q_FYS1", "Q_FCY2"]) {
        MagicFormulaVersion::Mf62
    } else if has(&["PKY6", "PKY4", "QSX12", "Q_FZ2", "PPY5"]) {
        MagicFormulaVersion::Mf61
    } else if has(&["IP", "IP_NOM", "QPZ1", "QPX1"]) || (pressure && has(&["PHY3", "PTX1", "PTY1"])) {
        MagicFormulaVersion::Pac2002
    } else if pressure {
        MagicFormulaVersion::Mf61
    } else {
        MagicFormulaVersion::Mf52
    }
}
