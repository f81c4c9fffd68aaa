//! Lays out the viewer: its views, their arrangement, cameras and axes.

use re_sdk::blueprint::{
    Blueprint, BlueprintPanel, ContainerLike, GraphView, Grid, Horizontal, SelectionPanel, Spatial2DView,
    StateTimelineView, Tabs, TextDocumentView, TextLogView, TimePanel, TimeSeriesView, Vertical,
    VisualizableArchetype,
};
use re_sdk::{ApplicationId, EntityPath, RecordingStream, RecordingStreamResult};
use re_sdk_types::archetypes::SeriesLines;
use re_sdk_types::blueprint::archetypes::{
    PlotLegend, ScalarAxis, TextLogColumns, TimeAxis, VisibleTimeRanges, VisualBounds2D,
};
use re_sdk_types::blueprint::components::{LinkAxis, LoopMode, PanelState, PlayState};
use re_sdk_types::blueprint::datatypes::{TextLogColumn, TextLogColumnKind, TimelineColumn};
use re_sdk_types::components::Color;
use re_sdk_types::components::InterpolationMode;
use re_sdk_types::datatypes::{Range2D, TimeInt, TimeRange, TimeRangeBoundary, VisibleTimeRange};
use recording::AnalysisColumns;
use recording::view::CurveRole;

use super::cameras::{chase_camera_view, map_view};
use super::chart_sizes::divide_by_size;
use super::diagrams::{AnalysisDiagrams, DiagramGroup};
use super::legend::ChartLegend;
use super::palette::{CurvePalette, with_opacity};
use super::properties::ViewProperties;
use super::run_slot::OTHER;
use super::signals::{ChartCurve, TimeChart, derived_charts};
use super::timeline::{DISTANCE, TIME};
use super::trace::MapBounds;
use super::xy_plots::DiagramView;
use super::{axis, graph, status_tracks};

/// Plots that are visible at once; the last slot holds the rest as tabs.
const PLOTS_VISIBLE: usize = 5;
/// Width of the plots with their legends in a window of usual size [px].
const PLOTS_WIDTH: f32 = 790.0;
/// Width of a legend at least, for its title [px].
const KEY_WIDTH: f32 = 130.0;

/// What is played before and after the first difference of two runs [s].
const OPENING: [f64; 2] = [0.5, 2.0];

/// The plots of a group, with its name.
type NamedCharts = (String, Vec<TimeChart>);

/// The layout of a recording.
pub(super) struct ViewerLayout {
    pub application: ApplicationId,
    pub charts: Vec<TimeChart>,
    /// Columns of analyses: the plots of each group, by analysis and group.
    pub derived: Vec<(String, Vec<NamedCharts>)>,
    /// Diagrams of one quantity over another.
    pub xy_plots: Vec<DiagramView>,
    /// Diagrams of analyses.
    pub diagrams: AnalysisDiagrams,
    /// Whether there is a status track or a text.
    pub states: bool,
    /// The entities of texts, which are shown among the events.
    pub texts: Vec<EntityPath>,
    /// Whether a second run is drawn.
    pub compared: bool,
    /// Length of the moving body [m], if there is one.
    pub body: Option<f32>,
    /// Whether the nodes and their connections are drawn.
    pub graph: bool,
    /// Whether a viewer can watch the run while it happens.
    pub live: bool,
    /// The time around which the viewer plays at first [s]; all of the run without it.
    pub opening_time: Option<f64>,
}

impl ViewerLayout {
    /// Adds plots of columns of an analysis.
    pub fn add_analysis_charts(&mut self, derived: &AnalysisColumns) {
        let group = (derived.group.to_owned(), derived_charts(derived));
        match self.derived.iter_mut().find(|(analysis, _)| analysis == derived.analysis) {
            Some((_, groups)) => groups.push(group),
            None => self.derived.push((derived.analysis.to_owned(), vec![group])),
        }
    }

    /// Fits plots and axes to the values of the entities. Until then the viewer chooses the ends of axes.
    pub fn fit_axes(&mut self, span: impl Fn(&EntityPath) -> Option<[f64; 2]>) {
        self.charts = divide_by_size(std::mem::take(&mut self.charts), &span);
        for chart in &mut self.charts {
            let spans: Vec<_> = chart.lines.iter().map(|line| span(&line.path)).collect();
            spans.into_iter().for_each(|span| chart.widen_range(span));
        }
    }

    /// Sends the layout. The map shows `bounds` as a whole; without them it follows the body.
    pub fn send_blueprint(
        &self,
        stream: &RecordingStream,
        bounds: Option<MapBounds>,
    ) -> RecordingStreamResult<()> {
        let derived = self.derived.iter().flat_map(|(_, groups)| groups).flat_map(|it| &it.1);
        for chart in self.charts.iter().chain(derived) {
            ChartLegend::of_chart(chart).send_entries(stream, &chart.legend)?;
        }
        let mut properties = ViewProperties::default();
        let root = self.run_and_diagram_tabs(&mut properties, bounds);
        let (play, repeat) = match self.live {
            true => (PlayState::Following, LoopMode::Off),
            false if self.opening_time.is_some() => (PlayState::Playing, LoopMode::Selection),
            false => (PlayState::Playing, LoopMode::All),
        };
        let mut time_panel = TimePanel::new()
            .with_state(PanelState::Collapsed)
            .with_timeline(TIME)
            .with_play_state(play)
            .with_loop_mode(repeat);
        if let Some(time) = self.opening_time {
            let [before, after] = OPENING;
            let (begin, end) = (
                re_sdk::time::TimeInt::from_secs((time - before).max(0.0)),
                re_sdk::time::TimeInt::from_secs(time + after),
            );
            time_panel = time_panel.with_time_selection(begin..=end);
        }
        let blueprint = Blueprint::new(root)
            .with_auto_views(false)
            .with_auto_layout(false)
            .with_blueprint_panel(BlueprintPanel::from_state(PanelState::Collapsed))
            .with_selection_panel(SelectionPanel::from_state(PanelState::Collapsed))
            .with_time_panel(time_panel);
        properties.send_blueprint(stream, &self.application, &blueprint)
    }

    /// The run, and a tab for the diagrams of each analysis.
    fn run_and_diagram_tabs(
        &self,
        properties: &mut ViewProperties,
        bounds: Option<MapBounds>,
    ) -> ContainerLike {
        let run = self.run_container(properties, bounds);
        if self.diagrams.is_empty() {
            return run;
        }
        let found = self.diagrams.groups_by_analysis().into_iter().map(|(analysis, groups)| {
            let name = analysis;
            let mut pairs = Vec::new();
            for pair in groups.chunks(2) {
                let columns: Vec<_> = pair.iter().map(|it| diagram_group_container(properties, it)).collect();
                let names: Vec<_> = pair.iter().map(|it| it.name.as_str()).collect();
                pairs.push(Horizontal::new(columns).with_name(names.join(" | ")));
            }
            match <[Horizontal; 1]>::try_from(pairs) {
                Ok([only]) => only.with_name(name).into(),
                Err(pairs) => Tabs::new(pairs.into_iter().map(ContainerLike::from)).with_name(name).into(),
            }
        });
        let whole = Vertical::new([run]).with_name("The run").into();
        Tabs::new([whole].into_iter().chain(found.collect::<Vec<_>>())).into()
    }

    fn run_container(&self, properties: &mut ViewProperties, bounds: Option<MapBounds>) -> ContainerLike {
        let texts = self.text_tabs(properties);
        let left = match self.body {
            Some(length) => {
                let (chase, map) = (chase_camera_view(properties, length), map_view(properties, bounds));
                let left = Vertical::new([chase, map, texts]);
                left.with_row_shares(vec![1.1, 0.9, 1.0]).into()
            }
            None => texts,
        };
        let mut columns = vec![(left, if self.body.is_some() { 1.0 } else { 0.5 })];
        if !self.xy_plots.is_empty() {
            let xy_plots: Vec<_> = self.xy_plots.iter().map(|it| xy_plot(properties, it)).collect();
            columns.push((Vertical::new(xy_plots).into(), 0.62));
        }
        if !self.charts.is_empty() || !self.derived.is_empty() || self.states {
            columns.push((self.plots_and_analysis_tabs(properties), 1.5));
        }
        let (columns, shares): (Vec<_>, Vec<_>) = columns.into_iter().unzip();
        Horizontal::new(columns).with_column_shares(shares).into()
    }

    /// The plots of the run, and a tab for each group of columns of an analysis.
    fn plots_and_analysis_tabs(&self, properties: &mut ViewProperties) -> ContainerLike {
        let mut tabs = Vec::new();
        if !self.charts.is_empty() || self.states {
            tabs.push(Vertical::new([self.plots_above_status(properties)]).with_name("Run").into());
        }
        for (analysis, groups) in &self.derived {
            let groups = groups.iter().map(|(group, charts)| {
                let plots = charts.iter().map(|it| self.chart_with_legend(properties, it));
                Vertical::new(plots.collect::<Vec<_>>()).with_name(group.as_str()).into()
            });
            let groups: Vec<ContainerLike> = groups.collect();
            tabs.push(Tabs::new(groups).with_name(analysis.as_str()).into());
        }
        match <[ContainerLike; 1]>::try_from(tabs) {
            Ok([only]) => only,
            Err(tabs) => Tabs::new(tabs).into(),
        }
    }

    /// The plots of the run, a tab for each group of them, above the states.
    fn plots_above_status(&self, properties: &mut ViewProperties) -> ContainerLike {
        let mut groups: Vec<&Option<String>> = self.charts.iter().map(|it| &it.group).collect();
        groups.dedup();
        let visible = PLOTS_VISIBLE - usize::from(self.states);
        let mut tabs: Vec<_> = groups
            .iter()
            .map(|group| {
                let charts = self.charts.iter().filter(|it| it.group == **group);
                let plots =
                    stack_plots(charts.map(|it| self.chart_with_legend(properties, it)).collect(), visible);
                plots.with_name(group.as_deref().unwrap_or("Plots"))
            })
            .collect();
        let plots = match tabs.len() {
            0 => None,
            1 => tabs.pop().map(ContainerLike::from),
            _ => Some(Tabs::new(tabs.into_iter().map(ContainerLike::from)).into()),
        };
        let states = self.states.then(|| self.status_timeline(properties));
        let shares = match (&plots, &states) {
            (Some(_), Some(_)) => vec![visible as f32, 1.0],
            _ => vec![1.0],
        };
        Vertical::new(plots.into_iter().chain(states)).with_row_shares(shares).into()
    }

    /// A plot with its legend to the right.
    fn chart_with_legend(&self, properties: &mut ViewProperties, chart: &TimeChart) -> ContainerLike {
        let legend = ChartLegend::of_chart(chart);
        let view = Spatial2DView::new("Key")
            .with_origin(chart.legend.clone())
            .with_contents([format!("+ {}", chart.legend)]);
        let bounds = Range2D { x_range: [0.0, legend.relative_width()].into(), y_range: [0.0, 1.0].into() };
        let view = properties.add_to_view(view, [("VisualBounds2D", &VisualBounds2D::new(bounds))]);
        // All of them have one width, so that the times of all plots are below each other.
        let widths = self.charts.iter().chain([chart]).map(|it| ChartLegend::of_chart(it).width_in_pixels());
        let width = widths.fold(KEY_WIDTH, f32::max).min(0.5 * PLOTS_WIDTH);
        Horizontal::new([chart_view(properties, chart), view])
            .with_column_shares(vec![PLOTS_WIDTH - width, width])
            .with_name(chart.title.as_str())
            .into()
    }

    /// The run card, the events and the scenario.
    fn text_tabs(&self, properties: &mut ViewProperties) -> ContainerLike {
        let texts = self.texts.iter().map(|path| format!("+ {path}"));
        let contents = ["+ /events/**".to_owned(), format!("+ /{OTHER}/events/**")];
        let contents = contents.into_iter().chain(texts);
        let events = TextLogView::new("Events").with_origin("/").with_contents(contents);
        let time = TimelineColumn { visible: true.into(), timeline: TIME.into() };
        let shown = [TextLogColumnKind::LogLevel, TextLogColumnKind::Body]
            .map(|kind| TextLogColumn { visible: true.into(), kind });
        let columns = TextLogColumns::new().with_timeline_columns([time]).with_text_log_columns(shown);
        let events = properties.add_to_view(events, [("TextLogColumns", &columns)]);
        let scenario =
            |name: &str, path: &str| ContainerLike::from(TextDocumentView::new(name).with_origin(path));
        let run = TextDocumentView::new("Run").with_origin("/run").into();
        let mut tabs = vec![run, events, scenario("Scenario", "/scenario")];
        if self.graph {
            tabs.push(GraphView::new("Coupling").with_origin(graph::PATH).into());
        }
        if self.compared {
            tabs.push(scenario("Other scenario", &format!("/{OTHER}/scenario")));
        }
        Tabs::new(tabs).into()
    }

    /// Checks, faults and texts over time.
    fn status_timeline(&self, properties: &mut ViewProperties) -> ContainerLike {
        let texts = self.texts.iter().map(|path| format!("+ {path}"));
        let contents = status_tracks::GROUPS.map(|group| format!("+ /{group}/**")).into_iter().chain(texts);
        let view = StateTimelineView::new("Checks and states").with_origin("/");
        let linked = TimeAxis::new().with_link(LinkAxis::LinkToGlobal);
        properties.add_to_view(view.with_contents(contents), [("TimeAxis", &linked)])
    }
}

/// Plots one below the other; the last slot holds the rest as tabs.
fn stack_plots(mut plots: Vec<ContainerLike>, visible: usize) -> Vertical {
    if plots.len() > visible {
        let rest = plots.split_off(visible - 1);
        plots.push(Tabs::new(rest).into());
    }
    Vertical::new(plots)
}

/// The first diagram of a group above the others.
fn diagram_group_container(properties: &mut ViewProperties, group: &DiagramGroup) -> ContainerLike {
    let mut views = group.views.iter().map(|it| xy_plot(properties, it)).collect::<Vec<_>>();
    let others = views.split_off(views.len().min(1));
    let mut shares = vec![1.0];
    if !others.is_empty() {
        shares.push(1.2);
        views.push(Grid::new(others).with_grid_columns(4).into());
    }
    Vertical::new(views).with_row_shares(shares).with_name(group.name.as_str()).into()
}

/// A diagram with a margin for the numbers of its axes.
fn xy_plot(properties: &mut ViewProperties, shown: &DiagramView) -> ContainerLike {
    let view = Spatial2DView::new(shown.title.as_str())
        .with_origin(format!("/{}", shown.root))
        .with_contents([format!("+ /{}/**", shown.root)]);
    let (width, line) = (shown.width, f64::from(shown.line));
    let bounds = Range2D {
        x_range: [-4.0 * line, width + 2.0 * line].into(),
        y_range: [-2.8 * line, 1.0 + 5.2 * line].into(),
    };
    let view = properties.add_to_view(view, [("VisualBounds2D", &VisualBounds2D::new(bounds))]);
    let trail = trailing_time_ranges(shown.trail);
    for entity in &shown.trails {
        properties.add_to_entity(&view, entity, &trail);
    }
    view
}

/// The last `seconds`; on the timeline of distance the way driven in them at 100 km/h.
fn trailing_time_ranges(seconds: f64) -> VisibleTimeRanges {
    let range = |timeline: &str, length: f64| VisibleTimeRange {
        timeline: timeline.into(),
        range: TimeRange {
            start: TimeRangeBoundary::CursorRelative(TimeInt(-length as i64)),
            end: TimeRangeBoundary::CursorRelative(TimeInt(0)),
        },
    };
    VisibleTimeRanges::new([range(TIME, seconds * 1e9), range(DISTANCE, seconds * 2_780.0)])
}

fn chart_view(properties: &mut ViewProperties, chart: &TimeChart) -> ContainerLike {
    let contents = chart.lines.iter().map(|it| format!("+ {}", it.path));
    let mut view = TimeSeriesView::new(chart.title.as_str()).with_contents(contents);
    // It would hide curves; there is one beside the plot.
    let legend = PlotLegend::new().with_visible(false);
    let mut palette = CurvePalette::default();
    for line in &chart.lines {
        let color = line.slot.run_color(palette.curve_color(line.role, &line.label));
        let style = line_style(line, color);
        view = view.with_override(line.path.clone(), style.visualizer());
    }
    let linked = TimeAxis::new().with_link(LinkAxis::LinkToGlobal);
    let axis = ScalarAxis::new();
    let range = chart.range.or(chart.span.map(axis::readable_axis_range));
    let axis = range.map_or(axis.clone(), |range| axis.with_range(range));
    properties.add_to_view(view, [("PlotLegend", &legend), ("TimeAxis", &linked), ("ScalarAxis", &axis)])
}

fn line_style(line: &ChartCurve, color: Color) -> SeriesLines {
    let width = match line.role {
        CurveRole::Plant => 2.0,
        CurveRole::Measurement => 0.75,
        CurveRole::Other | CurveRole::Reference | CurveRole::Estimate | CurveRole::Limit => 1.5,
    };
    // Where both runs agree, both curves stay visible.
    let width = if line.slot.is_first() { width } else { 0.6 * width };
    let label = line.slot.run_label(&line.label);
    let (name, color, width) = match line.bound {
        true => (format!("{label} ± 2σ"), with_opacity(color, 110), 1.0),
        false => (label, color, width),
    };
    let style = SeriesLines::new().with_names([name]).with_colors([color]).with_widths([width]);
    match line.stepped {
        true => style.with_interpolation_mode(InterpolationMode::StepAfter),
        false => style,
    }
}
