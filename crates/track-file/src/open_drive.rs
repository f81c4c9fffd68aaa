//! Reads a track from a road network of OpenDRIVE: a line with the edges, the heights and the bank of its road.

use std::path::{Component, Path};

use track::{TrackSurvey, point_distance};
use xodr::RoadNetwork;

use crate::cross_section::{CrossSection, space_distance, station_range};
use crate::plausibility::check_roads;
use crate::road_route::{DrivableLanes, RoadRoute};
use crate::{Error, LEAST_POINTS, RoadTrack};

/// Distance of the points of the line [m]: their numbers have single precision, which at less tells no bends.
const SPACING: f64 = 2.0;
/// Two points nearer than this are one [m].
const NEAREST: f64 = 0.5 * SPACING;
/// Points farther apart than this are no line [m].
const LARGEST_GAP: f64 = 3.0 * SPACING;
/// Largest coordinate [m]: numbers of single precision are a millimetre apart there.
const FARTHEST: f64 = 16_384.0;
/// How far the reference line may be beyond an edge, by rounding [m].
const EDGE_TOLERANCE: f64 = 0.02;
/// Heights and banks below which a road is level [m, rad].
const LEVEL: [f64; 2] = [0.01, 1e-4];
/// Messages on a file that are told.
const MOST_WARNINGS: usize = 5;

/// Reads the track along these roads, or where none are named along the longest road and what follows it.
///
/// The line is the roads' reference line where that lies on the lanes for driving, else the middle of these.
///
/// # Errors
/// When the file is none, has no such roads, or the way forks.
pub(crate) fn read_open_drive(path: &Path, roads: &[String]) -> Result<RoadTrack, Error> {
    let bytes = std::fs::read(path).map_err(|error| Error::File(format!("cannot be read: {error}")))?;
    // In UTF-8 or else in Latin-1: names of roads have letters of any language.
    let text = text_encoding::utf8_or_latin1(&bytes);
    check_roads(&text)?;
    let (network, provenance) = xodr::load_str_with(&text, |name| read_included_file(path, name))
        .map_err(|error| Error::File(describe_import_error(&error)))?;
    let mut track = track_of_network(&network, roads)?;
    let faults = provenance.warnings.iter().filter(|warning| !warning.is_ignored());
    let mut warnings: Vec<String> = faults.map(ToString::to_string).collect();
    let more = warnings.len().saturating_sub(MOST_WARNINGS);
    if more > 0 {
        warnings.truncate(MOST_WARNINGS);
        warnings.push(format!("{more} more of the file"));
    }
    track.warnings.splice(0..0, warnings);
    Ok(track)
}

/// The text of a file that a map includes: one in the folder of the map or below.
fn read_included_file(map: &Path, name: &str) -> Result<String, String> {
    let name = Path::new(name);
    if !name.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir)) {
        return Err("it is not in the folder of the map".to_owned());
    }
    let folder = map.parent().unwrap_or(Path::new("."));
    let bytes = std::fs::read(folder.join(name)).map_err(|error| error.to_string())?;
    let text = text_encoding::utf8_or_latin1(&bytes);
    check_roads(&text).map_err(|error| error.to_string())?;
    Ok(text.into_owned())
}

/// A road that cannot be read is skipped, so a file may lose all of them.
fn describe_import_error(error: &xodr::ImportError) -> String {
    let text = error.to_string();
    let hint = "; roads without a length, a line or a number where one belongs are skipped";
    if text.contains("no lanes") { text + hint } else { text }
}

fn track_of_network(network: &RoadNetwork, roads: &[String]) -> Result<RoadTrack, Error> {
    let lanes = DrivableLanes::new(network);
    let route = if roads.is_empty() { lanes.longest_route()? } else { lanes.route_along(roads)? };
    check_finite(network, &lanes, &route)?;
    let line = road_line(network, &route)?;
    let mut names: Vec<String> = route.stretches.iter().map(|it| lanes.road_name(it.road)).collect();
    names.dedup();
    RoadTrack::new(survey(&line, route.closed), names, Vec::new())
}

/// Coefficients of a file may be numbers, and what they give none.
fn check_finite(network: &RoadNetwork, lanes: &DrivableLanes, route: &RoadRoute) -> Result<(), Error> {
    for stretch in &route.stretches {
        for lane in [stretch.leftmost, stretch.rightmost].into_iter().filter_map(|id| network.lane(id)) {
            let is_finite = lane.width.is_finite()
                && lane.widths.iter().all(|width| width.is_finite())
                && lane.center.points().iter().all(|point| point.is_finite());
            if !is_finite {
                return Err(Error::NotFinite { road: lanes.road_name(stretch.road) });
            }
        }
    }
    Ok(())
}

/// Cuts across the road with a point of the track on each.
struct RoadLine {
    cuts: Vec<CrossSection>,
    /// x, y, z [m].
    points: Vec<[f64; 3]>,
}

/// The line along the route.
fn road_line(network: &RoadNetwork, route: &RoadRoute) -> Result<RoadLine, Error> {
    let mut cuts: Vec<CrossSection> = Vec::new();
    let mut length = 0.0;
    for stretch in &route.stretches {
        let Some([begin, end]) = station_range(network, stretch) else { continue };
        length += end - begin;
        let steps = ((end - begin) / SPACING).ceil().max(1.0);
        for step in 0..=steps as usize {
            let share = step as f64 / steps;
            let share = if stretch.forward { share } else { 1.0 - share };
            cuts.extend(CrossSection::at(network, stretch, begin + share * (end - begin)));
        }
    }
    let line = line_points(&cuts);
    let mut kept: Vec<usize> = Vec::new();
    for i in 0..line.len() {
        if kept.last().is_none_or(|last| distance(line[*last], line[i]) >= NEAREST) {
            kept.push(i);
        }
    }
    while route.closed && kept.len() > 1 && distance(line[kept[0]], line[kept[kept.len() - 1]]) < NEAREST {
        kept.pop();
    }
    if kept.len() < LEAST_POINTS {
        return Err(Error::Short { least: LEAST_POINTS, spacing: SPACING, length });
    }
    let next = |k: usize| kept[(k + 1) % kept.len()];
    let pairs = if route.closed { kept.len() } else { kept.len() - 1 };
    let gap = |k: &usize| space_distance(line[kept[*k]], line[next(*k)]);
    if let Some(k) = (0..pairs).find(|k| gap(k) > LARGEST_GAP) {
        let [x, y, _] = line[kept[k]];
        return Err(Error::Gap { x, y, gap: gap(&k) });
    }
    let found =
        line.iter().flat_map(|point| [point[0], point[1]]).fold(0.0, |most: f64, it| most.max(it.abs()));
    if found > FARTHEST {
        return Err(Error::Far { most: FARTHEST, found });
    }
    let points = kept.iter().map(|i| line[*i]).collect();
    Ok(RoadLine { cuts: kept.into_iter().map(|i| cuts[i]).collect(), points })
}

/// The reference line where it lies on the lanes all along, else their middle [m].
fn line_points(cuts: &[CrossSection]) -> Vec<[f64; 3]> {
    let is_on_road =
        |cut: &CrossSection| cut.widths_from(cut.reference).iter().all(|way| *way >= -EDGE_TOLERANCE);
    let on_road = cuts.iter().all(is_on_road);
    cuts.iter().map(|cut| if on_road { cut.reference } else { cut.middle() }).collect()
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    point_distance([a[0], a[1]], [b[0], b[1]])
}

fn survey(line: &RoadLine, closed: bool) -> TrackSurvey {
    let RoadLine { cuts, points } = line;
    let widths = cuts.iter().zip(points).map(|(cut, point)| cut.widths_from(*point).map(|way| way.max(0.0)));
    let heights: Vec<f64> = points.iter().map(|point| point[2]).collect();
    let banks: Vec<f64> = cuts.iter().map(CrossSection::bank).collect();
    let varies = |values: &[f64], from: f64, least: f64| values.iter().any(|it| (it - from).abs() > least);
    TrackSurvey {
        points: points.iter().map(|point| [point[0], point[1]]).collect(),
        closed,
        widths: Some(widths.collect()),
        height: varies(&heights, heights[0], LEVEL[0]).then_some(heights),
        bank: varies(&banks, 0.0, LEVEL[1]).then_some(banks),
        ..TrackSurvey::default()
    }
}

#[cfg(test)]
mod tests;
