//! Writes the page of one tire, or of two side by side: key figures, and curves over slip, load, camber and pressure.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use html_page::{Axis, Class, Plot, escape};
use tire::{MfTire, Tire};

use crate::NamedTire;
use crate::figures::{OperatingPoint, digits, figures};

/// Points of a curve, less one.
const POINTS: u32 = 160;

const SIZE: [f64; 2] = [560.0, 340.0];

/// Classes for the curves of one plot.
const CLASSES: [Class; 5] = ["c0", "c1", "c2", "c3", "c4"];

const STYLE: &str = "td.number { text-align: right; }\n";

type Points = Vec<(f64, f64)>;

/// One curve of a tire.
struct Curve {
    name: String,
    points: Points,
}

/// What a plot shows of a tire.
struct Diagram {
    title: &'static str,
    x: &'static str,
    y: &'static str,
    of: fn(&MfTire) -> Vec<Curve>,
}

const DIAGRAMS: [Diagram; 9] = [
    Diagram {
        title: "Lateral force over slip angle, by load",
        x: "slip angle [deg]",
        y: "F_y [kN]",
        of: lateral,
    },
    Diagram {
        title: "Longitudinal force over slip, by load",
        x: "slip [%]",
        y: "F_x [kN]",
        of: longitudinal,
    },
    Diagram {
        title: "Aligning moment over slip angle, by load",
        x: "slip angle [deg]",
        y: "M_z [N m]",
        of: aligning,
    },
    Diagram {
        title: "Friction ellipse at nominal load, by slip angle",
        x: "F_y [kN]",
        y: "F_x [kN]",
        of: ellipse,
    },
    Diagram {
        title: "Lateral force in combined slip",
        x: "slip angle [deg]",
        y: "F_y [kN]",
        of: lateral_combined,
    },
    Diagram {
        title: "Longitudinal force in combined slip",
        x: "slip [%]",
        y: "F_x [kN]",
        of: longitudinal_combined,
    },
    Diagram {
        title: "Lateral force over slip angle, by camber",
        x: "slip angle [deg]",
        y: "F_y [kN]",
        of: camber,
    },
    Diagram {
        title: "Cornering stiffness over load, by pressure",
        x: "load [kN]",
        y: "cornering stiffness [kN/rad]",
        of: stiffness,
    },
    Diagram { title: "Peak friction over load", x: "load [kN]", y: "friction [1]", of: friction },
];

fn points(from: f64, to: f64, y: impl Fn(f64) -> f64) -> Points {
    let x = |i: u32| from + (to - from) * f64::from(i) / f64::from(POINTS);
    (0..=POINTS).map(|i| (x(i), y(x(i)))).collect()
}

fn loads(tire: &MfTire) -> impl Iterator<Item = (String, OperatingPoint<'_>)> {
    [0.5, 1.0, 1.5, 2.0].into_iter().map(move |share| {
        let at = OperatingPoint::nominal(tire, share);
        (format!("{:.1} kN", at.F_z / 1e3), at)
    })
}

fn lateral(tire: &MfTire) -> Vec<Curve> {
    let of = |(name, at): (String, OperatingPoint)| {
        let y = |alpha: f64| at.F_y(0.0, alpha.to_radians(), 0.0) / 1e3;
        Curve { name, points: points(-15.0, 15.0, y) }
    };
    loads(tire).map(of).collect()
}

fn longitudinal(tire: &MfTire) -> Vec<Curve> {
    let of = |(name, at): (String, OperatingPoint)| Curve {
        name,
        points: points(-30.0, 30.0, |kappa| at.F_x(kappa / 100.0, 0.0) / 1e3),
    };
    loads(tire).map(of).collect()
}

fn aligning(tire: &MfTire) -> Vec<Curve> {
    let of = |(name, at): (String, OperatingPoint)| {
        let y = |alpha: f64| tire.forces(&at.slip(0.0, alpha.to_radians(), 0.0)).M_z;
        Curve { name, points: points(-15.0, 15.0, y) }
    };
    loads(tire).map(of).collect()
}

fn ellipse(tire: &MfTire) -> Vec<Curve> {
    let at = OperatingPoint::nominal(tire, 1.0);
    let of = |alpha: f64| {
        let point = |kappa: f64| {
            let [F_x, F_y] = tire.F_xy(&at.slip(kappa, -alpha.to_radians(), 0.0));
            (F_y / 1e3, F_x / 1e3)
        };
        // Small slips lie closer to each other.
        let slip = |i: u32| (f64::from(i) / f64::from(POINTS) * 2.0 - 1.0).powi(3);
        Curve {
            name: format!("{alpha} deg"),
            points: (0..=POINTS).map(|i| point(slip(i))).collect(),
        }
    };
    [0.0, 2.0, 4.0, 7.0, 12.0].into_iter().map(of).collect()
}

fn lateral_combined(tire: &MfTire) -> Vec<Curve> {
    let at = OperatingPoint::nominal(tire, 1.0);
    let of = |kappa: f64| {
        let y = |alpha: f64| at.F_y(kappa / 100.0, alpha.to_radians(), 0.0) / 1e3;
        Curve { name: format!("slip {kappa} %"), points: points(-15.0, 15.0, y) }
    };
    [0.0, 3.0, -3.0, -8.0, -15.0].into_iter().map(of).collect()
}

fn longitudinal_combined(tire: &MfTire) -> Vec<Curve> {
    let at = OperatingPoint::nominal(tire, 1.0);
    let of = |alpha: f64| {
        let y = |kappa: f64| at.F_x(kappa / 100.0, alpha.to_radians()) / 1e3;
        Curve { name: format!("{alpha} deg"), points: points(-30.0, 30.0, y) }
    };
    [0.0, 2.0, 4.0, 7.0, 12.0].into_iter().map(of).collect()
}

fn camber(tire: &MfTire) -> Vec<Curve> {
    let at = OperatingPoint::nominal(tire, 1.0);
    let of = |gamma: f64| {
        let y = |alpha: f64| at.F_y(0.0, alpha.to_radians(), gamma.to_radians()) / 1e3;
        Curve { name: format!("{gamma} deg"), points: points(-10.0, 10.0, y) }
    };
    [-4.0, -2.0, 0.0, 2.0, 4.0].into_iter().map(of).collect()
}

fn stiffness(tire: &MfTire) -> Vec<Curve> {
    let nominal = OperatingPoint::nominal(tire, 1.0);
    let of = |share: f64| {
        let pressure = share * nominal.pressure;
        let y = |load: f64| {
            let at = OperatingPoint { F_z: load * 1e3, pressure, ..nominal };
            -tire.details(&at.slip(0.0, 0.0, 0.0)).1.K_ya / 1e3
        };
        Curve {
            name: format!("{:.0} kPa", pressure / 1e3),
            points: points(0.0, 2.0 * nominal.F_z / 1e3, y),
        }
    };
    [0.85, 1.0, 1.15].into_iter().map(of).collect()
}

fn friction(tire: &MfTire) -> Vec<Curve> {
    let nominal = OperatingPoint::nominal(tire, 1.0);
    let of = |(name, axis): (&str, usize)| {
        let y = |load: f64| {
            let at = OperatingPoint { F_z: load * 1e3, ..nominal };
            tire.details(&at.slip(0.0, 0.0, 0.0)).1.mu[axis].abs()
        };
        Curve {
            name: name.to_owned(),
            points: points(0.1 * nominal.F_z / 1e3, 2.0 * nominal.F_z / 1e3, y),
        }
    };
    [("longitudinal", 0), ("lateral", 1)].into_iter().map(of).collect()
}

/// The page of a tire, with dashes for the second one.
pub fn page(first: &NamedTire, second: Option<&NamedTire>) -> String {
    let both: Vec<_> = std::iter::once(first).chain(second).collect();
    let mut body = String::new();
    for (place, named) in both.iter().enumerate() {
        let line = if place == 0 { "lines" } else { "dashes" };
        let version = named.tire.coefficients().version;
        let of = if both.len() > 1 { format!(" ({line})") } else { String::new() };
        body += &format!("<p><b>{}</b>{of}, {version}, ISO-W axes</p>\n", escape(&named.name));
    }
    body += &table(&both);
    body += "<div class=\"grid two\">\n";
    for diagram in &DIAGRAMS {
        body += &plot(diagram, &both).figure(diagram.title);
    }
    body += "</div>\n";
    for named in &both {
        if named.messages.is_empty() {
            continue;
        }
        let name = escape(&named.name);
        body += &format!("<h2>What reading {name} told</h2>\n<ul>\n");
        for message in &named.messages {
            body += &format!("<li>{}</li>\n", escape(message));
        }
        body += "</ul>\n";
    }
    let names: Vec<_> = both.iter().map(|named| named.name.as_str()).collect();
    html_page::page(&names.join(" and "), STYLE, &body)
}

fn plot(diagram: &Diagram, both: &[&NamedTire]) -> Plot {
    let curves: Vec<_> = both.iter().map(|named| (diagram.of)(&named.tire)).collect();
    let all = || curves.iter().flatten().flat_map(|curve| &curve.points);
    let x = Axis::about(diagram.x, all().map(|point| point.0));
    let y = Axis::about(diagram.y, all().map(|point| point.1));
    let mut plot = Plot::new(SIZE, x, y);
    for (place, curves) in curves.iter().enumerate() {
        for (curve, class) in curves.iter().zip(CLASSES) {
            match place {
                0 => plot.line(&curve.points, class, &curve.name),
                _ => plot.dashes(&curve.points, class, ""),
            }
        }
    }
    plot
}

fn table(both: &[&NamedTire]) -> String {
    let columns: Vec<_> = both.iter().map(|named| figures(&named.tire)).collect();
    let mut html = String::from("<table>\n<tr><th></th>");
    for named in both {
        html += &format!("<th>{}</th>", escape(&named.name));
    }
    let compares = columns.len() > 1;
    html += if compares { "<th>difference</th><th></th></tr>\n" } else { "<th></th></tr>\n" };
    for (row, figure) in columns[0].iter().enumerate() {
        html += &format!("<tr><td>{}</td>", escape(&figure.name));
        for column in &columns {
            html += &format!("<td class=\"number\">{}</td>", digits(column[row].value));
        }
        if compares {
            let (a, b) = (figure.value, columns[1][row].value);
            let share = (b - a) / a * 100.0;
            let share = if share.is_finite() { format!("{share:+.1} %") } else { String::new() };
            html += &format!("<td class=\"number\">{share}</td>");
        }
        html += &format!("<td>{}</td></tr>\n", figure.unit);
    }
    html + "</table>\n"
}
