//! Follows a road network from lane to lane: round a circuit, or from one end to the other.

use std::collections::{BTreeMap, BTreeSet};

use xodr::{Direction, LaneId, Layer, RoadId, RoadNetwork};

use crate::Error;
use crate::cross_section::{end_section, space_distance};
use crate::road_stretch::RoadStretch;

/// Edges nearer than this are one [m].
const NEAR: f64 = 0.5;
/// Identifiers that a message names.
const MOST_NAMES: usize = 12;

/// Consecutive stretches.
#[derive(Debug, Clone, PartialEq)]
pub struct RoadRoute {
    /// The stretches in the order of the drive.
    pub stretches: Vec<RoadStretch>,
    /// Whether the first one follows the last one.
    pub closed: bool,
}

/// The lanes for driving of a network.
pub struct DrivableLanes<'a> {
    network: &'a RoadNetwork,
    /// Lanes of each section of a road, by their OpenDRIVE numbers: negative ones right of the reference line.
    sections: BTreeMap<(usize, usize), BTreeMap<i32, LaneId>>,
}

impl<'a> DrivableLanes<'a> {
    /// The lanes of a network that are no temporary ones.
    pub fn new(network: &'a RoadNetwork) -> Self {
        let mut sections: BTreeMap<_, BTreeMap<_, _>> = BTreeMap::new();
        for lane in network.lanes().iter().filter(|lane| lane.kind.is_drivable()) {
            if let Some(at) = network.road_lane(lane.id).filter(|_| lane.layer == Layer::Permanent) {
                sections.entry((at.road.0, at.section)).or_default().insert(at.od_id, lane.id);
            }
        }
        DrivableLanes { network, sections }
    }

    /// The identifier of a road in the file.
    pub fn road_name(&self, road: RoadId) -> String {
        self.network.road(road).map_or_else(String::new, |road| road.od_id().to_owned())
    }

    /// The stretch around a lane.
    fn stretch(&self, lane: LaneId) -> Option<RoadStretch> {
        let at = self.network.road_lane(lane)?;
        let lanes = self.sections.get(&(at.road.0, at.section))?;
        lanes.get(&at.od_id)?;
        // There is no lane 0.
        let beside = |od_id: i32, step: i32| if od_id + step == 0 { step } else { od_id + step };
        let end = |step: i32| {
            let mut od_id = at.od_id;
            while lanes.contains_key(&beside(od_id, step)) {
                od_id = beside(od_id, step);
            }
            od_id
        };
        let (right, left) = (end(-1), end(1));
        let direction = self.network.lane(lane)?.direction;
        let is_driven = |id: &LaneId| {
            let way = self.network.lane(*id).map(|lane| lane.direction);
            way == Some(direction) || way == Some(Direction::Both)
        };
        Some(RoadStretch {
            road: at.road,
            section: at.section,
            forward: direction != Direction::Backward,
            leftmost: lanes[&left],
            rightmost: lanes[&right],
            driven: lanes.range(right..=left).map(|(_, id)| *id).filter(is_driven).collect(),
        })
    }

    /// Stretches that follow one, or that it follows: by the links of its lanes, else the next section of its road, else roads that begin
    /// or end where it ends or begins.
    fn linked(&self, stretch: &RoadStretch, ahead: bool) -> Vec<RoadStretch> {
        let mut found: Vec<RoadStretch> = Vec::new();
        for lane in stretch.driven.iter().filter_map(|id| self.network.lane(*id)) {
            for next in if ahead { &lane.successors } else { &lane.predecessors } {
                let next = self.stretch(*next);
                found.extend(next.filter(|next| found.iter().all(|it| !it.is_same_section(next))));
            }
        }
        if found.is_empty() {
            found.extend(self.neighbouring_section(stretch, ahead));
        }
        if found.is_empty() {
            found = self.adjoining_roads(stretch, ahead);
        }
        found
    }

    /// The stretch of the same road ahead or behind.
    fn neighbouring_section(&self, stretch: &RoadStretch, ahead: bool) -> Option<RoadStretch> {
        let road = stretch.road.0;
        let lanes = match ahead == stretch.forward {
            true => self.sections.range((road, stretch.section + 1)..=(road, usize::MAX)).next(),
            false => self.sections.range((road, 0)..(road, stretch.section)).next_back(),
        };
        self.stretch_in_direction(lanes?.1, stretch.forward)
    }

    fn stretch_in_direction(&self, lanes: &BTreeMap<i32, LaneId>, forward: bool) -> Option<RoadStretch> {
        lanes.values().filter_map(|lane| self.stretch(*lane)).find(|it| it.forward == forward)
    }

    /// Roads whose edges begin where those of a stretch end, or end where they begin.
    fn adjoining_roads(&self, stretch: &RoadStretch, ahead: bool) -> Vec<RoadStretch> {
        let Some(here) = end_section(self.network, stretch, ahead) else { return Vec::new() };
        let ends = self.network.roads().iter().flat_map(|road| match ahead {
            true => self.starts(road.id()),
            false => self.ends(road.id()),
        });
        let adjoins = |it: &RoadStretch| {
            end_section(self.network, it, !ahead).is_some_and(|there| {
                here.edges.iter().zip(&there.edges).all(|(a, b)| space_distance(*a, *b) < NEAR)
            })
        };
        ends.filter(adjoins).collect()
    }

    fn names(&self, stretches: &[RoadStretch]) -> String {
        let names: BTreeSet<String> = stretches.iter().map(|it| self.road_name(it.road)).collect();
        if names.is_empty() { "none".to_owned() } else { Vec::from_iter(names).join(", ") }
    }

    /// The one stretch that follows, or that this one follows; none at an end.
    fn follow(&self, stretch: &RoadStretch, ahead: bool) -> Result<Option<RoadStretch>, Error> {
        let next = self.linked(stretch, ahead);
        match next.as_slice() {
            [] => Ok(None),
            [one] => Ok(Some(one.clone())),
            _ => Err(Error::Fork { road: self.road_name(stretch.road), next: self.names(&next) }),
        }
    }

    /// Where a drive along a road may begin: on its first section along its line, on its last one against it.
    fn starts(&self, road: RoadId) -> Vec<RoadStretch> {
        self.outer_stretches(road, true)
    }

    /// Where it may end.
    fn ends(&self, road: RoadId) -> Vec<RoadStretch> {
        self.outer_stretches(road, false)
    }

    fn outer_stretches(&self, road: RoadId, at_begin: bool) -> Vec<RoadStretch> {
        let sections = || self.sections.range((road.0, 0)..=(road.0, usize::MAX)).map(|(_, lanes)| lanes);
        let stretch = |forward: bool| {
            let lanes = if forward == at_begin { sections().next() } else { sections().next_back() };
            self.stretch_in_direction(lanes?, forward)
        };
        [stretch(true), stretch(false)].into_iter().flatten().collect()
    }

    /// The route from the longest road on, and before it if that is no circuit.
    ///
    /// # Errors
    /// Where it forks.
    pub fn longest_route(&self) -> Result<RoadRoute, Error> {
        let length = |stretch: &RoadStretch| self.network.road(stretch.road).map_or(0.0, xodr::Road::length);
        let roads = self.network.roads().iter().filter_map(|road| self.starts(road.id()).into_iter().next());
        // Of equally long ones the first in the file.
        let start = roads.rev().max_by(|a, b| length(a).total_cmp(&length(b))).ok_or(Error::NoLanes)?;
        let mut stretches = vec![start];
        while let Some(next) = self.follow(&stretches[stretches.len() - 1], true)? {
            if let Some(begin) = stretches.iter().position(|it| it.is_same_section(&next)) {
                return Ok(RoadRoute { stretches: stretches.split_off(begin), closed: true });
            }
            stretches.push(next);
        }
        // Before the longest road a fork is where the track begins.
        while let Ok(Some(before)) = self.follow(&stretches[0], false) {
            if stretches.iter().any(|it| it.is_same_section(&before)) {
                break;
            }
            stretches.insert(0, before);
        }
        Ok(RoadRoute { stretches, closed: false })
    }

    /// The route along these roads.
    ///
    /// # Errors
    /// When there is no such road, or one does not follow the one before.
    pub fn route_along(&self, names: &[String]) -> Result<RoadRoute, Error> {
        let roads: Vec<RoadId> = names.iter().map(|name| self.road(name.trim())).collect::<Result<_, _>>()?;
        let starts = self.starts(roads[0]);
        if starts.is_empty() {
            return Err(Error::NoLanes);
        }
        let mut failed = None;
        for start in &starts {
            match self.route_from(start.clone(), &roads) {
                Ok(route) => return Ok(route),
                Err(error) => failed = failed.or(Some(error)),
            }
        }
        // Of the first two roads both directions count.
        let ends: Vec<RoadStretch> =
            self.ends(roads[0]).iter().flat_map(|end| self.linked(end, true)).collect();
        match failed {
            Some(Error::NotLinked { from, to, .. }) if from == self.road_name(roads[0]) => {
                Err(Error::NotLinked { from, to, next: format!("what follows it: {}", self.names(&ends)) })
            }
            failed => Err(failed.unwrap_or(Error::NoLanes)),
        }
    }

    fn route_from(&self, start: RoadStretch, roads: &[RoadId]) -> Result<RoadRoute, Error> {
        let mut stretches = vec![start];
        let mut at = 0;
        loop {
            let next = self.linked(&stretches[stretches.len() - 1], true);
            let is_new = |it: &&RoadStretch| stretches.iter().all(|before| !before.is_same_section(it));
            if let Some(same) = next.iter().filter(is_new).find(|it| it.road == roads[at]) {
                stretches.push(same.clone());
                continue;
            }
            at += 1;
            if at == roads.len() {
                let closed = next.iter().any(|it| it.is_same_section(&stretches[0]));
                return Ok(RoadRoute { stretches, closed });
            }
            let Some(on) = next.iter().find(|it| it.road == roads[at]) else {
                return Err(Error::NotLinked {
                    from: self.road_name(roads[at - 1]),
                    to: self.road_name(roads[at]),
                    next: format!("what follows it: {}", self.names(&next)),
                });
            };
            stretches.push(on.clone());
        }
    }

    /// A road by its identifier in the file.
    fn road(&self, name: &str) -> Result<RoadId, Error> {
        let found = self.network.road_by_od_id(name).map(xodr::Road::id);
        found.ok_or_else(|| {
            let all = self.network.roads();
            let known: Vec<&str> = all.iter().take(MOST_NAMES).map(xodr::Road::od_id).collect();
            let more = if all.len() > MOST_NAMES {
                format!(" and {} more", all.len() - MOST_NAMES)
            } else {
                String::new()
            };
            Error::UnknownRoad { road: name.to_owned(), known: format!("{}{more}", known.join(", ")) }
        })
    }
}
