//! Writes `report.html`: a run on one page that needs nothing but a browser, to be handed on.

mod checks;
mod coupling;
mod messages;

use std::fmt::Write as _;

use diagnostics::Source;
use html_page::escape;

use super::analysis_summary::AnalysisSummary;
use super::text::seconds;
use super::{RunReport, RunVerdict, ValidationReport};

impl RunReport {
    /// The page; `source` are the files of the scenario.
    #[must_use]
    pub(super) fn page(&self, source: &Source) -> String {
        let mut html = String::new();
        self.write_verdict(&mut html);
        checks::write(&mut html, &self.checks);
        messages::write(&mut html, &self.messages);
        self.write_baselines(&mut html);
        self.write_validations(&mut html);
        self.write_analyses(&mut html);
        self.write_run(&mut html);
        for file in source.files() {
            let name = escape(&file.path.display().to_string());
            let _ = writeln!(
                html,
                "<details><summary>{name}</summary><pre>{}</pre></details>",
                lines(&file.text)
            );
        }
        html_page::page(&self.title, include_str!("page/style.css"), &html)
    }

    fn write_verdict(&self, html: &mut String) {
        // The error follows.
        let headline = match self.verdict {
            RunVerdict::Error | RunVerdict::Interrupted => {
                format!("stopped after {}", seconds(self.sim_seconds))
            }
            RunVerdict::Pass | RunVerdict::Fail => self.headline(),
        };
        let _ = writeln!(
            html,
            "<p class=\"banner {}\"><b>{}</b> {}</p>",
            class(self.verdict),
            word(self.verdict),
            escape(&headline)
        );
        if let Some(error) = &self.error {
            let _ = writeln!(html, "<pre class=\"error\">{}</pre>", lines(error));
        }
        if let Some(resumed) = &self.resumed {
            let _ = writeln!(html, "<p class=\"faint\">It {}</p>", escape(&resumed.line()));
        }
        for warning in &self.warnings {
            let _ = writeln!(html, "<p class=\"warning\"><b>Warning</b> {}</p>", escape(warning));
        }
    }

    /// The pictures of baselines that the run left, inside the page.
    fn write_baselines(&self, html: &mut String) {
        for baseline in &self.baselines {
            let Some(picture) = &baseline.picture else { continue };
            let Ok(svg) = std::fs::read_to_string(self.folder.join(picture)) else { continue };
            let name = escape(&baseline.name);
            let _ = writeln!(
                html,
                "<h3>Baseline {name}</h3>\n<p><img alt=\"run and tube of {name}\" src=\"data:image/svg+xml,{}\"/></p>",
                encoded(&svg)
            );
        }
    }

    fn write_validations(&self, html: &mut String) {
        for ValidationReport { name, scenario, verdict, error, checks, messages, .. } in
            &self.validations
        {
            let _ = writeln!(
                html,
                "<h2>Validation <a href=\"{}/report.html\">{}</a></h2>\n<p class=\"faint\">{}</p>\n\
                 <p class=\"banner {}\"><b>{}</b> {}</p>",
                link(name),
                escape(name),
                escape(&scenario.display().to_string()),
                class(*verdict),
                word(*verdict),
                escape(error.as_deref().unwrap_or_default())
            );
            checks::write_table(html, checks);
            messages::write(html, messages);
        }
    }

    fn write_analyses(&self, html: &mut String) {
        if self.analyses.is_empty() {
            return;
        }
        html.push_str("<h2>Analyses</h2>\n<ul>\n");
        for file in &self.files {
            let _ = writeln!(html, "<li><a href=\"{}\">{}</a></li>", link(file), escape(file));
        }
        html.push_str("</ul>\n");
        for (name, result) in &self.analyses {
            html.push_str(&AnalysisSummary::of(result).html(name));
            let text = serde_json::to_string_pretty(result).unwrap_or_default();
            let _ = writeln!(
                html,
                "<details><summary>Result of {}</summary><pre>{}</pre></details>",
                escape(name),
                lines(&text)
            );
        }
    }

    fn write_run(&self, html: &mut String) {
        let made = &self.provenance;
        let versions = &made.versions;
        html.push_str("<h2>Run</h2>\n<table class=\"facts\">\n");
        let mut row = |name: &str, value: &str| {
            if !value.is_empty() {
                let _ =
                    writeln!(html, "<tr><th>{}</th><td>{}</td></tr>", escape(name), escape(value));
            }
        };
        row("Scenario", &self.scenario);
        row("Simulated", &format!("{} in {} steps", seconds(self.sim_seconds), self.steps));
        let wall = seconds(self.wall_seconds);
        row("Took", &format!("{wall}, {:.0} times real time", self.realtime_factor));
        row("Command", &made.command.join(" "));
        row("Set from outside", &made.set.join(", "));
        row("Seed", &format!("{} ({})", made.seed, made.generator));
        let fmi = match versions.fmi.as_str() {
            "" => String::new(),
            fmi => format!(", FMI {fmi}"),
        };
        row(
            "Versions",
            &format!(
                "trackside {}{fmi}, plugins {}, {} on {}",
                versions.trackside, versions.plugin_interface, versions.os, versions.arch
            ),
        );
        if let Some(late) = self.late_points {
            row("Late", &format!("{late} of {} communication points", self.steps));
        }
        html.push_str("</table>\n");
        self.write_nodes(html);
        coupling::write(html, &self.coupling);
        self.write_hashes(html);
    }

    /// How long the nodes took.
    fn write_nodes(&self, html: &mut String) {
        let nodes = self.nodes.iter().filter(|node| node.calls > 0);
        let longest = nodes.clone().any(|node| node.deadline_misses.is_some());
        if nodes.clone().next().is_none() {
            return;
        }
        let misses = if longest { "<th>Too long</th>" } else { "" };
        let _ = writeln!(
            html,
            "<table class=\"hashes\">\n<tr><th>Node</th><th>Steps</th><th>Time</th><th>Mean of a step</th>\
             <th>99 of 100 below</th><th>Longest</th>{misses}</tr>"
        );
        for node in nodes {
            let name = escape(&node.name);
            let [all, mean, most, longest] =
                [node.seconds, node.mean_seconds, node.p99_seconds, node.max_seconds].map(short);
            let misses = node.deadline_misses.map(|misses| format!("<td>{misses}</td>"));
            let _ = writeln!(
                html,
                "<tr><td>{name}</td><td>{}</td><td>{all}</td><td>{mean}</td><td>{most}</td><td>{longest}</td>{}</tr>",
                node.calls,
                misses.unwrap_or_default()
            );
        }
        html.push_str("</table>\n");
    }

    /// The hashes of all that was read.
    fn write_hashes(&self, html: &mut String) {
        let made = &self.provenance;
        html.push_str(
            "<table class=\"hashes\">\n<tr><th>Made of</th><th></th><th>SHA-256</th></tr>\n",
        );
        let mut row = |what: &str, name: &str, sha256: &str| {
            let (what, name, sha256) = (escape(what), escape(name), escape(sha256));
            let _ = writeln!(
                html,
                "<tr><td>{what}</td><td>{name}</td><td><code>{sha256}</code></td></tr>"
            );
        };
        for fmu in &made.fmus {
            row("FMU", &format!("{} {}", fmu.name, fmu.guid), &fmu.sha256);
        }
        let files = [("plugin", &made.plugins), ("scenario", &made.sources), ("data", &made.data)];
        for (what, file) in
            files.iter().flat_map(|(what, files)| files.iter().map(move |it| (what, it)))
        {
            row(what, &file.path.display().to_string(), &file.sha256);
        }
        html.push_str("</table>\n");
    }
}

/// A time [s] with three digits and the unit that fits it.
fn short(time: f64) -> String {
    let units = [(1.0, "s"), (1e-3, "ms"), (1e-6, "us"), (1e-9, "ns")];
    let (size, unit) = units.into_iter().find(|(size, _)| time >= *size).unwrap_or(units[3]);
    let value = time / size;
    let digits = if value >= 100.0 { 0 } else { usize::from(value < 10.0) + 1 };
    format!("{value:.digits$} {unit}")
}

fn word(ending: RunVerdict) -> &'static str {
    match ending {
        RunVerdict::Pass => "PASSED",
        RunVerdict::Fail => "FAILED",
        RunVerdict::Error => "ERROR",
        RunVerdict::Interrupted => "INTERRUPTED",
    }
}

fn class(ending: RunVerdict) -> &'static str {
    match ending {
        RunVerdict::Pass => "pass",
        RunVerdict::Fail => "fail",
        RunVerdict::Error | RunVerdict::Interrupted => "stop",
    }
}

/// Lines of text, for an element that keeps them.
fn lines(text: &str) -> String {
    text.lines().map(escape).collect::<Vec<_>>().join("\n")
}

/// A link to a file beside the page.
fn link(name: &str) -> String {
    // Not a scheme, such as `javascript:`.
    format!("./{}", encoded(name))
}

/// Text as a part of a URL.
fn encoded(text: &str) -> String {
    let safe = |byte: u8| byte.is_ascii_alphanumeric() || b"-._~".contains(&byte);
    let mut encoded = String::with_capacity(text.len());
    for byte in text.bytes() {
        match safe(byte) {
            true => encoded.push(byte.into()),
            false => _ = write!(encoded, "%{byte:02X}"),
        }
    }
    encoded
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_stay_beside_the_page() {
        assert_eq!(link("tires.html"), "./tires.html");
        assert_eq!(link("a b\"<\u{e9}>:?"), "./a%20b%22%3C%C3%A9%3E%3A%3F");
    }

    #[test]
    fn lines_of_text_stay_lines_and_text() {
        assert_eq!(lines("a = 1\n\tb < 2\n"), "a = 1\n b &lt; 2");
    }
}
