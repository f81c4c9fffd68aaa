//! Judges the parameters of a car by plausible ranges of each kind of car, and names the likely slip.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;

use serde::{Deserialize, Serialize};
use units::Unit;

/// Parameters that nobody gave count half when the kind of the car is looked for: they are those of another car.
const WEIGHT_OF_DEFAULT: f64 = 0.5;

/// A kind that misses by so much more than the nearest one is not that of the car.
const MISSES_OF_OTHER_KIND: f64 = 1.0;

/// A parameter or an input of an FMU of a car.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CarParameter<'a> {
    /// Its name, such as `body.m`.
    pub name: &'a str,
    /// Its value, in the SI unit of its quantity.
    pub value: f64,
    /// Whether it is another one than that which the FMU starts with.
    pub is_given: bool,
}

/// A sentence for each value that no car of its kind has: value, expected range, what bounds it, and the likely slip. Names that are in no
/// range are passed over, and so are values that nobody gave.
#[must_use]
pub fn implausible_parameters(parameters: &[CarParameter]) -> Vec<String> {
    let ranges = PlausibleRanges::read();
    let kinds = ranges.likely_kinds(parameters);
    let mut implausible = Vec::new();
    let mut sentences = Vec::new();
    // What is made of an implausible parameter says nothing new.
    let (single, made): (Vec<_>, Vec<_>) = ranges.range.iter().partition(|range| !range.names.is_empty());
    for range in single.into_iter().chain(made) {
        for quantity in range.quantities_of(parameters) {
            let Quantity { value, is_given, ref operands, .. } = quantity;
            let follows = range.names.is_empty() && operands.iter().any(|name| implausible.contains(name));
            if !value.is_finite() || follows || !(is_given || range.always) {
                continue;
            }
            if kinds.iter().any(|kind| range.includes(kind, value)) {
                continue;
            }
            implausible.extend(operands.iter().copied());
            sentences.push(ranges.describe(range, &quantity, &kinds));
        }
    }
    sentences
}

/// Says once per drive that the wheels are steered as no car's are; its value at the start is judged with the parameters.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct SteeringMonitor {
    has_warned: bool,
}

impl SteeringMonitor {
    /// Whether this angle of the road wheels [rad] at this time [s] is the first that no car has, with a sentence about it.
    pub fn check(&mut self, time: f64, delta: f64) -> Option<String> {
        // The table, whose reading takes longer than a step, need not be asked of an angle below a quarter of a turn.
        if self.has_warned || delta.abs() < FRAC_PI_2 {
            return None;
        }
        let sentences =
            implausible_parameters(&[CarParameter { name: "delta", value: delta, is_given: true }]);
        self.has_warned = true;
        sentences.first().map(|sentence| format!("at {time:.4} s {sentence}"))
    }
}

/// The form of `plausible_ranges.toml`, which says what each key means.
#[derive(Debug, Default, Deserialize)]
struct PlausibleRanges {
    /// Words for each kind of car.
    kinds: BTreeMap<String, String>,
    range: Vec<PlausibleRange>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct PlausibleRange {
    #[serde(default)]
    names: Vec<String>,
    #[serde(default)]
    product: Vec<String>,
    #[serde(default)]
    over: Vec<String>,
    #[serde(default)]
    sum: Vec<String>,
    #[serde(default)]
    what: String,
    unit: String,
    any: Option<[f64; 2]>,
    race: Option<[f64; 2]>,
    passenger: Option<[f64; 2]>,
    truck: Option<[f64; 2]>,
    small: Option<[f64; 2]>,
    #[serde(default)]
    zero: bool,
    #[serde(default)]
    always: bool,
    #[serde(default)]
    slips: Vec<String>,
    reason: String,
}

/// A value that a range is about.
#[derive(Debug)]
struct Quantity<'a> {
    /// The parameters that it is made of.
    operands: Vec<&'a str>,
    value: f64,
    is_given: bool,
}

impl PlausibleRanges {
    /// The table. It is read for each car: what a library kept for the next one would be lost when it is unloaded.
    fn read() -> Self {
        // That the table can be read is tested. A car without judgement is better than none.
        toml::from_str(include_str!("plausible_ranges.toml")).unwrap_or_default()
    }

    /// The kinds of car that these parameters may be those of: those with the fewest values outside of their ranges.
    fn likely_kinds(&self, parameters: &[CarParameter]) -> Vec<&str> {
        let misses_of = |kind: &str| -> f64 {
            let miss = |range: &PlausibleRange, parameter: &CarParameter| {
                let outside = range.any.is_none() && !range.includes(kind, parameter.value);
                let weight = if parameter.is_given { 1.0 } else { WEIGHT_OF_DEFAULT };
                f64::from(u8::from(outside)) * weight
            };
            let named = |range: &PlausibleRange| -> f64 {
                let own = parameters.iter().filter(|it| range.names.iter().any(|name| name == it.name));
                own.map(|parameter| miss(range, parameter)).sum()
            };
            self.range.iter().map(named).sum()
        };
        let misses: Vec<(&str, f64)> =
            self.kinds.keys().map(|kind| (kind.as_str(), misses_of(kind))).collect();
        let fewest = misses.iter().map(|(_, misses)| *misses).fold(f64::INFINITY, f64::min);
        let likely = misses.into_iter().filter(|(_, misses)| *misses <= fewest + MISSES_OF_OTHER_KIND);
        likely.map(|(kind, _)| kind).collect()
    }

    /// Says that no car of these kinds has this value.
    fn describe(&self, range: &PlausibleRange, quantity: &Quantity, kinds: &[&str]) -> String {
        let Quantity { operands, value, .. } = quantity;
        let unit = if range.unit == "1" { String::new() } else { format!(" {}", range.unit) };
        let what = match (range.what.as_str(), operands.as_slice()) {
            ("", [name]) => format!("`{name}`"),
            (what, operands) => {
                let operands: Vec<_> = operands.iter().map(|name| format!("`{name}`")).collect();
                format!("{what}, of {},", operands.join(", "))
            }
        };
        let span = |[low, high]: [f64; 2]| format!("{low} to {high}{unit}");
        let expected = match range.any {
            Some(bounds) => span(bounds),
            None => {
                let of_kind = |kind: &&str| {
                    let words = self.kinds.get(*kind)?;
                    Some(format!("{} for {words}", span(range.bounds_of(kind)?)))
                };
                kinds.iter().filter_map(of_kind).collect::<Vec<_>>().join(", or ")
            }
        };
        let mut others = self.kinds.iter().filter(|(kind, _)| !kinds.contains(&kind.as_str()));
        let other = match others.find(|(kind, _)| range.includes(kind, *value)) {
            Some((_, words)) => {
                format!("; {words} may have it, but the other parameters are not those of one")
            }
            None => String::new(),
        };
        let slip = match range.likely_slip(*value, kinds) {
            Some((slip, converted)) => {
                let (value, converted) = (rounded(*value), rounded(converted));
                format!(". Is it {value} {slip} = {converted}{unit}?")
            }
            None => String::new(),
        };
        let (value, reason) = (rounded(*value), &range.reason);
        format!("{what} is {value}{unit}, expected {expected} ({reason}){other}{slip}")
    }
}

impl PlausibleRange {
    /// The range of a kind of car.
    fn bounds_of(&self, kind: &str) -> Option<[f64; 2]> {
        let own = match kind {
            "race" => self.race,
            "passenger" => self.passenger,
            "truck" => self.truck,
            "small" => self.small,
            _ => None,
        };
        own.or(self.any)
    }

    fn includes(&self, kind: &str, value: f64) -> bool {
        let inside = |[low, high]: [f64; 2]| (low..=high).contains(&value);
        (self.zero && value == 0.0) || self.bounds_of(kind).is_none_or(inside)
    }

    /// What of these parameters the range is about.
    fn quantities_of<'a>(&self, parameters: &'a [CarParameter]) -> Vec<Quantity<'a>> {
        let find = |name: &String| parameters.iter().find(|it| it.name == name);
        if !self.names.is_empty() {
            let own = self.names.iter().filter_map(find);
            let quantity = |it: &CarParameter<'a>| Quantity {
                operands: vec![it.name],
                value: it.value,
                is_given: it.is_given,
            };
            return own.map(quantity).collect();
        }
        let all = |names: &[String]| names.iter().map(find).collect::<Option<Vec<&CarParameter>>>();
        let (Some(factors), Some(divisors), Some(summands)) =
            (all(&self.product), all(&self.over), all(&self.sum))
        else {
            return Vec::new();
        };
        let product = |list: &[&CarParameter]| list.iter().map(|it| it.value).product::<f64>();
        let value = match summands.is_empty() {
            true => product(&factors) / product(&divisors),
            false => summands.iter().map(|it| it.value).sum(),
        };
        let operands: Vec<_> = factors.into_iter().chain(divisors).chain(summands).collect();
        vec![Quantity {
            is_given: operands.iter().any(|it| it.is_given),
            operands: operands.iter().map(|it| it.name).collect(),
            value,
        }]
    }

    /// The unit that the value was probably given in, and the value in the unit of the range: the first one that makes it plausible.
    fn likely_slip(&self, value: f64, kinds: &[&str]) -> Option<(&str, f64)> {
        let unit = Unit::parse(&self.unit).ok()?;
        self.slips.iter().find_map(|slip| {
            let (scale, offset) = Unit::conversion(&Unit::parse(slip).ok()?, &unit)?;
            let converted = scale * value + offset;
            let plausible = kinds.iter().any(|kind| self.includes(kind, converted));
            plausible.then_some((slip.as_str(), converted))
        })
    }
}

/// Four digits, as many as a person compares; a value that has fewer stays as it is.
fn rounded(value: f64) -> f64 {
    if value == 0.0 {
        return value;
    }
    let digits = 3 - value.abs().log10().floor() as i32;
    let scale = 10_f64.powi(digits.clamp(0, 15));
    (value * scale).round() / scale
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steering_in_degrees_is_told_once() {
        let mut monitor = SteeringMonitor::default();
        assert_eq!(monitor.check(0.0, 0.6), None);
        let sentence = monitor.check(1.0, -20.0).expect("no car steers so");
        assert!(
            sentence.starts_with("at 1.0000 s `delta` is -20 rad, expected -1.6 to 1.6 rad"),
            "{sentence}"
        );
        assert!(sentence.ends_with("Is it -20 deg = -0.3491 rad?"), "{sentence}");
        assert_eq!(monitor.check(2.0, 20.0), None);
    }

    /// The demo car with these parameters given.
    fn judged(given: &[(&'static str, f64)]) -> Vec<String> {
        let demo = [
            ("body.m", 780.0),
            ("body.I_zz", 1000.0),
            ("body.l_f", 1.4),
            ("body.l_r", 1.6),
            ("body.h", 0.35),
            ("aero.area", 1.5),
            ("tire_f.B", 12.0),
            ("tire_f.C", 1.4),
            ("tire_f.D", 1.1),
            ("limit.delta", 0.5),
            ("start.v_x", 20.0),
        ];
        let parameters = demo.map(|(name, value)| {
            let given = given.iter().find(|it| it.0 == name);
            CarParameter { name, value: given.map_or(value, |it| it.1), is_given: given.is_some() }
        });
        implausible_parameters(&parameters)
    }

    #[test]
    fn slips_are_told_with_value_bounds_reason_and_the_unit_that_was_meant() {
        for (given, expected) in [
            (
                ("body.l_f", 1600.0),
                "`body.l_f` is 1600 m, expected 0.6 to 2.8 m for a passenger car, or 0.4 to 2.6 m for a formula or race car",
            ),
            (("body.l_f", 1600.0), "Is it 1600 mm = 1.6 m?"),
            (("body.m", 780_000.0), "Is it 780000 g = 780 kg?"),
            (("body.m", 0.78), "Is it 0.78 t = 780 kg?"),
            (("limit.delta", 30.0), "Is it 30 deg = 0.5236 rad?"),
            (("start.v_x", 200.0), "Is it 200 km/h = 55.56 m/s?"),
            (
                ("body.I_zz", 100.0),
                "yaw inertia over m l_f l_r, of `body.I_zz`, `body.m`, `body.l_f`, `body.l_r`, is 0.05723, expected",
            ),
            (
                ("tire_f.B", 0.2),
                "B C D, of `tire_f.B`, `tire_f.C`, `tire_f.D`, is 0.308 1/rad, expected 2 to 100 1/rad",
            ),
            (("tire_f.D", 4000.0), "`tire_f.D` is 4000, expected 0.1 to 3 (peak friction"),
            (("tire_f.D", 0.05), "`tire_f.D` is 0.05, expected 0.1 to 3"),
            (
                ("body.h", 0.17),
                "`body.h` is 0.17 m, expected 0.3 to 1 m for a passenger car, or 0.2 to 0.65 m for a formula or race car",
            ),
            (
                ("body.h", 0.17),
                "; a small-scale car may have it, but the other parameters are not those of one",
            ),
        ] {
            let told = judged(&[given]);
            assert!(told.len() == 1 && told[0].contains(expected), "{given:?}: {told:#?}");
        }
    }

    #[test]
    fn cars_of_each_kind_are_plausible_and_what_nobody_gave_is_not_judged() {
        let car = |m, inertia, l_f, l_r, h, area| {
            [
                ("body.m", m),
                ("body.I_zz", inertia),
                ("body.l_f", l_f),
                ("body.l_r", l_r),
                ("body.h", h),
                ("aero.area", area),
            ]
        };
        for (name, car) in [
            ("the demo car", [("body.m", 780.0); 6]),
            ("Formula Student", car(270.0, 110.0, 0.80, 0.75, 0.28, 1.1)),
            ("Formula 1", car(680.0, 577.4, 1.7, 1.4, 0.25, 1.5)),
            ("a sedan of CommonRoad", car(1093.3, 1791.6, 1.156, 1.4227, 0.574, 2.2)),
            ("a large pick-up", car(4100.0, 8500.0, 1.75, 1.7, 0.8, 3.8)),
            ("a truck of two axles", car(16_000.0, 95_000.0, 3.2, 2.0, 1.3, 8.0)),
            ("F1TENTH", car(3.74, 0.04712, 0.15875, 0.17145, 0.074, 0.05)),
            ("DART, 1:10", car(1.58, 0.00481, 0.0805, 0.093, 0.0, 0.0)),
        ] {
            assert_eq!(judged(&car), Vec::<String>::new(), "{name}");
        }
        // The frontal area of a full-size car brakes a small one: it is told though nobody gave it.
        let told = judged(&car(3.74, 0.04712, 0.15875, 0.17145, 0.074, 0.05)[..5]);
        assert!(told.len() == 1 && told[0].contains("`aero.area` is 1.5 m2"), "{told:?}");
        let parameters = [CarParameter { name: "body.l_f", value: 1600.0, is_given: false }];
        assert_eq!(implausible_parameters(&parameters), Vec::<String>::new());
    }

    #[test]
    fn the_table_is_whole() {
        let table: PlausibleRanges =
            toml::from_str(include_str!("plausible_ranges.toml")).expect("the table");
        for range in &table.range {
            let unit = Unit::parse(&range.unit).expect("a unit");
            for slip in &range.slips {
                let slip = Unit::parse(slip).unwrap_or_else(|error| panic!("{error}"));
                assert!(slip.same_dimension(&unit), "{range:?}");
            }
            let bounds: Vec<_> = table.kinds.keys().map(|kind| range.bounds_of(kind)).collect();
            assert!(bounds.iter().flatten().all(|[low, high]| low < high), "{range:?}");
            assert!(bounds.iter().all(Option::is_some) && !range.reason.is_empty(), "{range:?}");
            let forms = [&range.names, &range.product, &range.sum].map(|it| u8::from(!it.is_empty()));
            assert!(
                forms.iter().sum::<u8>() == 1 && (range.what.is_empty() != range.names.is_empty()),
                "{range:?}"
            );
        }
    }
}
