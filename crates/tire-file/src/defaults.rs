//! Fills missing coefficients, and zeros that cannot be, with default values, and reports each of them.

use tire::{CoefficientKey, Coefficients, KEYS, RANGES};

use crate::TireFileMessage;
use crate::keys::enumerate_names;

/// Without these there is no tire.
const NEEDED: [&str; 2] = ["UNLOADED_RADIUS", "FNOMIN"];

/// Keys that are above 0 or not known: forces and moments do not need them, and converters write 0 where they have none.
const ABOVE_0: [&str; 7] = [
    "LONGVL",
    "INFLPRES",
    "NOMPRES",
    "VERTICAL_STIFFNESS",
    "LONGITUDINAL_STIFFNESS",
    "LATERAL_STIFFNESS",
    "PTY2",
];

/// What a force is made of: shape, friction and stiffness.
const FORCES: [(&str, &str, [&str; 3]); 2] = [
    ("lateral", "cornering", ["PCY1", "PDY1", "PKY1"]),
    ("longitudinal", "driving and braking", ["PCX1", "PDX1", "PKX1"]),
];

/// The keys that a file sets, by their place in [`KEYS`].
pub(crate) struct PresentKeys(pub [bool; KEYS.len()]);

impl PresentKeys {
    pub fn has_key(&self, name: &str) -> bool {
        KEYS.iter().zip(&self.0).any(|(key, given)| *given && key.name == name)
    }
}

/// What there is to tell, of which errors make the file no tire.
#[derive(Default)]
pub(crate) struct MessagesAndErrors {
    pub messages: Vec<TireFileMessage>,
    pub errors: Vec<TireFileMessage>,
}

/// Completes the tire; `given` says which keys the file has.
pub(crate) fn fill_missing_coefficients(
    tire: &mut Coefficients,
    given: &mut PresentKeys,
) -> MessagesAndErrors {
    let mut all = MessagesAndErrors::default();
    all.messages.extend(replace_zeros(tire, given));
    match (given.has_key("INFLPRES"), given.has_key("NOMPRES")) {
        (true, false) => tire.NOMPRES = tire.INFLPRES,
        (false, true) => tire.INFLPRES = tire.NOMPRES,
        _ => {}
    }
    let needed: Vec<_> = NEEDED.into_iter().filter(|name| !given.has_key(name)).collect();
    if !needed.is_empty() {
        let names = needed.join(" and ");
        let text = format!("expected {names}, without which there is no tire, found none");
        all.errors.push(TireFileMessage::warning(None, text));
    }
    all.messages.extend(missing_keys_message(tire, given));
    for (force, use_of_it, [shape, friction, stiffness]) in FORCES {
        let zeros: Vec<_> = [shape, friction, stiffness]
            .into_iter()
            .filter(|name| coefficient_by_name(tire, name) == 0.0)
            .collect();
        if !zeros.is_empty() {
            let text = format!(
                "without {} (missing or 0) the tire has no {force} force: no {use_of_it}",
                zeros.join(", ")
            );
            all.messages.push(TireFileMessage::warning(None, text));
        } else if !given.has_key(shape) {
            let text = format!("{shape} is missing, taken as 1: the {force} force rises without a peak");
            all.messages.push(TireFileMessage::warning(None, text));
        }
    }
    if !["RBX1", "RBY1", "RCX1", "RCY1"].iter().any(|name| given.has_key(name)) {
        let text = "no keys of combined slip (RBX1, RBY1 ...): F_x and F_y do not weaken each other, and together pass the friction ellipse";
        all.messages.push(TireFileMessage::warning(None, text));
    }
    all
}

/// Takes the usual values for keys that cannot be 0, and for empty ranges.
fn replace_zeros(tire: &mut Coefficients, given: &mut PresentKeys) -> Option<TireFileMessage> {
    // Without cornering the load of its largest stiffness means nothing.
    let unused = ["PKY2"].into_iter().filter(|_| tire.PKY1 == 0.0);
    let zero = |name: &&str| coefficient_by_name(tire, name) == 0.0;
    let mut names: Vec<_> = ABOVE_0.into_iter().chain(["PRESMIN"]).chain(unused).filter(zero).collect();
    for (lower, upper) in RANGES {
        if coefficient_by_name(tire, lower) >= coefficient_by_name(tire, upper) {
            names.extend([lower, upper]);
        }
    }
    let mut replaced = Vec::new();
    for (key, given) in KEYS.iter().zip(&mut given.0) {
        if names.contains(&key.name) && std::mem::replace(given, false) {
            replaced.push(format!("{} = {}", key.name, key.get(tire)));
            key.set(tire, key.default);
        }
    }
    let what = enumerate_names(&replaced);
    (!replaced.is_empty())
        .then(|| TireFileMessage::note(None, format!("{what} cannot be: the usual values are taken")))
}

fn coefficient_by_name(tire: &Coefficients, name: &str) -> f64 {
    CoefficientKey::from_name(name).map_or(f64::NAN, |key| key.get(tire))
}

/// One sentence for all keys that are missing: those of the formula first.
fn missing_keys_message(tire: &Coefficients, given: &PresentKeys) -> Option<TireFileMessage> {
    let is_formula = |key: &CoefficientKey| {
        key.section.ends_with("_COEFFICIENTS") && key.section != "SCALING_COEFFICIENTS"
    };
    let (formula, others): (Vec<_>, Vec<_>) = KEYS
        .iter()
        .zip(&given.0)
        .filter(|(key, given)| key.versions.contains(&tire.version) && !**given)
        .map(|(key, _)| key)
        .partition(|key| is_formula(key));
    let count = formula.len() + others.len();
    let values = formula
        .iter()
        .chain(&others)
        .map(|key: &&CoefficientKey| format!("{} = {}", key.name, key.get(tire)));
    let text = format!("{count} keys are missing, taken as {}", enumerate_names(values));
    (count > 0).then(|| TireFileMessage::note(None, text))
}
