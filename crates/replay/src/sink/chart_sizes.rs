//! Divides plots that no scenario laid out by the size of their curves: a small one would be a flat line below a large one.

use re_sdk::EntityPath;

use super::signals::{ChartCurve, TimeChart};

/// A curve reaches at least this share of the largest one in its plot.
const SHARE: f64 = 0.1;
/// Names of curves in a title at most.
const NAMES: usize = 3;

/// The curves of one name, of both runs, with their limits.
struct CurveGroup {
    /// Their place in the plot.
    place: usize,
    label: String,
    /// Whether their values hold until the next sample.
    stepped: bool,
    /// The largest of their values without sign.
    size: f64,
}

/// The plots, with those of a group divided by the size of their curves; `span` gives the lowest and the highest value of an entity.
pub(super) fn divide_by_size(
    charts: Vec<TimeChart>,
    span: &impl Fn(&EntityPath) -> Option<[f64; 2]>,
) -> Vec<TimeChart> {
    let mut all = Vec::new();
    for chart in charts {
        match chart.group.is_some() && chart.range.is_none() {
            true => all.extend(divided_chart(chart, span)),
            false => all.push(chart),
        }
    }
    all
}

fn divided_chart(chart: TimeChart, span: &impl Fn(&EntityPath) -> Option<[f64; 2]>) -> Vec<TimeChart> {
    let parts = curves_of_one_size(named_curves(&chart.lines, span));
    if parts.len() < 2 {
        return vec![chart];
    }
    let TimeChart { title, group, range, legend, mut lines, .. } = chart;
    let part = |(number, labels): (usize, Vec<String>)| {
        let own = |line: &mut ChartCurve| labels.iter().any(|label| label == line.owner_label());
        let named = labels.iter().take(NAMES).map(String::as_str).collect::<Vec<_>>().join(", ");
        let more = if labels.len() > NAMES { ", …" } else { "" };
        let legend = match number {
            0 => legend.clone(),
            _ => legend.join(&EntityPath::from(number.to_string().as_str())),
        };
        let title = format!("{title}: {named}{more}");
        TimeChart {
            title,
            group: group.clone(),
            range,
            span: None,
            legend,
            lines: lines.extract_if(.., own).collect(),
        }
    };
    parts.into_iter().enumerate().map(part).collect()
}

/// The curves by their names, in the order of the plot.
fn named_curves(lines: &[ChartCurve], span: &impl Fn(&EntityPath) -> Option<[f64; 2]>) -> Vec<CurveGroup> {
    let mut named: Vec<CurveGroup> = Vec::new();
    for line in lines.iter().filter(|line| line.limit_of.is_none()) {
        let size = span(&line.path).map_or(0.0, |[low, high]| low.abs().max(high.abs()));
        match named.iter_mut().find(|it| it.label == line.label) {
            Some(known) => known.size = known.size.max(size),
            None => {
                let (place, label, stepped) = (named.len(), line.label.clone(), line.stepped);
                named.push(CurveGroup { place, label, stepped, size });
            }
        }
    }
    named
}

/// The names that one plot can show, in their order: curves of one size, and flags apart from quantities. What is always 0 goes
/// with the smallest ones.
fn curves_of_one_size(mut named: Vec<CurveGroup>) -> Vec<Vec<String>> {
    named.sort_by(|one, other| one.stepped.cmp(&other.stepped).then(other.size.total_cmp(&one.size)));
    let mut parts: Vec<(f64, Vec<CurveGroup>)> = Vec::new();
    for curves in named {
        let fits = parts.last().is_some_and(|(largest, part)| {
            let alike = part.first().is_some_and(|it| it.stepped == curves.stepped);
            alike && (curves.size == 0.0 || curves.size >= SHARE * largest)
        });
        match parts.last_mut().filter(|_| fits) {
            Some((_, part)) => part.push(curves),
            None => parts.push((curves.size, vec![curves])),
        }
    }
    let mut parts: Vec<_> = parts.into_iter().map(|(_, part)| part).collect();
    parts.iter_mut().for_each(|part| part.sort_by_key(|it| it.place));
    parts.sort_by_key(|part| part.first().map(|it| it.place));
    parts.into_iter().map(|part| part.into_iter().map(|it| it.label).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::{CurveGroup, curves_of_one_size};

    fn parts(curves: &[(&str, f64, bool)]) -> Vec<Vec<String>> {
        let named = curves.iter().enumerate().map(|(place, &(label, size, stepped))| CurveGroup {
            place,
            label: label.to_owned(),
            stepped,
            size,
        });
        curves_of_one_size(named.collect())
    }

    #[test]
    fn small_curves_and_flags_have_plots_of_their_own() {
        let angles =
            [("psi", 0.7, false), ("alpha_f", 0.03, false), ("delta", 0.026, false), ("bank", 0.0, false)];
        assert_eq!(parts(&angles), [vec!["psi"], vec!["alpha_f", "delta", "bank"]]);
        assert_eq!(parts(&[("X", 100.0, false), ("Y", 28.0, false)]), [["X", "Y"]]);
        let rates = [("r", 0.2, false), ("omega_f", 92.0, false), ("omega_r", 91.0, false)];
        assert_eq!(parts(&rates), [vec!["r"], vec!["omega_f", "omega_r"]]);
        let numbers = [("slip", 0.9, false), ("alarm", 1.0, true), ("ratio", 0.4, false)];
        assert_eq!(parts(&numbers), [vec!["slip", "ratio"], vec!["alarm"]]);
        assert_eq!(parts(&[("zero", 0.0, false), ("also", 0.0, false)]), [["zero", "also"]]);
        assert_eq!(parts(&[]), Vec::<Vec<String>>::new());
    }
}
