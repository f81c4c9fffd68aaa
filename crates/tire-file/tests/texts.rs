//! Reads texts as other programs write them: each a change of one small tire, with what it is like and what is told.

use tire::{MagicFormulaVersion, MfTire, TireCharacteristics};
use tire_file::{
    TireFileMessage, TireMessageLevel, TireSpecification, check_plausibility, read_bytes, read_tir,
};

/// A tire of 4000 N with friction 1.1 and 80 sin(2 atan(1 / 2)) = 64 kN/rad.
const TIRE: &str = "[MDI_HEADER]\nFILE_TYPE = 'tir'\n[UNITS]\nLENGTH = 'meter'\nFORCE = 'newton'\nANGLE = 'radian'\nMASS = 'kg'\n\
TIME = 'second'\n[MODEL]\nFITTYP = 61\nLONGVL = 16.7\n[DIMENSION]\nUNLOADED_RADIUS = 0.3\n[OPERATING_CONDITIONS]\nINFLPRES = 220000\n\
NOMPRES = 220000\n[VERTICAL]\nFNOMIN = 4000\nVERTICAL_STIFFNESS = 200000\n[STRUCTURAL]\nLATERAL_STIFFNESS = 150000\n\
[LONGITUDINAL_COEFFICIENTS]\nPCX1 = 1.6\nPDX1 = 1.2\nPKX1 = 22\nRBX1 = 12\nPPX1 = -0.4\n[LATERAL_COEFFICIENTS]\nPCY1 = 1.3\nPDY1 = 1.1\n\
PKY1 = -20\nPKY2 = 2\nPKY6 = -0.9\nPVY3 = -0.3\nPPY1 = 0.5\nPPY3 = 0.2\nRBY1 = 10\n";

/// The same by the keys of PAC2002: camber as in 5.2.
fn pac2002() -> String {
    TIRE.replace("FITTYP = 61", "PROPERTY_FILE_FORMAT = 'PAC2002'")
        .replace("INFLPRES", "IP")
        .replace("NOMPRES", "IP_NOM")
        .replace("PKY6 = -0.9", "PHY3 = 0.03")
}

fn changed(from: &str, to: &str) -> String {
    assert!(TIRE.contains(from), "{from}");
    TIRE.replace(from, to)
}

struct Read {
    tire: MfTire,
    at: TireCharacteristics,
    messages: Vec<TireFileMessage>,
}

impl Read {
    fn told(&self) -> String {
        self.messages.iter().map(|it| format!("{:?} {it}\n", it.level)).collect()
    }

    fn warnings(&self) -> Vec<&str> {
        let warns = |it: &&TireFileMessage| it.level == TireMessageLevel::Warning;
        self.messages.iter().filter(warns).map(|it| it.text.as_str()).collect()
    }

    #[track_caller]
    fn is_the_tire(&self) {
        let TireCharacteristics { lateral, C_alpha, .. } = self.at;
        let near = (lateral.friction - 1.1).abs() < 1e-3 && (C_alpha - 64e3).abs() < 1.0;
        assert!(near, "{:?}\n{}", self.at, self.told());
    }
}

#[track_caller]
fn tire(text: &str) -> Read {
    let (coefficients, messages) = read_tir(text, "a.tir").unwrap_or_else(|error| panic!("{error}"));
    let tire = MfTire::new(coefficients).expect("a tire");
    Read { tire, at: tire.characteristics_at_load(4000.0), messages }
}

#[track_caller]
fn refused(text: &str) -> String {
    read_tir(text, "a.tir").expect_err("no tire").to_string()
}

#[test]
fn the_tire_is_read_without_a_warning() {
    let read = tire(TIRE);
    read.is_the_tire();
    assert!(read.warnings().is_empty(), "{}", read.told());
    assert_eq!(check_plausibility(&read.tire).level, TireMessageLevel::Note);
}

#[test]
fn units_of_other_programs_are_theirs() {
    let text = changed("'meter'", "'Meters'")
        .replace("'newton'", "'NEWTONS'")
        .replace("'radian'", "'radians'")
        .replace("'kg'", "kilograms")
        .replace("'second'", "\"seconds\"");
    let read = tire(&text);
    read.is_the_tire();
    assert_eq!(read.tire.coefficients().UNLOADED_RADIUS, 0.3);
    let text = changed("'meter'", "'furlong'");
    assert!(refused(&text).starts_with("a.tir:4: LENGTH: expected one of meter,"));
    let read = tire(&changed("MASS = 'kg'", "TORQUE = 'newton_meter'"));
    assert!(read.told().contains("units of nothing that is read: TORQUE"), "{}", read.told());
}

#[test]
fn a_pressure_that_is_no_pascal_is_told_with_its_probable_unit() {
    for (pressures, words) in [
        (
            ["2.2", "2.2"],
            "INFLPRES = 2.2 and NOMPRES = 2.2 in pascal is no pressure of a tire, probably in bar: say PRESSURE = 'bar'",
        ),
        (["2.5", "2.2"], "probably in bar"),
        (["32", "32"], "probably in psi: say PRESSURE = 'psi' in [UNITS]"),
        (["220", "220"], "probably in kpa"),
        (["0.22", "0.22"], "probably in mpa"),
        (["83", "83"], "probably in psi or kpa"),
        (["5000", "5000"], "state it in Pa"),
        (["2.2", "220000"], "INFLPRES = 2.2 in pascal is no"),
        (["220000", "2.2"], "NOMPRES = 2.2 in pascal is no"),
    ] {
        let [own, nominal] = pressures;
        let text = changed("INFLPRES = 220000", &format!("INFLPRES = {own}"))
            .replace("NOMPRES = 220000", &format!("NOMPRES = {nominal}"));
        let read = tire(&text);
        read.is_the_tire();
        assert!(read.warnings().iter().any(|it| it.contains(words)), "{words}: {}", read.told());
    }
    let bar = changed("220000\nNOMPRES = 220000", "2.2\nNOMPRES = 2.2")
        .replace("[MODEL]", "PRESSURE = 'Bars'\n[MODEL]");
    let read = tire(&bar);
    read.is_the_tire();
    assert!((read.tire.coefficients().INFLPRES - 2.2e5).abs() < 1e-6);
    assert!(read.warnings().is_empty(), "{}", read.told());
    let limits = tire(&format!("{TIRE}[INFLATION_PRESSURE_RANGE]\nPRESMIN = 60\nPRESMAX = 300\n"));
    limits.is_the_tire();
    assert!(limits.told().contains("PRESMAX = 300 in pascal"), "{}", limits.told());
}

#[test]
fn pac2002_has_the_camber_of_52_and_pressure() {
    let with = tire(&pac2002());
    let keys = ["IP = 220000\n", "IP_NOM = 220000\n", "PPX1 = -0.4\n", "PPY1 = 0.5\n", "PPY3 = 0.2\n"];
    let without = tire(&keys.iter().fold(pac2002(), |text, key| text.replace(key, "")));
    for read in [&with, &without] {
        read.is_the_tire();
        assert_eq!(read.tire.coefficients().version, MagicFormulaVersion::Pac2002);
        // C_alpha PHY3 and the share of the load that PVY3 is.
        let expected = 64e3 * 0.03 + 4000.0 * 0.3;
        assert!((read.at.C_gamma - expected).abs() < 5.0, "{}", read.at.C_gamma);
    }
    let hard = tire(&pac2002().replace("IP = 220000", "IP = 242000"));
    assert!((hard.at.C_alpha - 64e3 * 1.05).abs() < 1.0, "{}", hard.at.C_alpha);
    assert!((hard.at.lateral.friction - 1.1 * 1.02).abs() < 1e-3, "{}", hard.at.lateral.friction);
    // Without the word, keys of 5.2 beside those of pressure tell it.
    let keys = tire(&pac2002().replace("PROPERTY_FILE_FORMAT = 'PAC2002'\n", ""));
    assert_eq!(keys.tire.coefficients().version, MagicFormulaVersion::Pac2002, "{}", keys.told());
    // Adams takes the load to the power of QSY7 beside the load itself.
    let rolls = tire(&format!("{}QSY1 = 0.01\nQSY7 = 0\n", pac2002()));
    assert_eq!(rolls.tire.coefficients().QSY7, 1.0);
}

#[test]
fn what_a_use_does_not_need_may_be_0() {
    for (from, to) in [
        ("VERTICAL_STIFFNESS = 200000", "VERTICAL_STIFFNESS = 0"),
        ("LATERAL_STIFFNESS = 150000", "LATERAL_STIFFNESS = 0\nLONGITUDINAL_STIFFNESS = 0"),
        ("INFLPRES = 220000", "INFLPRES = 0"),
        ("NOMPRES = 220000", "NOMPRES = 0"),
        ("LONGVL = 16.7", "LONGVL = 0"),
        ("RBY1 = 10\n", "RBY1 = 10\n[INFLATION_PRESSURE_RANGE]\nPRESMIN = 0\nPRESMAX = 1000000\n"),
        ("RBY1 = 10\n", "RBY1 = 10\n[INFLATION_PRESSURE_RANGE]\nPRESMIN = 0\nPRESMAX = 0\n"),
        ("RBY1 = 10\n", "RBY1 = 10\n[SLIP_ANGLE_RANGE]\nALPMIN = 0\nALPMAX = 0\n"),
        ("FITTYP = 61", "FITTYP = 6\nPTY1 = 0\nPTY2 = 0"),
    ] {
        let read = tire(&changed(from, to));
        read.is_the_tire();
        assert!(
            read.told().contains("= 0 cannot be") || read.told().contains("= 0, "),
            "{to}: {}",
            read.told()
        );
        assert!(read.warnings().is_empty(), "{to}: {}", read.told());
    }
    assert!(refused(&changed("FNOMIN = 4000", "FNOMIN = 0")).contains("FNOMIN is 0, expected"));
}

#[test]
fn versions_have_numbers_and_words() {
    for (word, version) in [
        ("5", MagicFormulaVersion::Mf52),
        ("6", MagicFormulaVersion::Mf52),
        ("21", MagicFormulaVersion::Mf52),
        ("51", MagicFormulaVersion::Mf52),
        ("52", MagicFormulaVersion::Mf52),
        ("5.2", MagicFormulaVersion::Mf52),
        ("60", MagicFormulaVersion::Mf61),
        ("61", MagicFormulaVersion::Mf61),
        ("6.1", MagicFormulaVersion::Mf61),
        ("'MF61'", MagicFormulaVersion::Mf61),
        ("'MF-Tyre 6.1'", MagicFormulaVersion::Mf61),
        ("MF62", MagicFormulaVersion::Mf62),
        ("62", MagicFormulaVersion::Mf62),
        ("'PAC2002'", MagicFormulaVersion::Pac2002),
    ] {
        let read = tire(&changed("FITTYP = 61", &format!("FITTYP = {word}")));
        assert_eq!(read.tire.coefficients().version, version, "{word}: {}", read.told());
    }
    let read = tire(&changed("FITTYP = 61", "FITTYP = 5\nPROPERTY_FILE_FORMAT = 'PAC2002'"));
    assert_eq!(read.tire.coefficients().version, MagicFormulaVersion::Pac2002);
    let read = tire(&changed("FITTYP = 61", "PROPERTY_FILE_FORMAT = 'MF_05'"));
    assert_eq!(read.tire.coefficients().version, MagicFormulaVersion::Mf52, "{}", read.told());
    assert!(refused(&changed("= 61", "= 99")).contains("60, 61 or 62, found 99"));
    assert!(refused(&changed("= 61", "= 'soft'")).contains("60, 61 or 62, found `soft`"));
}

#[test]
fn other_models_are_refused_by_their_names() {
    for (word, name) in [
        ("'PAC_MC'", "motorcycle"),
        ("'MF-MCTYRE'", "motorcycle"),
        ("'MFTYRE-MCTYRE'", "motorcycle"),
        ("'PAC89'", "Pacejka '89"),
        ("'PAC-TIME'", "PAC-TIME"),
        ("'5.2.1'", "5.2.1"),
        ("521", "5.2.1"),
        ("'FIALA'", "Fiala"),
        ("'UA'", "University of Arizona"),
        ("'FTIRE'", "FTire"),
        ("'TMEASY'", "TMeasy"),
        ("'CDT20'", "CDTire"),
    ] {
        let text = changed("FITTYP = 61", &format!("PROPERTY_FILE_FORMAT = {word}"));
        let error = refused(&text);
        let first = "a.tir:10: this is a file of ";
        assert!(error.starts_with(first) && error.contains(name), "{word}: {error}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
    assert!(refused("[MODEL]\nFITTYP = 52\nTYPE = 'MOTORCYCLE'\n").contains("motorcycle"));
    assert!(refused("[UNITS]\nFORCE = 'newton'\n[FTIRE_DATA]\nx = 1\n").contains("FTire"));
}

#[test]
fn line_ends_and_encodings_of_other_machines_are_read_and_told() {
    let like = |bytes: &[u8], words: &str| {
        let (found, messages) = read_bytes(bytes, "a.tir").expect("a tire");
        assert_eq!(found, *tire(TIRE).tire.coefficients());
        assert!(messages.iter().any(|it| it.text.contains(words)), "{words}: {messages:?}");
    };
    like(TIRE.replace('\n', "\r").as_bytes(), "CR alone");
    for (mark, little) in [(true, true), (true, false), (false, true), (false, false)] {
        let units = mark.then_some(0xfeff).into_iter().chain(TIRE.encode_utf16());
        let bytes = |unit: u16| if little { unit.to_le_bytes() } else { unit.to_be_bytes() };
        like(&units.flat_map(bytes).collect::<Vec<_>>(), "UTF-16");
    }
    let by_choice =
        TireSpecification { tir: TIRE.replace('\n', "\r").into(), ..TireSpecification::default() };
    assert!(by_choice.load_tire("tire_f.tir").is_ok());
}

#[test]
fn mistakes_of_one_cause_are_one_sentence() {
    let commas = TIRE.replace("= 0.3\n", "= 0,3\n").replace("1.3\n", "1,3\n").replace("1.1\n", "1,1\n");
    assert_eq!(
        refused(&commas),
        "a.tir:13: UNLOADED_RADIUS has a decimal comma, `0,3` (3 such values): expected a decimal point"
    );
    let words = TIRE.replace("PCY1 = 1.3", "PCY1 = 1.2e3D0").replace("PDY1 = 1.1", "PDY1 = soft");
    assert_eq!(refused(&words), "a.tir:29: PCY1: expected a number, found `1.2e3D0`; likewise PDY1");
    let none = refused(&TIRE.replace('=', ":"));
    assert!(none.contains("found none in 37 lines"), "{none}");
    let binary: Vec<u8> = (0..5000_u32).map(|i| (i * i % 251) as u8).collect();
    let error = read_bytes(&binary, "a.tir").expect_err("no tire").to_string();
    assert!(error.contains("expected the text of a tire property file"), "{error}");
    let twice = tire(&format!("{TIRE}{}", &TIRE[TIRE.find("[LONG").expect("a section")..]));
    let told = twice.told();
    assert_eq!(told.matches("once more").count(), 1, "{told}");
    assert!(told.contains("PCX1, PDX1, PKX1") && told.contains("the last one counts"), "{told}");
    let bare = tire(&format!("{TIRE}PEY1 -0.5\nPEY2 -0.1\n"));
    let words = "skipped, since it is neither `KEY = value` nor a row of numbers: `PEY1 -0.5` and 1 more";
    assert_eq!(bare.warnings(), [words], "{}", bare.told());
    let extra = tire(&format!("{TIRE}PDXP1 = 0.4\nPKYP1 = 1\nELLIPS_ORDER = 1.8\nENV_C1 = 0\nODD = 1\n"));
    for words in [
        "of turn slip, which is not computed: PDXP1, PKYP1",
        "of MF-Swift, which is not computed: ELLIPS_ORDER, ENV_C1",
        "no part of the formula, and kept: ODD",
    ] {
        assert!(extra.told().contains(words), "{words}: {}", extra.told());
    }
}

#[test]
fn comments_and_numbers_of_other_programs_are_read() {
    let text = changed("FNOMIN = 4000", "FNOMIN\t=\t4000 % N")
        .replace("PDY1 = 1.1", "PDY1 = 1.1D0 ! friction")
        .replace("PKY1 = -20", "PKY1=-2.0+001;")
        .replace("PKY2 = 2", "PKY2 = 2 # load");
    let read = tire(&format!("% made by hand\n{text}"));
    read.is_the_tire();
    assert!(read.warnings().is_empty(), "{}", read.told());
}

#[test]
fn a_tire_without_a_force_is_told_by_itself() {
    for (from, name) in [("PKY1 = -20\n", "PKY1"), ("PDY1 = 1.1\n", "PDY1")] {
        let read = tire(&changed(from, ""));
        let words = format!("without {name} (missing or 0) the tire has no lateral force");
        assert!(read.warnings().iter().any(|it| it.starts_with(&words)), "{}", read.told());
        let line = check_plausibility(&read.tire);
        assert!(line.level == TireMessageLevel::Warning && line.text.contains("no cornering"), "{line}");
    }
    let read = tire(&changed("PKX1 = 22\n", "PKX1 = 0\n"));
    assert!(read.warnings()[0].contains("no longitudinal force"), "{}", read.told());
    let read = tire(&changed("PCY1 = 1.3\n", ""));
    assert!(read.warnings()[0].starts_with("PCY1 is missing"), "{}", read.told());
}

#[test]
fn the_keys_of_another_version_have_no_effect_and_are_told() {
    let both = TIRE.replace("FITTYP = 61", "FITTYP = 62") + "PHY3 = 0.5\nPTY1 = 2\nPTX1 = 1\n";
    let read = tire(&both);
    assert!((read.at.C_gamma - tire(TIRE).at.C_gamma).abs() < 1e-6);
    let words = "not used, since MF 6.2 does not know them: PTX1, PHY3, PTY1";
    assert!(read.told().contains(words), "{}", read.told());
    // A converter writes 0 for keys that 5.2 does not know.
    tire(&changed("FITTYP = 61", "FITTYP = 52\nPKY4 = 0")).is_the_tire();
}

#[test]
fn a_number_that_no_tire_has_is_a_warning_of_the_line() {
    let line = |from: &str, to: &str| check_plausibility(&tire(&changed(from, to)).tire);
    for (from, to, words) in [
        ("PDY1 = 1.1", "PDY1 = 133", "lateral friction is 9.58"),
        ("PKY1 = -20", "PKY1 = 20", "cornering stiffness divided by load is -16.0"),
        ("PKY1 = -20", "PKY1 = -20000", "cornering stiffness divided by load is 16000"),
        ("PDX1 = 1.2", "PDX1 = 12", "driving friction is 9.855"),
        ("INFLPRES = 220000", "INFLPRES = 20000", "far from NOMPRES"),
        ("RBX1 = 12", "RBX1 = 12\nKPUMIN = -1\nKPUMAX = 0", "KPUMIN to KPUMAX is -1 to 0, without 0:"),
        ("RBX1 = 12", "RBX1 = 12\nCAMMIN = 0\nCAMMAX = 0.1", "CAMMIN to CAMMAX is 0 to 0.1, without 0:"),
        ("RBX1 = 12", "RBX1 = 12\nFZMAX = 3000", "FZMIN to FZMAX is 0 to 3000, without 4000:"),
    ] {
        let line = line(from, to);
        assert!(line.level == TireMessageLevel::Warning && line.text.contains(words), "{words}: {line}");
    }
    let line = line("PKY6 = -0.9", "PKY6 = 0");
    assert!(line.level == TireMessageLevel::Note && line.text.contains("no camber stiffness"), "{line}");
    let choice = TireSpecification { tir: TIRE.to_owned().into(), LMUY: 9.0, ..TireSpecification::default() };
    let (_, told) = choice.load_tire("tire_f.tir").expect("a tire");
    assert!(
        told[0].level == TireMessageLevel::Warning && told[0].text.starts_with("tire_f.tir: MF 6.1:"),
        "{}",
        told[0]
    );
}
