//! Reads a track from a road surface of OpenCRG: its reference line, with the heights on both sides as far as they are known.

use std::path::Path;

use opencrg::{CrgGrid, Uv, Xy};
use track::{TrackSurvey, point_distance};

use crate::{Error, LEAST_POINTS, RoadTrack};

/// Least distance of the points of the line [m].
const SPACING: f64 = 2.0;
/// Stations around a point whose heights are averaged [m]: bumps are no grade.
const AROUND: [f64; 5] = [-0.8, -0.4, 0.0, 0.4, 0.8];
/// Heights across the road from edge to edge.
const ACROSS: usize = 21;
/// No road is as high [m]: such a height is a damaged number.
const HIGHEST: f64 = 1e4;

/// Reads the track of a surface; its edges are where heights end.
///
/// # Errors
/// When the file is none, or has too short a road.
pub(crate) fn read_open_crg(path: &Path) -> Result<RoadTrack, Error> {
    let grid = CrgGrid::from_path(path).map_err(|error| Error::File(error.to_string()))?;
    let (begin, end) = grid.u_range();
    let (right, left) = grid.v_range();
    let line = if right <= 0.0 && 0.0 <= left { 0.0 } else { 0.5 * (right + left) };
    // The reference line of a file with longer increments has a kink at each of them.
    let steps = ((end - begin) / SPACING).ceil().min(grid.dims().0 as f64 - 1.0).max(1.0) as usize;
    let mut survey = TrackSurvey::default();
    let (mut widths, mut heights, mut banks) = (Vec::new(), Vec::new(), Vec::new());
    for step in 0..=steps {
        let u = begin + (end - begin) * step as f64 / steps as f64;
        let Xy { x, y } = grid.xy_from_uv(Uv { u, v: line });
        let cut = SurfaceCut::at(&grid, u, line, [right, left]).filter(|_| x.is_finite() && y.is_finite());
        let Some(cut) = cut else { continue };
        survey.points.push([x, y]);
        widths.push(cut.widths);
        heights.push(cut.height);
        banks.push(cut.bank);
    }
    let ends = survey.points.first().zip(survey.points.last());
    survey.closed =
        end - begin > 10.0 * SPACING && ends.is_some_and(|(a, b)| point_distance(*a, *b) <= 2.0 * SPACING);
    let closing = survey.closed && ends.is_some_and(|(a, b)| point_distance(*a, *b) < 0.5 * SPACING);
    if closing {
        survey.points.pop();
        widths.pop();
        heights.pop();
        banks.pop();
    }
    let missing = steps + 1 - heights.len() - usize::from(closing);
    let mut warnings = Vec::new();
    if missing > 0 {
        let cuts =
            format!("{missing} of {} cuts have no position, or no plausible height on the line", steps + 1);
        if survey.points.len() < LEAST_POINTS {
            return Err(Error::File(cuts));
        }
        warnings.push(format!("{cuts}; the track leaves them out"));
    }
    if survey.points.len() < LEAST_POINTS {
        return Err(Error::Short { least: LEAST_POINTS, spacing: SPACING, length: end - begin });
    }
    survey.widths = Some(widths);
    survey.height = Some(heights);
    survey.bank = Some(banks);
    RoadTrack::new(survey, Vec::new(), warnings)
}

/// A cut across the surface.
struct SurfaceCut {
    /// Ways from the line to the left and the right edge [m].
    widths: [f64; 2],
    /// Mean height [m].
    height: f64,
    /// Slope across by least squares [rad]; positive where the left side is higher.
    bank: f64,
}

impl SurfaceCut {
    /// The cut at a station, between the edges of the heights around the line; none where the line has no height.
    fn at(grid: &CrgGrid, u: f64, line: f64, [right, left]: [f64; 2]) -> Option<Self> {
        let v_at = |i: usize| right + (left - right) * i as f64 / (ACROSS - 1) as f64;
        let height_at = |v: f64| {
            let known: Vec<f64> = AROUND
                .iter()
                .filter_map(|by| grid.elevation_at_uv(Uv { u: u + by, v }))
                .filter(|z| z.abs() < HIGHEST)
                .collect();
            (!known.is_empty()).then(|| known.iter().sum::<f64>() / known.len() as f64)
        };
        let heights: Vec<Option<f64>> = (0..ACROSS).map(|i| height_at(v_at(i))).collect();
        let nearest =
            (0..ACROSS).min_by(|a, b| (v_at(*a) - line).abs().total_cmp(&(v_at(*b) - line).abs()))?;
        heights[nearest]?;
        let last = (nearest..ACROSS).take_while(|i| heights[*i].is_some()).last()?;
        let first = (0..=nearest).rev().take_while(|i| heights[*i].is_some()).last()?;
        let points: Vec<[f64; 2]> = (first..=last).filter_map(|i| Some([v_at(i), heights[i]?])).collect();
        let count = points.len() as f64;
        let [v_mean, height] = [0, 1].map(|k| points.iter().map(|point| point[k]).sum::<f64>() / count);
        let moment: f64 = points.iter().map(|[v, z]| (v - v_mean) * (z - height)).sum();
        let spread: f64 = points.iter().map(|[v, _]| (v - v_mean).powi(2)).sum();
        let slope = if spread > 0.0 { moment / spread } else { 0.0 };
        let widths = [(v_at(last) - line).max(0.0), (line - v_at(first)).max(0.0)];
        Some(SurfaceCut { widths, height: height + slope * (line - v_mean), bank: slope.atan() })
    }
}
