//! Writes the page of one tire, or of two side by side: key figures, and curves over slip, load, camber and pressure.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use askama::Template;
use html_page::{CssClass, Markup, Plot, PlotAxis};
use tire::{MfTire, Tire};

use crate::NamedTire;
use crate::figures::{KeyFigure, TireLoadCase, format_four_digits, key_figures};

/// Points of a curve, less one.
const POINTS: u32 = 160;

const SIZE: [f64; 2] = [560.0, 340.0];

/// Classes for the curves of one plot.
const CLASSES: [CssClass; 5] = ["c0", "c1", "c2", "c3", "c4"];

type PlotPoints = Vec<(f64, f64)>;

/// One curve of a tire.
struct TireCurve {
    name: String,
    points: PlotPoints,
}

/// What a plot shows of a tire.
struct TireDiagram {
    title: &'static str,
    x: &'static str,
    y: &'static str,
    of: fn(&MfTire) -> Vec<TireCurve>,
}

const DIAGRAMS: [TireDiagram; 9] = [
    TireDiagram {
        title: "Lateral force over slip angle, by load",
        x: "slip angle [deg]",
        y: "F_y [kN]",
        of: lateral_force_curves,
    },
    TireDiagram {
        title: "Longitudinal force over slip, by load",
        x: "slip [%]",
        y: "F_x [kN]",
        of: longitudinal_force_curves,
    },
    TireDiagram {
        title: "Aligning moment over slip angle, by load",
        x: "slip angle [deg]",
        y: "M_z [N m]",
        of: aligning_moment_curves,
    },
    TireDiagram {
        title: "Friction ellipse at nominal load, by slip angle",
        x: "F_y [kN]",
        y: "F_x [kN]",
        of: friction_ellipse_curves,
    },
    TireDiagram {
        title: "Lateral force in combined slip",
        x: "slip angle [deg]",
        y: "F_y [kN]",
        of: lateral_combined,
    },
    TireDiagram {
        title: "Longitudinal force in combined slip",
        x: "slip [%]",
        y: "F_x [kN]",
        of: longitudinal_combined,
    },
    TireDiagram {
        title: "Lateral force over slip angle, by camber",
        x: "slip angle [deg]",
        y: "F_y [kN]",
        of: lateral_force_camber_curves,
    },
    TireDiagram {
        title: "Cornering stiffness over load, by pressure",
        x: "load [kN]",
        y: "cornering stiffness [kN/rad]",
        of: cornering_stiffness_curves,
    },
    TireDiagram {
        title: "Peak friction over load",
        x: "load [kN]",
        y: "friction [1]",
        of: peak_friction_curves,
    },
];

fn sample_curve(from: f64, to: f64, y: impl Fn(f64) -> f64) -> PlotPoints {
    let x = |i: u32| from + (to - from) * f64::from(i) / f64::from(POINTS);
    (0..=POINTS).map(|i| (x(i), y(x(i)))).collect()
}

fn operating_points_by_load(tire: &MfTire) -> impl Iterator<Item = (String, TireLoadCase<'_>)> {
    [0.5, 1.0, 1.5, 2.0].into_iter().map(move |share| {
        let at = TireLoadCase::at_nominal_load_share(tire, share);
        (format!("{:.1} kN", at.F_z / 1e3), at)
    })
}

fn lateral_force_curves(tire: &MfTire) -> Vec<TireCurve> {
    let of = |(name, at): (String, TireLoadCase)| {
        let y = |alpha: f64| at.F_y(0.0, alpha.to_radians(), 0.0) / 1e3;
        TireCurve { name, points: sample_curve(-15.0, 15.0, y) }
    };
    operating_points_by_load(tire).map(of).collect()
}

fn longitudinal_force_curves(tire: &MfTire) -> Vec<TireCurve> {
    let of = |(name, at): (String, TireLoadCase)| TireCurve {
        name,
        points: sample_curve(-30.0, 30.0, |kappa| at.F_x(kappa / 100.0, 0.0) / 1e3),
    };
    operating_points_by_load(tire).map(of).collect()
}

fn aligning_moment_curves(tire: &MfTire) -> Vec<TireCurve> {
    let of = |(name, at): (String, TireLoadCase)| {
        let y = |alpha: f64| tire.forces(&at.slip_state(0.0, alpha.to_radians(), 0.0)).M_z;
        TireCurve { name, points: sample_curve(-15.0, 15.0, y) }
    };
    operating_points_by_load(tire).map(of).collect()
}

fn friction_ellipse_curves(tire: &MfTire) -> Vec<TireCurve> {
    let at = TireLoadCase::at_nominal_load_share(tire, 1.0);
    let of = |alpha: f64| {
        let point = |kappa: f64| {
            let [F_x, F_y] = tire.F_xy(&at.slip_state(kappa, -alpha.to_radians(), 0.0));
            (F_y / 1e3, F_x / 1e3)
        };
        // Small slips lie closer to each other.
        let slip = |i: u32| (f64::from(i) / f64::from(POINTS) * 2.0 - 1.0).powi(3);
        TireCurve { name: format!("{alpha} deg"), points: (0..=POINTS).map(|i| point(slip(i))).collect() }
    };
    [0.0, 2.0, 4.0, 7.0, 12.0].into_iter().map(of).collect()
}

fn lateral_combined(tire: &MfTire) -> Vec<TireCurve> {
    let at = TireLoadCase::at_nominal_load_share(tire, 1.0);
    let of = |kappa: f64| {
        let y = |alpha: f64| at.F_y(kappa / 100.0, alpha.to_radians(), 0.0) / 1e3;
        TireCurve { name: format!("slip {kappa} %"), points: sample_curve(-15.0, 15.0, y) }
    };
    [0.0, 3.0, -3.0, -8.0, -15.0].into_iter().map(of).collect()
}

fn longitudinal_combined(tire: &MfTire) -> Vec<TireCurve> {
    let at = TireLoadCase::at_nominal_load_share(tire, 1.0);
    let of = |alpha: f64| {
        let y = |kappa: f64| at.F_x(kappa / 100.0, alpha.to_radians()) / 1e3;
        TireCurve { name: format!("{alpha} deg"), points: sample_curve(-30.0, 30.0, y) }
    };
    [0.0, 2.0, 4.0, 7.0, 12.0].into_iter().map(of).collect()
}

fn lateral_force_camber_curves(tire: &MfTire) -> Vec<TireCurve> {
    let at = TireLoadCase::at_nominal_load_share(tire, 1.0);
    let of = |gamma: f64| {
        let y = |alpha: f64| at.F_y(0.0, alpha.to_radians(), gamma.to_radians()) / 1e3;
        TireCurve { name: format!("{gamma} deg"), points: sample_curve(-10.0, 10.0, y) }
    };
    [-4.0, -2.0, 0.0, 2.0, 4.0].into_iter().map(of).collect()
}

fn cornering_stiffness_curves(tire: &MfTire) -> Vec<TireCurve> {
    let nominal = TireLoadCase::at_nominal_load_share(tire, 1.0);
    let of = |share: f64| {
        let pressure = share * nominal.pressure;
        let y = |load: f64| {
            let at = TireLoadCase { F_z: load * 1e3, pressure, ..nominal };
            -tire.forces_and_details(&at.slip_state(0.0, 0.0, 0.0)).1.K_ya / 1e3
        };
        TireCurve {
            name: format!("{:.0} kPa", pressure / 1e3),
            points: sample_curve(0.0, 2.0 * nominal.F_z / 1e3, y),
        }
    };
    [0.85, 1.0, 1.15].into_iter().map(of).collect()
}

fn peak_friction_curves(tire: &MfTire) -> Vec<TireCurve> {
    let nominal = TireLoadCase::at_nominal_load_share(tire, 1.0);
    let of = |(name, axis): (&str, usize)| {
        let y = |load: f64| {
            let at = TireLoadCase { F_z: load * 1e3, ..nominal };
            tire.forces_and_details(&at.slip_state(0.0, 0.0, 0.0)).1.mu[axis].abs()
        };
        TireCurve {
            name: name.to_owned(),
            points: sample_curve(0.1 * nominal.F_z / 1e3, 2.0 * nominal.F_z / 1e3, y),
        }
    };
    [("longitudinal", 0), ("lateral", 1)].into_iter().map(of).collect()
}

/// The page of one tire, or of two side by side: the second with dashes.
#[derive(Template)]
#[template(path = "tires.html")]
struct TirePage<'a> {
    title: String,
    tires: Vec<&'a NamedTire>,
    rows: Vec<KeyFigureRow>,
    plots: Vec<Markup>,
}

/// A key figure of each tire, and what the second one has more than the first.
struct KeyFigureRow {
    name: String,
    unit: &'static str,
    values: Vec<String>,
    difference: String,
}

/// The page of a tire, with dashes for the second one.
pub fn tire_page(first: &NamedTire, second: Option<&NamedTire>) -> String {
    let tires: Vec<_> = std::iter::once(first).chain(second).collect();
    let columns: Vec<_> = tires.iter().map(|named| key_figures(&named.tire)).collect();
    let row = |(k, KeyFigure { name, unit, .. }): (usize, &KeyFigure)| {
        let values: Vec<f64> = columns.iter().map(|column| column[k].value).collect();
        let share = values.get(1).map_or(f64::NAN, |second| second / values[0] - 1.0);
        let difference = if share.is_finite() { format!("{:+.1} %", 100.0 * share) } else { String::new() };
        KeyFigureRow {
            name: name.clone(),
            unit,
            values: values.into_iter().map(format_four_digits).collect(),
            difference,
        }
    };
    let names: Vec<_> = tires.iter().map(|it| it.name.as_str()).collect();
    html_page::render_page(&TirePage {
        title: names.join(" and "),
        rows: columns[0].iter().enumerate().map(row).collect(),
        plots: DIAGRAMS.iter().map(|it| tire_plot(it, &tires).figure_with_legend(it.title)).collect(),
        tires,
    })
}

fn tire_plot(diagram: &TireDiagram, both: &[&NamedTire]) -> Plot {
    let curves: Vec<_> = both.iter().map(|named| (diagram.of)(&named.tire)).collect();
    let all = || curves.iter().flatten().flat_map(|curve| &curve.points);
    let x = PlotAxis::around_values(diagram.x, all().map(|point| point.0));
    let y = PlotAxis::around_values(diagram.y, all().map(|point| point.1));
    let mut plot = Plot::new(SIZE, x, y);
    for (place, curves) in curves.iter().enumerate() {
        for (curve, class) in curves.iter().zip(CLASSES) {
            match place {
                0 => plot.add_line(&curve.points, class, &curve.name),
                _ => plot.add_dashed_line(&curve.points, class, ""),
            }
        }
    }
    plot
}
