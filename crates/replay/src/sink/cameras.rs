//! Places the cameras of the scene: behind the body, and above all of the driven line.

use re_sdk::blueprint::{ContainerLike, Spatial3DView};
use re_sdk_types::blueprint::archetypes::{Background, EyeControls3D, LineGrid3D};
use re_sdk_types::blueprint::components::{BackgroundKind, Eye3DKind};

use super::arrows;
use super::properties::ViewProperties;
use super::run_slot::OTHER;
use super::trace::{MapBounds, MapExtent};

/// Half the viewer's vertical field of view: tan(55 deg / 2).
const HALF_VIEW: f32 = 0.5206;

/// The camera is fixed to the body, because the origin of the view is the body.
pub(super) fn chase_camera_view(properties: &mut ViewProperties, length: f32) -> ContainerLike {
    let eye = EyeControls3D::new()
        .with_kind(Eye3DKind::Orbital)
        .with_position([-1.6 * length, 0.0, 0.95 * length])
        .with_look_target([0.5 * length, 0.0, 0.1 * length])
        .with_eye_up([0.0, 0.0, 1.0]);
    let view = Spatial3DView::new("Chase camera").with_origin("/world/car").with_contents([
        "+ /world/**".to_owned(),
        "- /world/car/marker".to_owned(),
        "- /world/car/heading".to_owned(),
        "- /world/path/marks".to_owned(),
        "- /world/path/scale".to_owned(),
        format!("- /world/{OTHER}/car/marker"),
        format!("- /world/{OTHER}/car/heading"),
    ]);
    // The viewer's own grid would move with the origin of the view, which is the body.
    spatial_view(properties, view, &eye, &LineGrid3D::new().with_visible(false))
}

pub(super) fn map_view(properties: &mut ViewProperties, bounds: Option<MapBounds>) -> ContainerLike {
    // The ground is a patch around the car; seen from high above the viewer's own grid does better.
    let view = Spatial3DView::new("Map (top)").with_origin("/world").with_contents([
        "+ /world/**".to_owned(),
        "- /world/ground".to_owned(),
        format!("- /{}/**", arrows::ROOT),
    ]);
    let grid = LineGrid3D::new().with_spacing(10.0).with_color([54, 54, 62, 255]);
    let eye = EyeControls3D::new().with_kind(Eye3DKind::Orbital);
    let eye = match bounds {
        Some(bounds) => look_down_at_bounds(eye, bounds),
        None => eye
            .with_eye_up([0.0, 1.0, 0.0])
            .with_position([0.0, -1.0, 200.0])
            .with_look_target([0.0, 0.0, 0.0])
            .with_tracking_entity("/world/car/frame"),
    };
    spatial_view(properties, view, &eye, &grid)
}

/// Looks straight down at all of `bounds`, with the longer edge of them from left to right.
fn look_down_at_bounds(eye: EyeControls3D, bounds: MapBounds) -> EyeControls3D {
    let MapExtent { centre: [x, y], up, half_height } = bounds.map_extent();
    let distance = half_height / HALF_VIEW;
    // Exactly above its target the eye would have no upward direction.
    let aside = -1e-3 * distance;
    eye.with_eye_up([up[0], up[1], 0.0])
        .with_position([x + aside * up[0], y + aside * up[1], distance])
        .with_look_target([x, y, 0.0])
}

fn spatial_view(
    properties: &mut ViewProperties,
    view: Spatial3DView,
    eye: &EyeControls3D,
    grid: &LineGrid3D,
) -> ContainerLike {
    let background = Background::new(BackgroundKind::SolidColor).with_color([18, 18, 22, 255]);
    properties.add_to_view(view, [("EyeControls3D", eye), ("LineGrid3D", grid), ("Background", &background)])
}
