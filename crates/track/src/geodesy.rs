//! Turns latitudes and longitudes into positions on a plane that touches the Earth.

/// Semi-major axis of the ellipsoid of WGS 84 [m].
const SEMI_MAJOR_AXIS: f64 = 6_378_137.0;
/// Flattening of the ellipsoid of WGS 84.
const FLATTENING: f64 = 1.0 / 298.257_223_563;

/// A plane that touches the ellipsoid of WGS 84 at its origin, with x to the east and y to the north. Within 10 km of it distances are
/// right to 5 mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalPlane {
    /// Latitude of the origin [deg], positive to the north.
    pub latitude: f64,
    /// Longitude of the origin [deg], positive to the east.
    pub longitude: f64,
}

impl LocalPlane {
    /// The position [m] of a point at a latitude and a longitude [deg], at the height of the ellipsoid.
    #[must_use]
    pub fn position(&self, latitude: f64, longitude: f64) -> [f64; 2] {
        let [x, y, z] = geocentric_position(latitude, longitude - self.longitude);
        let origin = geocentric_position(self.latitude, 0.0);
        let (sin, cos) = self.latitude.to_radians().sin_cos();
        [y, cos * (z - origin[2]) - sin * (x - origin[0])]
    }

    /// The line of a table of a track that tells its origin.
    #[must_use]
    pub fn comment(&self) -> String {
        format!("# origin {} {}\n", self.latitude, self.longitude)
    }

    /// The plane of `origin LATITUDE LONGITUDE`, if it is one.
    pub(crate) fn parse(words: &str) -> Option<Self> {
        let numbers = words.strip_prefix("origin ")?.split_whitespace();
        let numbers: Option<Vec<f64>> = numbers.map(|word| word.parse().ok()).collect();
        let &[latitude, longitude] = numbers.as_deref()? else { return None };
        (latitude.abs() <= 90.0 && longitude.abs() <= 360.0).then_some(LocalPlane { latitude, longitude })
    }
}

/// Coordinates fixed to the Earth [m]: x through the meridian from which the longitude counts, z through the pole.
fn geocentric_position(latitude: f64, longitude: f64) -> [f64; 3] {
    let ([sin, cos], [sin_longitude, cos_longitude]) =
        (sin_cos_of_degrees(latitude), sin_cos_of_degrees(longitude));
    let eccentricity_squared = FLATTENING * (2.0 - FLATTENING);
    let radius = SEMI_MAJOR_AXIS / (1.0 - eccentricity_squared * sin * sin).sqrt();
    [radius * cos * cos_longitude, radius * cos * sin_longitude, radius * (1.0 - eccentricity_squared) * sin]
}

fn sin_cos_of_degrees(angle: f64) -> [f64; 2] {
    <[f64; 2]>::from(angle.to_radians().sin_cos())
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    /// One minute of latitude and of longitude at 45 degrees: 1852.2 m and 1314.2 m (lengths of a degree of WGS 84: 111 132 m and
    /// 78 847 m, National Geospatial-Intelligence Agency).
    #[test]
    fn minutes_at_45_degrees_have_their_known_lengths() {
        let plane = LocalPlane { latitude: 45.0, longitude: 179.999 };
        let minute = 1.0 / 60.0;
        let [east, north] = plane.position(45.0, 179.999 + minute - 360.0);
        assert_relative_eq!(east, 78_847.0 / 60.0, epsilon = 0.02);
        assert!(north.abs() < 0.2, "{north}");
        let [east, north] = plane.position(45.0 + minute, 179.999);
        assert_relative_eq!(north, 111_132.0 / 60.0, epsilon = 0.2);
        assert!(east.abs() < 1e-6, "{east}");
    }

    /// From the chord between two points on the ellipsoid, 10 km apart.
    #[test]
    fn distances_are_right_to_5_mm_within_10_km() {
        let plane = LocalPlane { latitude: -33.0, longitude: 151.0 };
        let [x, y] = plane.position(-33.06, 151.08);
        let [a, b] = [geocentric_position(-33.0, 0.0), geocentric_position(-33.06, 0.08)];
        let chord = (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt();
        assert!((9e3..1.1e4).contains(&chord) && (chord - x.hypot(y)).abs() < 5e-3, "{chord} {x} {y}");
    }
}
