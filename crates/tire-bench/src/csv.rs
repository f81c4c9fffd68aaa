//! Reads tables of a bench as CSV, plain or packed by gzip.

#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use std::io::Read;
use std::path::Path;

use flate2::read::GzDecoder;
use tire::Axes;
use units::Unit;

use crate::sample::{Bad, Sample, check};

/// Each channel of [`Sample`] with the column that holds it by default and its SI unit.
pub const CSV_NAMES: [(&str, &str); 12] = [
    ("block", "1"),
    ("time_s", "s"),
    ("slip_ratio", "1"),
    ("slip_angle_rad", "rad"),
    ("camber_rad", "rad"),
    ("fz_n", "N"),
    ("pressure_pa", "Pa"),
    ("speed_mps", "m/s"),
    ("temp_centre_k", "K"),
    ("fx_n", "N"),
    ("fy_n", "N"),
    ("mz_nm", "N.m"),
];

/// Reads a file; `.gz` at the end of its name says that it is packed. See [`read_csv`].
///
/// # Errors
/// When it cannot be read, and as [`read_csv`].
pub fn read_csv_file(
    path: &Path,
    run: usize,
    columns: &[(&str, &str, &str)],
    axes: Axes,
) -> Result<Vec<Sample>, Bad> {
    let name = path.display().to_string();
    let bad = |error: std::io::Error| Bad {
        file: name.clone(),
        line: None,
        text: format!("cannot be read: {error}"),
    };
    let bytes = std::fs::read(path).map_err(bad)?;
    let mut text = String::new();
    match path.extension().is_some_and(|it| it == "gz") {
        true => GzDecoder::new(&bytes[..]).read_to_string(&mut text).map_err(bad)?,
        false => (&bytes[..]).read_to_string(&mut text).map_err(bad)?,
    };
    read_csv(&text, &name, run, columns, axes)
}

/// Reads a text. `columns` lists channels by their names in [`CSV_NAMES`] whose columns have other names or units: channel, column, unit.
/// The temperature is the mean of `temp_inner_k`, `temp_centre_k` and `temp_outer_k` where all three are there.
///
/// # Errors
/// When a column is missing, a unit does not fit, a field is no number, or [`check`] refuses the signs.
pub fn read_csv(
    text: &str,
    file: &str,
    run: usize,
    columns: &[(&str, &str, &str)],
    axes: Axes,
) -> Result<Vec<Sample>, Bad> {
    let bad = |line: usize, text: String| Bad { file: file.to_owned(), line: Some(line), text };
    let mut lines = text.lines().enumerate();
    let head: Vec<_> =
        lines.next().map_or("", |it| it.1).split(',').map(|it| it.trim().to_owned()).collect();
    let places = places(&head, file, columns)?;
    let sides: Vec<_> = ["temp_inner_k", "temp_outer_k"]
        .iter()
        .filter_map(|name| head.iter().position(|it| it == name))
        .collect();
    let mut samples = Vec::new();
    for (number, line) in lines.filter(|(_, line)| !line.trim().is_empty()) {
        let fields: Vec<_> = line.split(',').map(str::trim).collect();
        let at = |place: usize| {
            let field = fields.get(place).copied().unwrap_or("");
            let value = field.parse::<f64>().ok().filter(|it| it.is_finite());
            value.ok_or_else(|| {
                bad(number + 1, format!("{}: expected a number, found `{field}`", head[place]))
            })
        };
        let mut v = [0.0; 12];
        for (value, (place, scale, offset)) in v.iter_mut().zip(&places) {
            *value = scale * at(*place)? + offset;
        }
        if let [inner, outer] = sides[..]
            && !columns.iter().any(|it| it.0 == "temp_centre_k")
        {
            v[8] = (v[8] + at(inner)? + at(outer)?) / 3.0;
        }
        let [block, time, kappa, alpha, gamma, F_z, pressure, v_x, temperature, F_x, F_y, M_z] = v;
        let block = block.max(0.0) as usize;
        let sample = Sample {
            run,
            block,
            time,
            kappa,
            alpha,
            gamma,
            F_z,
            pressure,
            v_x,
            temperature,
            F_x,
            F_y,
            M_z,
        };
        samples.push(sample.turned_from(axes));
    }
    check(&samples, file)?;
    Ok(samples)
}

/// Where the column of each channel stands in the head, with factor and offset to SI units.
fn places(
    head: &[String],
    file: &str,
    columns: &[(&str, &str, &str)],
) -> Result<Vec<(usize, f64, f64)>, Bad> {
    let bad = |line: usize, text: String| Bad { file: file.to_owned(), line: Some(line), text };
    let mut places = Vec::new();
    for (channel, unit) in CSV_NAMES {
        let other = columns.iter().find(|it| it.0 == channel);
        let (column, found) = other.map_or((channel, unit), |it| (it.1, it.2));
        let place = head.iter().position(|it| it == column).ok_or_else(|| {
            let text = format!(
                "expected a column {column} for {channel}, found {}: name the column that has it",
                head.join(", ")
            );
            bad(1, text)
        })?;
        let units = |text: &str| Unit::parse(text).map_err(|it| bad(1, format!("{column}: {it}")));
        let (from, to) = (units(found)?, units(unit)?);
        let (scale, offset) = Unit::conversion(&from, &to).ok_or_else(|| {
            bad(1, format!("{column}: expected a unit like {unit}, found {found}"))
        })?;
        places.push((place, scale, offset));
    }
    Ok(places)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "block,time_s,slip_ratio,SA,camber_rad,fz_n,pressure_pa,speed_mps,temp_centre_k,fx_n,fy_n,mz_nm";

    #[test]
    fn columns_have_names_and_units_of_the_user() {
        let text = format!("{HEAD}\n0,0,0,2,0,1000,80000,11,330,0,-900,9\n");
        let angle = [("slip_angle_rad", "SA", "deg")];
        let found = read_csv(&text, "a.csv", 0, &angle, Axes::Iso).expect("samples");
        assert!((found[0].alpha - 2f64.to_radians()).abs() < 1e-15);
        let error = read_csv(&text, "a.csv", 0, &[], Axes::Iso).expect_err("no column");
        assert!(
            error.to_string().starts_with("a.csv:1: expected a column slip_angle_rad"),
            "{error}"
        );
        let wrong = [("slip_angle_rad", "SA", "N")];
        let error = read_csv(&text, "a.csv", 0, &wrong, Axes::Iso).expect_err("a force");
        assert!(error.to_string().contains("expected a unit like rad"), "{error}");
        let text = text.replace(",9\n", ",x\n");
        let error = read_csv(&text, "a.csv", 0, &angle, Axes::Iso).expect_err("no number");
        assert_eq!(error.to_string(), "a.csv:2: mz_nm: expected a number, found `x`");
    }

    #[test]
    fn signs_of_other_axes_are_refused_and_converted() {
        let text = format!("{HEAD}\n0,0,0,2,0,-1000,80000,11,330,0,-900,9\n");
        let angle = [("slip_angle_rad", "SA", "deg")];
        let error = read_csv(&text, "a.csv", 0, &angle, Axes::Iso).expect_err("no load");
        assert!(error.text.contains("SAE benches write F_z < 0"), "{error}");
        let found = read_csv(&text, "a.csv", 0, &angle, Axes::Sae).expect("samples");
        assert!(found[0].F_z > 0.0 && found[0].alpha < 0.0 && found[0].F_y > 0.0);
    }
}
