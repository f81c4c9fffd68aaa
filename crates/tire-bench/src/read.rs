//! Reads files of a bench, CSV, MAT or TYDEX, to samples in ISO-W axes and SI units.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use std::collections::BTreeMap;
use std::path::Path;

use tire::TireAxes;

use crate::axes::Wrench;
use crate::channels::BenchReadOptions;
use crate::inputs::{ChannelFinder, ChannelSource, force_axes, temperature_at};
use crate::sample::{BenchError, BenchSample, check_sample_signs};
use crate::table::BenchTable;
use crate::{csv, mat, sweeps, text, tydex};

/// What a file holds, and what was assumed of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BenchData {
    /// The samples.
    pub samples: Vec<BenchSample>,
    /// What was assumed, for people: one sentence each.
    pub notes: Vec<String>,
}

/// Time between rows without a time [s]: each is steady, so neither rates nor a lag of the carcass connect them.
const STEADY: f64 = 3600.0;

/// Reads files, each with its name. Tables are runs in their order; the files of TYDEX, which hold one sweep each, are sweeps of run 0.
///
/// # Errors
/// As [`read_bench_file`].
pub fn read_bench_files(
    files: &[(&str, &[u8])],
    reading: &BenchReadOptions,
) -> Result<BenchData, BenchError> {
    let (mut all, mut run, mut sweep) = (BenchData::default(), 0, 0);
    let mut told: BTreeMap<String, Vec<&str>> = BTreeMap::new();
    for (name, bytes) in files {
        for (mut found, one_sweep) in read_tables(bytes, name, reading)? {
            for it in &mut found.samples {
                (it.run, it.block) = if one_sweep { (0, sweep) } else { (run, it.block) };
            }
            // Sweeps of tables have numbers of their own below.
            sweep = match one_sweep {
                true => sweep + 1,
                false if run == 0 => found.samples.last().map_or(sweep, |it| sweep.max(it.block + 1)),
                false => sweep,
            };
            run += usize::from(!one_sweep);
            all.samples.extend(found.samples);
            for note in found.notes {
                told.entry(note).or_default().push(*name);
            }
        }
    }
    all.notes =
        told.into_iter().map(|(note, names)| format!("{}: {note}", list_file_names(&names))).collect();
    Ok(all)
}

/// Names of files, the first ones when there are many.
fn list_file_names(names: &[&str]) -> String {
    const MOST: usize = 3;
    match names.len() {
        0..=MOST => names.join(", "),
        count => format!("{} and {} more", names[..MOST].join(", "), count - MOST),
    }
}

/// Reads one file as one run.
///
/// # Errors
/// When its format is unknown or broken; a channel is missing, has no unit or one of another kind, or no numbers; or its signs are those
/// of no tire: with the place and what to do.
pub fn read_bench_file(
    bytes: &[u8],
    file: &str,
    run: usize,
    reading: &BenchReadOptions,
) -> Result<BenchData, BenchError> {
    let mut all = BenchData::default();
    for (found, _) in read_tables(bytes, file, reading)? {
        let begin = all.samples.last().map_or(0, |it: &BenchSample| it.block + 1);
        let numbered = found.samples.into_iter();
        all.samples.extend(numbered.map(|it| BenchSample { run, block: begin + it.block, ..it }));
        all.notes.extend(found.notes);
    }
    Ok(all)
}

/// Reads a file of this path as one run, see [`read_bench_file`]. `columns`: channel, column, unit.
///
/// # Errors
/// When it cannot be read, and as [`read_bench_file`].
pub fn read_csv_file(
    path: &Path,
    run: usize,
    columns: &[(&str, &str, &str)],
    axes: TireAxes,
) -> Result<Vec<BenchSample>, BenchError> {
    let file = path.display().to_string();
    let bytes = std::fs::read(path).map_err(|error| BenchError {
        file: file.clone(),
        line: None,
        text: format!("cannot be read: {error}"),
    })?;
    let columns: Vec<_> = columns.iter().map(|it| (it.0, it.1, Some(it.2))).collect();
    let reading = BenchReadOptions { axes, columns: &columns, ..BenchReadOptions::default() };
    Ok(read_bench_file(&bytes, &file, run, &reading)?.samples)
}

/// The tables of a file, each with whether its format has one sweep in a file.
fn read_tables(
    bytes: &[u8],
    file: &str,
    reading: &BenchReadOptions,
) -> Result<Vec<(BenchData, bool)>, BenchError> {
    let bad = |text: String| BenchError { file: file.to_owned(), line: None, text };
    let bytes = text::gunzip_if_compressed(bytes).map_err(bad)?;
    let named: Vec<_> = reading.columns.iter().map(|it| it.1).collect();
    let tables = if mat_file::is_mat(&bytes) {
        mat::read_mat_tables(&bytes, file, &named)?
    } else {
        let text = text::decode_text(&bytes);
        if text.contains('\0') {
            return Err(bad("expected a table as text, a MAT file or TYDEX, found other bytes".to_owned()));
        }
        match tydex::is_tydex(&text) {
            true => vec![tydex::read_tydex_table(&text, file)?],
            false => vec![csv::read_csv_table(&text, file, &named)?],
        }
    };
    tables.iter().map(|table| Ok((samples_of_table(table, reading)?, table.one_sweep))).collect()
}

fn samples_of_table(table: &BenchTable, reading: &BenchReadOptions) -> Result<BenchData, BenchError> {
    let mut notes = table.notes.clone();
    let (axes, letter) = force_axes(table, reading)?;
    let inputs = ChannelFinder { table, reading, letter };
    let wanted = |channel| inputs.require_channel(channel);
    let (F_y, F_z, M_z) = (wanted("fy_n")?, wanted("fz_n")?, inputs.aligning_moment_channel(&mut notes)?);
    let (gamma, pressure) = (wanted("camber_rad")?, wanted("pressure_pa")?);
    let v_x = wanted("speed_mps")?;
    let running = inputs.running_rows(&v_x, &mut notes);
    let [kappa, alpha] = inputs.slip_channels(&running, &mut notes)?;
    let F_x = inputs.longitudinal_force_channel(&kappa, &mut notes)?;
    let temperature = inputs.tread_temperature(&mut notes)?;
    let time = inputs.find_channel("time_s")?;
    if time.is_none() {
        notes.push("no time: each row counts as a steady state of its own".to_owned());
    }
    let block = inputs.find_channel("block")?;
    let centre = inputs.wheel_centre_channels(axes, &gamma, &mut notes)?;
    let mut samples = Vec::new();
    for &row in &running {
        let wrench = Wrench {
            F: [F_x.value_at(row), F_y.value_at(row), F_z.value_at(row)],
            M_y: centre.as_ref().map_or(0.0, |it| it.1.value_at(row)),
            M_z: M_z.value_at(row),
        };
        let gamma = gamma.value_at(row);
        let radius = centre.as_ref().map_or(0.0, |it| it.0.value_at(row));
        let wrench = wrench.moved_to_contact(axes, gamma, radius);
        let number = block.as_ref().map_or(0.0, |it| it.value_at(row));
        let sample = BenchSample {
            run: 0,
            block: number.max(0.0) as usize,
            time: time.as_ref().map_or(STEADY * row as f64, |it| it.value_at(row)),
            kappa: kappa.value_at(row),
            alpha: alpha.value_at(row),
            gamma,
            F_z: wrench.F[2],
            pressure: pressure.value_at(row),
            v_x: v_x.value_at(row),
            temperature: temperature_at(&temperature, row),
            F_x: wrench.F[0],
            F_y: wrench.F[1],
            M_z: wrench.M_z,
        };
        if is_complete_sample(&sample, &M_z, &temperature.0) && !number.is_nan() {
            samples.push(sample.converted_from_axes(reading.axes));
        }
    }
    check_and_segment_samples(table, samples, running.len(), block.is_some(), notes)
}

/// Judges the samples of a table and finds their sweeps.
fn check_and_segment_samples(
    table: &BenchTable,
    mut samples: Vec<BenchSample>,
    rows: usize,
    numbered: bool,
    mut notes: Vec<String>,
) -> Result<BenchData, BenchError> {
    let dropped = rows - samples.len();
    if 2 * dropped > rows {
        let text =
            format!("expected numbers in all channels, found such in {} of {rows} rows only", samples.len());
        return Err(table.error_at_line(None, text));
    }
    if dropped > 0 {
        notes.push(format!("{dropped} of {rows} rows were left out, which have no number in some channel"));
    }
    check_sample_signs(&samples, &table.file)?;
    check_slip_ratio(table, &samples)?;
    if !numbered && !table.one_sweep {
        let (sweeps, left) = sweeps::number_sweeps(&mut samples);
        if sweeps == 0 {
            return Err(table.error_at_line(
                None,
                "expected sweeps of slip angle or slip ratio by more than 0.05 at steady conditions, found none: check the units of both, or give a column block that numbers the sweeps",
            ));
        }
        notes.push(format!(
            "{sweeps} sweeps were found by their conditions; {left} samples between them were left out"
        ));
    }
    Ok(BenchData { samples, notes })
}

/// Whether a sample has a number in each channel that is measured.
fn is_complete_sample(it: &BenchSample, M_z: &ChannelSource, temperature: &ChannelSource) -> bool {
    let measured = [(it.M_z, M_z), (it.temperature, temperature)];
    let all = [it.time, it.kappa, it.alpha, it.gamma, it.F_z, it.pressure, it.v_x, it.F_x, it.F_y];
    all.iter().all(|value| value.is_finite())
        && measured.iter().all(|(value, input)| value.is_finite() || input.is_unmeasured())
}

/// Refuses slip ratios that are percent, or that are no 0 where the tire rolls freely.
fn check_slip_ratio(table: &BenchTable, samples: &[BenchSample]) -> Result<(), BenchError> {
    let [low, high] =
        samples.iter().fold([0.0f64; 2], |[low, high], it| [low.min(it.kappa), high.max(it.kappa)]);
    if low < -1.5 || high > 5.0 {
        let text = format!(
            "expected slip ratios from -1, a locked wheel, found {low:.3} to {high:.3}: check the unit, it may be %"
        );
        return Err(table.error_at_line(None, text));
    }
    let most = samples.iter().map(|it| it.F_x.abs()).fold(0.0, f64::max);
    let free: Vec<_> = samples
        .iter()
        .filter(|it| it.alpha.abs() < 0.02 && it.F_x.abs() < 0.05 * most)
        .map(|it| it.kappa)
        .collect();
    let zero = free.iter().sum::<f64>() / free.len().max(1) as f64;
    if high - low > 0.1 && free.len() >= 5 && zero.abs() > 0.05 {
        let text = format!(
            "expected F_x about 0 at a slip ratio of 0, found that at {zero:.3}: this is a slip ratio by the loaded radius (SR of TTC); choose the one by the effective radius (SL), or ω R_e / V - 1"
        );
        return Err(table.error_at_line(None, text));
    }
    Ok(())
}
