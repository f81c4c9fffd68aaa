//! Refuses numbers that no road has, before a reader works with them: lanes wider than any, and coefficients of a line without bounds.

use std::borrow::Cow;

use roxmltree::{Document, Node};

use crate::Error;

/// Widest lane [m].
const WIDEST: f64 = 1000.0;
/// Largest coordinate or coefficient of a line.
const LARGEST: f64 = 1e9;
/// Longest stretch over which a width is looked at [m].
const LONGEST: f64 = 1e5;

/// Checks the coefficients of all lines and the width of each lane, as far as they are numbers.
///
/// # Errors
/// With the line of the file, when a number is too large or a lane may become too wide; when the text is no XML.
pub fn check_roads(text: &str) -> Result<(), Error> {
    let text = without_declaration(text);
    let document = Document::parse(&text).map_err(|error| Error::File(format!("expected XML: {error}")))?;
    for road in document.descendants().filter(|node| node.has_tag_name("road")) {
        for line in road.children().filter(|node| node.has_tag_name("planView")) {
            line.descendants().try_for_each(check_coefficients)?;
        }
        let sections: Vec<Node> =
            road.descendants().filter(|node| node.has_tag_name("laneSection")).collect();
        let starts: Vec<f64> = sections.iter().map(|section| number(*section, "s")).collect();
        for (section, start) in sections.iter().zip(&starts) {
            let end = next_above(&starts, *start).unwrap_or(number(road, "length"));
            for lane in section.descendants().filter(|node| node.has_tag_name("lane")) {
                check_lane(lane, end - start)?;
            }
        }
    }
    Ok(())
}

/// The text with blanks in place of the declaration of XML, which simulators write behind a comment, where XML allows none.
fn without_declaration(text: &str) -> Cow<'_, str> {
    let begin = text.find("<?xml").filter(|begin| !text[..*begin].contains("<OpenDRIVE"));
    match begin.and_then(|begin| Some([begin, begin + text[begin..].find("?>")? + 2])) {
        Some([begin, end]) => {
            Cow::Owned(format!("{}{}{}", &text[..begin], " ".repeat(end - begin), &text[end..]))
        }
        None => Cow::Borrowed(text),
    }
}

fn check_coefficients(node: Node) -> Result<(), Error> {
    match node.attributes().find(|it| number(node, it.name()).abs() > LARGEST) {
        None => Ok(()),
        Some(attribute) => Err(Error::File(format!(
            "line {}: expected a number of at most {LARGEST:e} for `{}`, found {}",
            line_of(node),
            attribute.name(),
            attribute.value()
        ))),
    }
}

fn line_of(node: Node) -> u32 {
    node.document().text_pos_at(node.range().start).row
}

/// Checks the records of a lane on a section of this length [m]; each holds to the next one.
fn check_lane(lane: Node, length: f64) -> Result<(), Error> {
    let records: Vec<Node> =
        lane.children().filter(|node| node.has_tag_name("width") || node.has_tag_name("border")).collect();
    let offsets: Vec<f64> = records.iter().map(|record| number(*record, "sOffset")).collect();
    for (record, offset) in records.iter().zip(&offsets) {
        let reach = (next_above(&offsets, *offset).unwrap_or(length) - offset).clamp(0.0, LONGEST);
        let coefficients = ["a", "b", "c", "d"].map(|name| number(*record, name).abs());
        let widest = coefficients.iter().rev().fold(0.0, |sum, it| sum * reach + it);
        if widest > WIDEST {
            let line = line_of(*record);
            return Err(Error::File(format!(
                "line {line}: expected a lane of at most {WIDEST} m, found one of up to {widest:.3e} m over {reach:.0} m"
            )));
        }
    }
    Ok(())
}

/// The nearest number above this one.
fn next_above(numbers: &[f64], from: f64) -> Option<f64> {
    numbers.iter().copied().filter(|it| *it > from).min_by(f64::total_cmp)
}

/// An attribute as a number; 0 where it is none, as the reader has it.
fn number(node: Node, name: &str) -> f64 {
    let value = node.attribute(name).and_then(|text| text.trim().parse().ok());
    value.filter(|it: &f64| it.is_finite()).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widths_and_coefficients_of_no_road_are_refused_with_their_line() {
        let road = |width: &str, next: &str, x: &str| {
            format!(
                "<OpenDRIVE><road length=\"500\"><planView><geometry s=\"0\" x=\"{x}\" length=\"500\"/></planView>\n\
                 <lanes><laneSection s=\"0\"><right><lane id=\"-1\">\n{width}\n{next}\n</lane></right></laneSection></lanes></road></OpenDRIVE>"
            )
        };
        let wide = "<width sOffset=\"0\" a=\"3\" b=\"0\" c=\"0.01\" d=\"0\"/>";
        let next = "<width sOffset=\"20\" a=\"7\" b=\"0\" c=\"0\" d=\"0\"/>";
        // It widens by 4 m until the next record, and by 2.5 km without one.
        assert_eq!(check_roads(&road(wide, next, "0")), Ok(()));
        let error = check_roads(&road(wide, "", "0")).expect_err("too wide").to_string();
        assert_eq!(
            error,
            "line 3: expected a lane of at most 1000 m, found one of up to 2.503e3 m over 500 m"
        );
        let error = check_roads(&road(next, "", "1e308")).expect_err("too far").to_string();
        assert_eq!(error, "line 1: expected a number of at most 1e9 for `x`, found 1e308");
        let with_licence = format!("<!-- licence -->\n<?xml version=\"1.0\"?>\n{}", road(next, "", "0"));
        assert_eq!(check_roads(&with_licence), Ok(()));
        assert!(check_roads("<road").expect_err("no XML").to_string().starts_with("expected XML"));
    }
}
