//! Shows how stiffness and friction change with the load, and what longitudinal forces and slips say.

use std::fmt::Write;

use html_page::escape;
use numerics::text::significant;
use tire_inference::load::Effect;
use tire_inference::verdict::Verdict;

use crate::loads::{AxleLoadEffects, SlipStiffness, TOO_FEW};
use crate::names::{class, words};

/// A table for both axles; empty where nothing was told.
pub fn section(told: &[AxleLoadEffects]) -> String {
    if told.is_empty() {
        return String::new();
    }
    let mut html = String::new();
    for it in told.iter().filter_map(|it| Some((it.axle, it.effects.as_ref()?))) {
        let (axle, effects) = it;
        let [low, high] = effects.load.map(|it| significant(it, 3));
        let [back, forth] = effects.longitudinal.map(|it| significant(it, 2));
        let _ = writeln!(
            html,
            "<p class=\"faint\">{axle} axle: load {low} to {high} of that at rest, longitudinal force {back} to {forth} of the load, in nine of ten rows.</p>"
        );
    }
    html.push_str(
        "<table class=\"stack\">\n<tr><th>Quantity</th><th>Value</th><th>95 % interval</th><th>Verdict</th><th>Why</th></tr>\n",
    );
    for AxleLoadEffects { axle, effects, slip_stiffness } in told {
        let effects = effects.as_ref();
        let rows = [
            ("change of stiffness K with load", effects.map(|it| &it.K)),
            ("change of friction D with load", effects.map(|it| &it.D)),
            ("longitudinal friction μ_x of the ellipse", effects.map(|it| &it.mu_x)),
        ];
        for (name, effect) in rows {
            effect_row(&mut html, &format!("{axle}: {name}"), effect);
        }
        let SlipStiffness { found, verdict, reason } = slip_stiffness;
        let ends = found.map(|(_, ends)| ends.map(Some));
        let name = format!("{axle}: stiffness over longitudinal slip");
        row(&mut html, &name, (found.map(|it| it.0), ends), (*verdict, reason));
    }
    html.push_str("</table>\n");
    html
}

fn effect_row(html: &mut String, name: &str, effect: Option<&Effect>) {
    match effect {
        Some(it) => row(html, name, (Some(it.value), Some(it.interval)), (it.verdict, &it.reason)),
        None => row(html, name, (None, None), (Verdict::NotIdentifiable, TOO_FEW)),
    }
}

type Number = (Option<f64>, Option<[Option<f64>; 2]>);

fn row(html: &mut String, name: &str, (value, ends): Number, (verdict, why): (Verdict, &str)) {
    let shown = |value: Option<f64>| {
        let value = value.filter(|it| it.is_finite());
        value.map_or_else(|| "–".to_owned(), |it| significant(it, 2))
    };
    let [low, high] = ends.unwrap_or_default().map(shown);
    let _ = writeln!(
        html,
        "<tr><td>{}</td><td class=\"number\" data-label=\"value\">{}</td><td class=\"number\" data-label=\"95 %\">{low} … {high}</td>\
         <td class=\"verdict {}\">{}</td><td>{}</td></tr>",
        escape(name),
        shown(value),
        class(verdict),
        words(verdict),
        escape(why)
    );
}
