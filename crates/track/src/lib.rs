//! Follows lines: centre lines of tracks from tables of points, how fast a car can drive along one, and the steering and the
//! speed that keep it there. It knows no car: what a car can do comes in as numbers.
//!
//! Everything is in SI units and radians, in the axes of ISO 8855: x forward, y to the left, z up. Stations `s` [m] are counted
//! along the line, lateral deviations are positive to its left, curvature is positive in left turns. A positive bank angle
//! lifts the left side of the road, a positive grade goes uphill.
//!
//! ```
//! use track::{AccelerationLimits, GgvDiagram, SpeedProfile, TrackLine};
//!
//! let square = "x, y\n0, 0\n50, 0\n100, 50\n50, 100\n0, 100\n-50, 50";
//! let line = TrackLine::from_table_text(square)?;
//! assert!(line.is_closed());
//! let limits = AccelerationLimits { lateral: 8.0, drive: 4.0, brake: 9.0, ..AccelerationLimits::at_speed(60.0) };
//! let ggv = GgvDiagram::new(vec![limits], 2.0)?;
//! let profile = SpeedProfile::fastest_on_line(&line, &ggv, &Default::default())?;
//! assert!(profile.travel_time() > 10.0);
//! let place = line.locate_point([51.0, 1.0], None);
//! assert!(place.lateral > 0.0);
//! # Ok::<(), track::Error>(())
//! ```
#![forbid(unsafe_code)]
#![allow(rustdoc::broken_intra_doc_links, reason = "units stand in brackets, which rustdoc takes for links")]

mod angle;
mod error;
mod geodesy;
mod ggv;
mod line;
mod profile;
mod projection;
mod speed;
mod spline;
mod steering;
mod survey;

pub use angle::wrap_angle;
pub use error::Error;
pub use geodesy::LocalPlane;
pub use ggv::{AccelerationLimits, GgvDiagram, RoadGeometry};
pub use line::{LinePoint, TrackLine};
pub use profile::{SpeedBounds, SpeedProfile};
pub use projection::LineStation;
pub use speed::{SpeedCommand, SpeedLaw};
pub use steering::{HeadingAndSpeed, PathSteeringLaw, SteadyStateHandling, TireLoadCondition};
pub use survey::{TrackSurvey, point_distance};
