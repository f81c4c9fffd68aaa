//! Parses clock attributes of FMI 3.0 (sections 2.2.9 and 2.4.7.5.1).

use roxmltree::Node;

use crate::definitions::{describe_node_place, parse_attribute};
use crate::description::{ClockAttributes, IntervalVariability};

/// The ticks of a clock, whose attributes may be those of its declared type.
pub(super) fn parse_clock_attributes<'a>(
    node: Node,
    of: &impl Fn(&str) -> Option<&'a str>,
) -> Result<ClockAttributes, String> {
    clock_attributes_from(of).map_err(|what| format!("{}: {what}", describe_node_place(node)))
}

fn clock_attributes_from<'a>(of: &impl Fn(&str) -> Option<&'a str>) -> Result<ClockAttributes, String> {
    let interval = match of("intervalVariability").map(str::trim) {
        Some("constant") => IntervalVariability::Constant,
        Some("fixed") => IntervalVariability::Fixed,
        Some("calculated") => IntervalVariability::Calculated,
        Some("tunable") => IntervalVariability::Tunable,
        Some("changing") => IntervalVariability::Changing,
        Some("countdown") => IntervalVariability::Countdown,
        // It has to be there; a clock of which nothing is known ticks when somebody says so.
        Some("triggered") | None => IntervalVariability::Triggered,
        Some(word) => {
            return Err(format!("intervalVariability=\"{word}\" of <Clock> is no word of FMI 3.0"));
        }
    };
    let number = |name: &str| -> Result<Option<f64>, String> {
        let wrong = |text| format!("{name}=\"{text}\" of <Clock> is no number from 0 on");
        let text = of(name);
        let found = text.map(|text| text.trim().parse().map_err(|_| wrong(text))).transpose()?;
        match found {
            Some(value) if !(0.0..f64::INFINITY).contains(&value) => Err(wrong(text.unwrap_or_default())),
            found => Ok(found),
        }
    };
    let resolution = number("resolution")?.filter(|resolution| *resolution > 0.0);
    let counted = |name: &str| Ok::<_, String>(number(name)?.zip(resolution).map(|(n, d)| n / d));
    let seconds = number("intervalDecimal")?.or(counted("intervalCounter")?);
    let priority = of("priority").and_then(|text| text.trim().parse().ok());
    if interval == IntervalVariability::Constant && !seconds.is_some_and(|seconds| seconds > 0.0) {
        return Err("a constant <Clock> needs an interval above 0: intervalDecimal, or intervalCounter and resolution"
            .to_owned());
    }
    let shift = number("shiftDecimal")?.or(counted("shiftCounter")?).unwrap_or(0.0);
    Ok(ClockAttributes { interval, seconds: seconds.filter(|seconds| *seconds > 0.0), shift, priority })
}

/// The value references of the clocks of a variable.
pub(super) fn parse_variable_clocks(node: Node) -> Result<Vec<u32>, String> {
    let Some(text) = parse_attribute::<String>(node, "clocks")? else { return Ok(Vec::new()) };
    let numbers = text.split_whitespace().map(str::parse).collect::<Result<_, _>>();
    numbers.map_err(|_| format!("{}: clocks=\"{text}\" is no list of references", describe_node_place(node)))
}
