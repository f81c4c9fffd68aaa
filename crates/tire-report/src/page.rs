//! Writes the page of one tire, or of two side by side: key figures, and curves over slip, load, camber and pressure.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use askama::Template;
use html_page::{Axis, Class, Markup, Plot};
use tire::{MfTire, Tire};

use crate::NamedTire;
use crate::figures::{Figure, OperatingPoint, digits, figures};

/// Points of a curve, less one.
const POINTS: u32 = 160;

const SIZE: [f64; 2] = [560.0, 340.0];

/// Classes for the curves of one plot.
const CLASSES: [Class; 5] = ["c0", "c1", "c2", "c3", "c4"];

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

/// The page of one tire, or of two side by side: the second with dashes.
#[derive(Template)]
#[template(path = "tires.html")]
struct Page<'a> {
    title: String,
    tires: Vec<&'a NamedTire>,
    rows: Vec<Row>,
    plots: Vec<Markup>,
}

/// A key figure of each tire, and what the second one has more than the first.
struct Row {
    name: String,
    unit: &'static str,
    values: Vec<String>,
    difference: String,
}

/// The page of a tire, with dashes for the second one.
pub fn page(first: &NamedTire, second: Option<&NamedTire>) -> String {
    let tires: Vec<_> = std::iter::once(first).chain(second).collect();
    let columns: Vec<_> = tires.iter().map(|named| figures(&named.tire)).collect();
    let row = |(k, Figure { name, unit, .. }): (usize, &Figure)| {
        let values: Vec<f64> = columns.iter().map(|column| column[k].value).collect();
        let share = values.get(1).map_or(f64::NAN, |second| second / values[0] - 1.0);
        let difference =
            if share.is_finite() { format!("{:+.1} %", 100.0 * share) } else { String::new() };
        Row {
            name: name.clone(),
            unit,
            values: values.into_iter().map(digits).collect(),
            difference,
        }
    };
    let names: Vec<_> = tires.iter().map(|it| it.name.as_str()).collect();
    html_page::render(&Page {
        title: names.join(" and "),
        rows: columns[0].iter().enumerate().map(row).collect(),
        plots: DIAGRAMS.iter().map(|it| plot(it, &tires).figure(it.title)).collect(),
        tires,
    })
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
