//! Maps the keys of a file to coefficients, with the synonyms of other programs, and groups unused keys.

use tire::{CoefficientKey, KEYS, MagicFormulaVersion};

use crate::syntax::{TirEntry, truncate_for_message};

/// Keys by the names that other programs have for them.
const SYNONYMS: [(&str, &str); 13] = [
    ("QRE0", "Q_RE0"),
    ("QV1", "Q_V1"),
    ("LKYG", "LKYC"),
    ("LKZG", "LKZC"),
    ("LKYA", "LKY"),
    ("IP", "INFLPRES"),
    ("IP_NOM", "NOMPRES"),
    ("QPZ1", "PPZ1"),
    ("QPZ2", "PPZ2"),
    ("QPX1", "PPMX1"),
    ("QPFZ1", "PFZ1"),
    ("LFZ0", "LFZO"),
    ("TYRE_RADIUS", "UNLOADED_RADIUS"),
];

/// Sections that say nothing about the formula.
const OTHERS: [&str; 6] = ["MDI_HEADER", "UNITS", "INERTIA", "SHAPE", "MODEL", "DIMENSION"];

/// How many keys a message lists.
const LISTED: usize = 12;

/// Begins of the names of keys that only a model beside the formula uses, and that model.
const BESIDE: [(&str, &[&str]); 2] = [
    ("turn slip", &["PDXP", "PKYP", "PDYP", "PHYP", "PECP", "QDTP", "QCRP", "QBRP", "QDRP", "LMP"]),
    (
        "MF-Swift",
        &[
            "ELLIPS_",
            "ENV_",
            "FREQ_",
            "DAMP_",
            "BELT_",
            "Q_BV",
            "Q_KC",
            "Q_IA",
            "Q_IC",
            "YAW_",
            "GRAVITY",
            "MC_CONTOUR",
            "LCC",
        ],
    ),
];

/// What a key of a file in a version is more than ours: Adams multiplies the rolling resistance of PAC2002 by (F_z / F_z0)^QSY7, MF-Tyre
/// replaces the load by it.
pub(crate) fn key_offset(version: MagicFormulaVersion, key: &str) -> f64 {
    if version == MagicFormulaVersion::Pac2002 && key == "QSY7" { 1.0 } else { 0.0 }
}

/// The key of the formula that an entry sets, with its place in the table.
pub(crate) fn key_of(entry: &TirEntry) -> Option<(usize, &'static CoefficientKey)> {
    // A mass is no unit, and a unit no mass.
    if matches!(entry.section.as_str(), "UNITS" | "MDI_HEADER" | "INERTIA") {
        return None;
    }
    let synonym = SYNONYMS.iter().find(|(other, _)| *other == entry.key);
    let name = synonym.map_or(entry.key.as_str(), |(_, own)| own);
    KEYS.iter().enumerate().find(|(_, key)| key.name == name)
}

/// The name of a key in files of a version.
pub(crate) fn key_in_file(version: MagicFormulaVersion, key: &CoefficientKey) -> &'static str {
    let adams = ["IP", "IP_NOM", "QPZ1", "QPZ2", "QPX1", "QPFZ1"];
    let is_it = |(other, own): &&(&str, &str)| *own == key.name && adams.contains(other);
    let synonym = SYNONYMS.iter().find(is_it).filter(|_| version == MagicFormulaVersion::Pac2002);
    synonym.map_or(key.name, |(other, _)| other)
}

/// A sentence for each kind of keys that the formula does not use, with its first line.
pub(crate) fn unused_keys(unknown: &[&TirEntry]) -> Vec<(usize, String)> {
    let beside = |entry: &TirEntry| {
        BESIDE.iter().position(|(_, begins)| begins.iter().any(|it| entry.key.starts_with(it)))
    };
    let mut kinds: [Vec<&TirEntry>; 3] = Default::default();
    for entry in unknown.iter().filter(|entry| !OTHERS.contains(&entry.section.as_str())) {
        kinds[beside(entry).unwrap_or(BESIDE.len())].push(entry);
    }
    let sentence = |(kind, entries): (usize, Vec<&TirEntry>)| {
        let first = entries.first()?;
        let names = enumerate_names(entries.iter().map(|entry| entry.key.as_str()));
        let what = match BESIDE.get(kind) {
            Some((model, _)) => format!("of {model}, which is not computed"),
            None => "no part of the formula, and kept".to_owned(),
        };
        Some((first.line, format!("{what}: {names}")))
    };
    kinds.into_iter().enumerate().filter_map(sentence).collect()
}

/// Names with commas: the first ones, and how many more there are.
pub(crate) fn enumerate_names<N: AsRef<str>>(names: impl IntoIterator<Item = N>) -> String {
    let mut text = String::new();
    let mut count = 0;
    for name in names {
        if count < LISTED {
            text += if count > 0 { ", " } else { "" };
            text += &truncate_for_message(name.as_ref());
        }
        count += 1;
    }
    if count > LISTED { format!("{text} and {} more", count - LISTED) } else { text }
}
