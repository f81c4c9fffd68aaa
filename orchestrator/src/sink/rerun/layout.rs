//! Lays out the viewer: which views there are, where they are, and how their cameras and axes are set.

use rerun::blueprint::{
    Blueprint, BlueprintActivation, BlueprintPanel, ContainerLike, Horizontal, SelectionPanel,
    Spatial3DView, Tabs, TextDocumentView, TextLogView, TimePanel, TimeSeriesView, Vertical,
    VisualizableArchetype,
};
use rerun::components::InterpolationMode;
use rerun::external::re_log_types::{BlueprintActivationCommand, LogMsg, StoreKind};
use rerun::external::re_sdk_types::blueprint::archetypes::{
    Background, EyeControls3D, LineGrid3D, PlotLegend, TextLogColumns, TimeAxis,
};
use rerun::external::re_sdk_types::blueprint::components::{
    BackgroundKind, Corner2D, Eye3DKind, LinkAxis, LoopMode, PanelState, PlayState,
};
use rerun::external::re_sdk_types::blueprint::datatypes::{
    TextLogColumn, TextLogColumnKind, TimelineColumn,
};
use rerun::{
    ApplicationId, AsComponents, EntityPath, RecordingStream, RecordingStreamBuilder,
    RecordingStreamResult, SerializedComponentBatch, SeriesLines,
};

use super::signals::{Chart, Line};
use super::trace::Bounds;
use super::{ESTIMATE, LIMIT, MEASUREMENT, PLANT, REFERENCE, WHITE};
use crate::view::Role;

/// Plots that are visible at once; the last place holds all that are left, as tabs.
const PLOTS_VISIBLE: usize = 5;
/// Width by height of the map, which decides how high its camera is.
const MAP_ASPECT: f32 = 2.2;
/// Half the viewer's vertical field of view: tan(55 deg / 2).
const HALF_VIEW: f32 = 0.5206;

/// Colours of curves that stand for nothing in particular: Okabe and Ito's purple and yellow, and two
/// that can be told from them and from the roles' colours without red-green vision.
const OTHERS: [[u8; 3]; 4] = [[204, 121, 167], [240, 228, 66], [136, 136, 238], WHITE];

/// How a recording is shown.
pub(super) struct Layout {
    pub application: ApplicationId,
    pub charts: Vec<Chart>,
    /// What analyses added: a name and its plots.
    pub derived: Vec<(String, Vec<Chart>)>,
    /// The entities of texts, which are shown among the events.
    pub texts: Vec<EntityPath>,
    /// Length of the moving body [m], when there is one.
    pub body: Option<f32>,
    /// Whether the run is watched while it happens.
    pub live: bool,
}

impl Layout {
    /// Sends the layout. The map shows `bounds` as a whole; without them it follows the body.
    pub fn send(
        &self,
        stream: &RecordingStream,
        bounds: Option<Bounds>,
    ) -> RecordingStreamResult<()> {
        let mut properties = Properties::default();
        let root = self.root(&mut properties, bounds);
        let (play, repeat) = match self.live {
            true => (PlayState::Following, LoopMode::Off),
            false => (PlayState::Playing, LoopMode::All),
        };
        let blueprint = Blueprint::new(root)
            .with_auto_views(false)
            .with_auto_layout(false)
            .with_blueprint_panel(BlueprintPanel::from_state(PanelState::Collapsed))
            .with_selection_panel(SelectionPanel::from_state(PanelState::Collapsed))
            .with_time_panel(
                TimePanel::new()
                    .with_state(PanelState::Collapsed)
                    .with_timeline(super::TIME)
                    .with_play_state(play)
                    .with_loop_mode(repeat),
            );
        properties.send(stream, &self.application, &blueprint)
    }

    fn root(&self, properties: &mut Properties, bounds: Option<Bounds>) -> ContainerLike {
        let texts = texts(properties, &self.texts);
        let left = match self.body {
            Some(length) => {
                let (chase, map) = (chase(properties, length), map(properties, bounds));
                let left = Vertical::new([chase, map, texts]);
                left.with_row_shares(vec![1.0, 1.0, 0.75]).into()
            }
            None => texts,
        };
        if self.charts.is_empty() && self.derived.is_empty() {
            return left;
        }
        let plots_share = if self.body.is_some() { 1.3 } else { 2.5 };
        let right = match self.derived.is_empty() {
            true => self.plots(properties),
            false => self.with_derived(properties),
        };
        Horizontal::new([left, right]).with_column_shares(vec![1.0, plots_share]).into()
    }

    /// The plots of the run, and beside them a tab for all that belongs together of an analysis.
    fn with_derived(&self, properties: &mut Properties) -> ContainerLike {
        let mut tabs = Vec::new();
        if !self.charts.is_empty() {
            tabs.push(Vertical::new([self.plots(properties)]).with_name("Run").into());
        }
        for (name, charts) in &self.derived {
            let plots: Vec<_> = charts.iter().map(|it| plot(properties, it)).collect();
            tabs.push(Vertical::new(plots).with_name(name.as_str()).into());
        }
        Tabs::new(tabs).into()
    }

    fn plots(&self, properties: &mut Properties) -> ContainerLike {
        let charts = self.charts.iter();
        let mut plots: Vec<_> = charts.map(|it| plot(properties, it)).collect();
        if plots.len() > PLOTS_VISIBLE {
            let rest = plots.split_off(PLOTS_VISIBLE - 1);
            plots.push(Tabs::new(rest).into());
        }
        Vertical::new(plots).into()
    }
}

fn plot(properties: &mut Properties, chart: &Chart) -> ContainerLike {
    let contents = chart.lines.iter().map(|it| format!("+ {}", it.path));
    let mut view = TimeSeriesView::new(chart.title.as_str()).with_contents(contents);
    let mut palette = Palette::default();
    for line in &chart.lines {
        let style = style(line, palette.color(line.role, &line.label));
        view = view.with_override(line.path.clone(), style.visualizer());
    }
    let legend = PlotLegend::new().with_corner(Corner2D::RightTop);
    let linked = TimeAxis::new().with_link(LinkAxis::LinkToGlobal);
    properties.add(view, [("PlotLegend", &legend), ("TimeAxis", &linked)])
}

fn style(line: &Line, color: [u8; 3]) -> SeriesLines {
    let width = match line.role {
        Role::Plant => 2.0,
        Role::Measurement => 0.75,
        Role::Other | Role::Reference | Role::Estimate | Role::Limit => 1.5,
    };
    let style = SeriesLines::new()
        .with_names([line.label.as_str()])
        .with_colors([color])
        .with_widths([width]);
    match line.stepped {
        true => style.with_interpolation_mode(InterpolationMode::StepAfter),
        false => style,
    }
}

/// Gives every curve of one plot its own colour.
#[derive(Default)]
struct Palette<'a> {
    used: Vec<(Role, &'a str)>,
}

impl<'a> Palette<'a> {
    /// Curves of one role and one name, such as two sides of a limit, share their colour, because they
    /// share their place in the legend.
    fn color(&mut self, role: Role, label: &'a str) -> [u8; 3] {
        if !self.used.contains(&(role, label)) {
            self.used.push((role, label));
        }
        let same_role = self.used.iter().filter(|it| it.0 == role);
        let before = same_role.take_while(|it| it.1 != label).count();
        let (color, rounds) = match role {
            Role::Other => (OTHERS[before % OTHERS.len()], before / OTHERS.len()),
            Role::Reference => (REFERENCE, before),
            Role::Plant => (PLANT, before),
            Role::Measurement => (MEASUREMENT, before),
            Role::Estimate => (ESTIMATE, before),
            Role::Limit => (LIMIT, before),
        };
        shade(color, rounds)
    }
}

/// The second curve of a role is lighter, the third darker.
fn shade(color: [u8; 3], round: usize) -> [u8; 3] {
    let (toward, share) = match round % 3 {
        0 => return color,
        1 => (255.0, 0.5),
        _ => (0.0, 0.4),
    };
    color.map(|it| (f32::from(it) * (1.0 - share) + toward * share) as u8)
}

fn texts(properties: &mut Properties, texts: &[EntityPath]) -> ContainerLike {
    let texts = texts.iter().map(|path| format!("+ {path}"));
    let contents = ["+ /events/**".to_owned()].into_iter().chain(texts);
    let events = TextLogView::new("Events").with_origin("/").with_contents(contents);
    let time = TimelineColumn { visible: true.into(), timeline: super::TIME.into() };
    let shown = [TextLogColumnKind::LogLevel, TextLogColumnKind::Body]
        .map(|kind| TextLogColumn { visible: true.into(), kind });
    let columns = TextLogColumns::new().with_timeline_columns([time]).with_text_log_columns(shown);
    let events = properties.add(events, [("TextLogColumns", &columns)]);
    Tabs::new([
        TextDocumentView::new("Run").with_origin("/run").into(),
        events,
        TextDocumentView::new("Scenario").with_origin("/scenario").into(),
    ])
    .into()
}

/// The camera is fixed to the body, because the origin of the view is the body.
fn chase(properties: &mut Properties, length: f32) -> ContainerLike {
    let eye = EyeControls3D::new()
        .with_kind(Eye3DKind::Orbital)
        .with_position([-1.6 * length, 0.0, 0.95 * length])
        .with_look_target([0.5 * length, 0.0, 0.1 * length])
        .with_eye_up([0.0, 0.0, 1.0]);
    let view = Spatial3DView::new("Chase camera").with_origin("/world/car").with_contents([
        "+ /world/**",
        "- /world/car/marker",
        "- /world/car/heading",
        "- /world/path/marks",
    ]);
    // The viewer's own grid would move with the origin of the view, which is the body.
    spatial(properties, view, &eye, &LineGrid3D::new().with_visible(false))
}

fn map(properties: &mut Properties, bounds: Option<Bounds>) -> ContainerLike {
    // The ground is a patch around the car; seen from high above the viewer's own grid does better.
    let view = Spatial3DView::new("Map (top)")
        .with_origin("/world")
        .with_contents(["+ /world/**", "- /world/ground"]);
    let grid = LineGrid3D::new().with_spacing(10.0).with_color([54, 54, 62, 255]);
    let eye = EyeControls3D::new().with_kind(Eye3DKind::Orbital);
    let eye = match bounds {
        Some(bounds) => above(eye, bounds),
        None => eye
            .with_eye_up([0.0, 1.0, 0.0])
            .with_position([0.0, -1.0, 200.0])
            .with_look_target([0.0, 0.0, 0.0])
            .with_tracking_entity("/world/car/frame"),
    };
    spatial(properties, view, &eye, &grid)
}

/// Looks straight down at all of `bounds`, with the longer edge of them from left to right.
fn above(eye: EyeControls3D, bounds: Bounds) -> EyeControls3D {
    let [width, depth] = [0, 1].map(|axis| bounds.high[axis] - bounds.low[axis]);
    let [x, y] = [0, 1].map(|axis| 0.5 * (bounds.high[axis] + bounds.low[axis]));
    let up = if depth > width { [-1.0, 0.0] } else { [0.0, 1.0] };
    let (wide, tall) = (width.max(depth), width.min(depth));
    // 20 % and 10 m of air around the line.
    let height = 1.2 * tall.max(wide / MAP_ASPECT) + 10.0;
    let distance = 0.5 * height / HALF_VIEW;
    // Exactly above its target the eye would have no direction to call up.
    let aside = -1e-3 * distance;
    eye.with_eye_up([up[0], up[1], 0.0])
        .with_position([x + aside * up[0], y + aside * up[1], distance])
        .with_look_target([x, y, 0.0])
}

fn spatial(
    properties: &mut Properties,
    view: Spatial3DView,
    eye: &EyeControls3D,
    grid: &LineGrid3D,
) -> ContainerLike {
    let background = Background::new(BackgroundKind::SolidColor).with_color([18, 18, 22, 255]);
    properties
        .add(view, [("EyeControls3D", eye), ("LineGrid3D", grid), ("Background", &background)])
}

/// Settings of views. `rerun::blueprint` has no way to set them, but they are plain archetypes at
/// `view/<id>/<archetype>` of the blueprint's store, so they are added there.
#[derive(Default)]
struct Properties(Vec<(String, Vec<SerializedComponentBatch>)>);

impl Properties {
    fn add<const N: usize>(
        &mut self,
        view: impl Into<ContainerLike>,
        properties: [(&str, &dyn AsComponents); N],
    ) -> ContainerLike {
        let view = view.into();
        if let ContainerLike::View(view) = &view {
            for (name, archetype) in properties {
                let path = format!("{}/{name}", view.blueprint_path());
                self.0.push((path, archetype.as_serialized_batches()));
            }
        }
        view
    }

    fn send(
        self,
        stream: &RecordingStream,
        application: &ApplicationId,
        blueprint: &Blueprint,
    ) -> RecordingStreamResult<()> {
        let (scratch, storage) = RecordingStreamBuilder::new(application.clone()).memory()?;
        blueprint.send(&scratch, BlueprintActivation::default())?;
        let mut messages = storage.take();
        messages.retain(|it| {
            let activates = matches!(it, LogMsg::BlueprintActivationCommand(_));
            it.store_id().kind() == StoreKind::Blueprint && !activates
        });
        let Some(id) = messages.first().map(|it| it.store_id().clone()) else {
            return Ok(());
        };
        let (extra, storage) = RecordingStreamBuilder::from_store_id(&id).memory()?;
        // Every blueprint lives on a timeline of this name.
        extra.set_time_sequence("blueprint", 0);
        for (path, batches) in self.0 {
            extra.log_serialized_batches(path, false, batches)?;
        }
        let settings = storage.take();
        messages.extend(settings.into_iter().filter(|it| matches!(it, LogMsg::ArrowMsg(..))));
        let activation =
            BlueprintActivationCommand { blueprint_id: id, make_active: true, make_default: true };
        stream.send_blueprint(messages, activation);
        Ok(())
    }
}
