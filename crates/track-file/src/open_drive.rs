//! Reads a track from a road network of OpenDRIVE: a line with the edges, the heights and the bank of its road.

use std::path::Path;

use track::{TrackSurvey, point_distance};
use xodr::RoadNetwork;

use crate::cross_section::{CrossSection, station_range};
use crate::road_route::{DrivableLanes, RoadRoute};
use crate::{Error, RoadTrack};

/// Distance of the points of the line [m]: their numbers have single precision, which at less tells no bends.
const SPACING: f64 = 2.0;
/// Two points nearer than this are one [m].
const NEAREST: f64 = 0.5 * SPACING;
/// Largest coordinate [m]: numbers of single precision are a millimetre apart there.
const FARTHEST: f64 = 16_384.0;
/// Points that make a line.
const LEAST_POINTS: usize = 4;
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
    let (network, provenance) =
        xodr::load_file_with_provenance(path).map_err(|error| Error::File(error.to_string()))?;
    let mut track = track_of_network(&network, roads)?;
    let faults = provenance.warnings.iter().filter(|warning| !warning.is_ignored());
    track.warnings = faults.map(ToString::to_string).collect();
    let more = track.warnings.len().saturating_sub(MOST_WARNINGS);
    if more > 0 {
        track.warnings.truncate(MOST_WARNINGS);
        track.warnings.push(format!("{more} more of the file"));
    }
    Ok(track)
}

fn track_of_network(network: &RoadNetwork, roads: &[String]) -> Result<RoadTrack, Error> {
    let lanes = DrivableLanes::new(network);
    let route = if roads.is_empty() { lanes.longest_route()? } else { lanes.route_along(roads)? };
    let sections = cross_sections(network, &route)?;
    let mut names: Vec<String> = route.stretches.iter().map(|it| lanes.road_name(it.road)).collect();
    names.dedup();
    Ok(RoadTrack { survey: survey(&sections, route.closed), roads: names, warnings: Vec::new() })
}

/// Cuts along the route.
fn cross_sections(network: &RoadNetwork, route: &RoadRoute) -> Result<Vec<CrossSection>, Error> {
    let mut sections: Vec<CrossSection> = Vec::new();
    let mut length = 0.0;
    for stretch in &route.stretches {
        let Some([begin, end]) = station_range(network, stretch) else { continue };
        length += end - begin;
        let steps = ((end - begin) / SPACING).ceil().max(1.0);
        for step in 0..=steps as usize {
            let share = step as f64 / steps;
            let share = if stretch.forward { share } else { 1.0 - share };
            let Some(cut) = CrossSection::at(network, stretch, begin + share * (end - begin)) else {
                continue;
            };
            if sections.last().is_none_or(|last| distance(last, &cut) >= NEAREST) {
                sections.push(cut);
            }
        }
    }
    while route.closed
        && sections.len() > 1
        && distance(&sections[0], &sections[sections.len() - 1]) < NEAREST
    {
        sections.pop();
    }
    if sections.len() < LEAST_POINTS {
        return Err(Error::Short { least: LEAST_POINTS, spacing: SPACING, length });
    }
    let coordinates = sections.iter().flat_map(|cut| [cut.reference[0], cut.reference[1]]);
    let found = coordinates.fold(0.0, |most: f64, it| most.max(it.abs()));
    if found > FARTHEST {
        return Err(Error::Far { most: FARTHEST, found });
    }
    Ok(sections)
}

fn distance(a: &CrossSection, b: &CrossSection) -> f64 {
    let plan = |cut: &CrossSection| [cut.middle()[0], cut.middle()[1]];
    point_distance(plan(a), plan(b))
}

fn survey(sections: &[CrossSection], closed: bool) -> TrackSurvey {
    let is_on_road =
        |cut: &CrossSection| cut.widths_from(cut.reference).iter().all(|way| *way >= -EDGE_TOLERANCE);
    let on_road = sections.iter().all(is_on_road);
    let line: Vec<[f64; 3]> =
        sections.iter().map(|cut| if on_road { cut.reference } else { cut.middle() }).collect();
    let widths =
        sections.iter().zip(&line).map(|(cut, point)| cut.widths_from(*point).map(|way| way.max(0.0)));
    let heights: Vec<f64> = line.iter().map(|point| point[2]).collect();
    let banks: Vec<f64> = sections.iter().map(CrossSection::bank).collect();
    let varies = |values: &[f64], from: f64, least: f64| values.iter().any(|it| (it - from).abs() > least);
    TrackSurvey {
        points: line.iter().map(|point| [point[0], point[1]]).collect(),
        closed,
        widths: Some(widths.collect()),
        height: varies(&heights, heights[0], LEVEL[0]).then_some(heights),
        bank: varies(&banks, 0.0, LEVEL[1]).then_some(banks),
        ..TrackSurvey::default()
    }
}

#[cfg(test)]
mod tests;
