//! Reads the terminals of an FMU: groups of variables that are connected at once (FMI 3.0, section 2.4.9).

use std::collections::BTreeSet;

use roxmltree::{Document, Node};

/// The file of the terminals inside an archive.
pub(crate) const FILE: &str = "terminalsAndIcons/terminalsAndIcons.xml";
/// Terminals inside terminals, inside terminals...
const DEEPEST: usize = 64;

/// How the members of a terminal find those of another one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum MatchingRule {
    /// By name, all of them.
    Plug,
    /// By name, those that both have.
    Bus,
    /// By order, all of them.
    Sequence,
    /// By a rule of another standard, of this name.
    Other(String),
}

impl std::fmt::Display for MatchingRule {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.write_str(match self {
            MatchingRule::Plug => "plug",
            MatchingRule::Bus => "bus",
            MatchingRule::Sequence => "sequence",
            MatchingRule::Other(name) => name,
        })
    }
}

/// What connected members have in common.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum MemberKind {
    /// The same value.
    Signal,
    /// Flows whose sum is 0; this one is positive into the FMU.
    Inflow,
    /// Flows whose sum is 0; this one is positive out of the FMU.
    Outflow,
    /// Something of another standard, of this name.
    Other(String),
}

impl std::fmt::Display for MemberKind {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.write_str(match self {
            MemberKind::Signal => "signal",
            MemberKind::Inflow => "inflow",
            MemberKind::Outflow => "outflow",
            MemberKind::Other(name) => name,
        })
    }
}

/// A variable of a terminal.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct TerminalMember {
    /// Its name in the terminal; a sequence needs none.
    pub name: Option<String>,
    /// The variable.
    pub variable: String,
    /// What it has in common with the other one.
    pub kind: MemberKind,
}

/// What a flow carries with it: one variable for each direction. What leaves one FMU enters the other one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TerminalStream {
    /// The names of both in the terminal, first that of what enters.
    pub names: [String; 2],
    /// The variables, first that of what enters.
    pub variables: [String; 2],
}

/// A group of variables that are connected at once.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Terminal {
    /// Its name, unique among its siblings.
    pub name: String,
    /// How its members find those of another one.
    pub rule: MatchingRule,
    /// What it stands for, by another standard.
    pub kind: Option<String>,
    /// One line about it.
    pub description: Option<String>,
    /// Its variables.
    pub members: Vec<TerminalMember>,
    /// What flows carry with them.
    pub streams: Vec<TerminalStream>,
    /// Terminals inside it.
    pub terminals: Vec<Terminal>,
}

impl Terminal {
    /// The terminal at a path of names with `.` between them.
    #[must_use]
    pub fn find_by_path<'a>(terminals: &'a [Terminal], path: &str) -> Option<&'a Terminal> {
        terminals.iter().find_map(|terminal| match path.strip_prefix(&terminal.name)? {
            "" => Some(terminal),
            rest => Terminal::find_by_path(&terminal.terminals, rest.strip_prefix('.')?),
        })
    }

    /// All its variables, with those of terminals inside it.
    pub fn variable_names(&self) -> Vec<&str> {
        let members = self.members.iter().map(|member| &member.variable);
        let streams = self.streams.iter().flat_map(|stream| &stream.variables);
        let own = members.chain(streams).map(String::as_str);
        own.chain(self.terminals.iter().flat_map(Terminal::variable_names)).collect()
    }

    /// The paths of the terminals, outer ones first.
    #[must_use]
    pub fn terminal_paths(terminals: &[Terminal]) -> Vec<String> {
        let mut paths = Vec::new();
        for terminal in terminals {
            paths.push(terminal.name.clone());
            let inner = Terminal::terminal_paths(&terminal.terminals);
            paths.extend(inner.into_iter().map(|path| format!("{}.{path}", terminal.name)));
        }
        paths
    }
}

/// The terminals in the text of the file, with what is wrong with them: such a terminal is left out.
///
/// # Errors
/// When the text is no such file.
pub(crate) fn parse_terminals(xml: &str) -> Result<(Vec<Terminal>, Vec<String>), String> {
    if let Some(place) = archive::find_element_over_limit(xml) {
        let (line, most) = (1 + xml[..place].matches('\n').count(), archive::ATTRIBUTES);
        return Err(format!("line {line}: expected at most {most} attributes of an element, found more"));
    }
    let document = Document::parse(xml).map_err(|error| error.to_string())?;
    let root = document.root_element();
    if !root.has_tag_name("fmiTerminalsAndIcons") {
        let name = root.tag_name().name();
        return Err(format!("expected the element `fmiTerminalsAndIcons`, found `{name}`"));
    }
    let mut problems = Vec::new();
    let lists = root.children().filter(|node| node.has_tag_name("Terminals"));
    let terminals = lists.flat_map(|list| parse_child_terminals(list, 1, &mut problems)).collect();
    Ok((terminals, problems))
}

fn parse_child_terminals(parent: Node, depth: usize, problems: &mut Vec<String>) -> Vec<Terminal> {
    let mut names = BTreeSet::new();
    let mut terminals = Vec::new();
    for node in parent.children().filter(|node| node.has_tag_name("Terminal")) {
        match parse_terminal(node, depth, problems) {
            Ok(terminal) if names.insert(terminal.name.clone()) => terminals.push(terminal),
            Ok(terminal) => {
                let twice = format!("there are two terminals `{}` side by side", terminal.name);
                problems.push(describe_at_node(node, &twice));
            }
            Err(problem) => problems.push(problem),
        }
    }
    terminals
}

fn parse_terminal(node: Node, depth: usize, problems: &mut Vec<String>) -> Result<Terminal, String> {
    if depth > DEEPEST {
        return Err(describe_at_node(node, &format!("more than {DEEPEST} terminals are inside each other")));
    }
    let rule = match required_attribute(node, "matchingRule")?.as_str() {
        "plug" => MatchingRule::Plug,
        "bus" => MatchingRule::Bus,
        "sequence" => MatchingRule::Sequence,
        other => MatchingRule::Other(other.to_owned()),
    };
    let mut members = Vec::new();
    for child in node.children().filter(|child| child.has_tag_name("TerminalMemberVariable")) {
        members.push(parse_member(child)?);
    }
    let mut streams = Vec::new();
    for child in node.children().filter(|child| child.has_tag_name("TerminalStreamMemberVariable")) {
        let side = |side: &str| -> Result<(String, String), String> {
            let name = required_attribute(child, &format!("{side}MemberName"))?;
            Ok((name, required_attribute(child, &format!("{side}VariableName"))?))
        };
        let (entering, leaving) = (side("inStream")?, side("outStream")?);
        let (names, variables) = ([entering.0, leaving.0], [entering.1, leaving.1]);
        streams.push(TerminalStream { names, variables });
    }
    let needs_names = matches!(rule, MatchingRule::Plug | MatchingRule::Bus);
    let mut names = BTreeSet::new();
    for member in &members {
        match &member.name {
            None if needs_names => {
                let what = format!("`{}` has no memberName, which {rule} needs", member.variable);
                return Err(describe_at_node(node, &what));
            }
            Some(name) if needs_names && !names.insert(name) => {
                return Err(describe_at_node(node, &format!("two members are called `{name}`")));
            }
            _ => {}
        }
    }
    Ok(Terminal {
        name: required_attribute(node, "name")?,
        rule,
        kind: node.attribute("terminalKind").map(normalize_string),
        description: node.attribute("description").map(normalize_string),
        members,
        streams,
        terminals: parse_child_terminals(node, depth + 1, problems),
    })
}

fn parse_member(node: Node) -> Result<TerminalMember, String> {
    let kind = match required_attribute(node, "variableKind")?.as_str() {
        "signal" => MemberKind::Signal,
        "inflow" => MemberKind::Inflow,
        "outflow" => MemberKind::Outflow,
        other => MemberKind::Other(other.to_owned()),
    };
    let name = node.attribute("memberName").map(normalize_string);
    Ok(TerminalMember { name, variable: required_attribute(node, "variableName")?, kind })
}

fn required_attribute(node: Node, name: &str) -> Result<String, String> {
    let found = node.attribute(name).map(normalize_string).filter(|value| !value.is_empty());
    found.ok_or_else(|| describe_at_node(node, &format!("`{}` has no `{name}`", node.tag_name().name())))
}

/// A normalised string: a line end or a tabulator in it is a blank.
fn normalize_string(text: &str) -> String {
    text.replace(['\n', '\r', '\t'], " ")
}

fn describe_at_node(node: Node, what: &str) -> String {
    let line = node.document().text_pos_at(node.range().start).row;
    format!("line {line}: {what}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(terminals: &str) -> String {
        format!(
            "<fmiTerminalsAndIcons fmiVersion=\"3.0\"><Terminals>\n{terminals}\n</Terminals></fmiTerminalsAndIcons>"
        )
    }

    #[test]
    fn terminals_are_found_by_their_path() {
        let text = file(
            "<Terminal name=\"axle.f\" matchingRule=\"plug\"><TerminalMemberVariable variableName=\"T\" memberName=\"torque\" variableKind=\"inflow\"/><Terminal name=\"hub\" matchingRule=\"sequence\"><TerminalMemberVariable variableName=\"w\" variableKind=\"signal\"/></Terminal></Terminal>",
        );
        let (terminals, problems) = parse_terminals(&text).expect("it is there");
        assert_eq!(problems, [""; 0]);
        assert_eq!(Terminal::terminal_paths(&terminals), ["axle.f", "axle.f.hub"]);
        let hub = Terminal::find_by_path(&terminals, "axle.f.hub").expect("it is there");
        assert_eq!((hub.rule.clone(), hub.variable_names()), (MatchingRule::Sequence, vec!["w"]));
        assert_eq!(
            Terminal::find_by_path(&terminals, "axle.f").expect("it is there").variable_names(),
            ["T", "w"]
        );
        for absent in ["axle", "axle.f.", "axle.f.hub.x", "axle.fhub", ""] {
            assert_eq!(Terminal::find_by_path(&terminals, absent), None, "{absent}");
        }
    }

    #[test]
    fn a_stream_has_two_variables() {
        let text = file(
            "<Terminal name=\"port\" matchingRule=\"bus\"><TerminalStreamMemberVariable inStreamMemberName=\"h_in\" outStreamMemberName=\"h\" inStreamVariableName=\"a\" outStreamVariableName=\"b\"/></Terminal>",
        );
        let (terminals, _) = parse_terminals(&text).expect("it is there");
        assert_eq!(terminals[0].streams[0].names, ["h_in", "h"]);
        assert_eq!(terminals[0].variable_names(), ["a", "b"]);
    }

    #[test]
    fn what_is_wrong_is_left_out_with_its_line() {
        let good = "<Terminal name=\"good\" matchingRule=\"bus\"/>";
        let cases = [
            ("<Terminal matchingRule=\"bus\"/>", "line 2: `Terminal` has no `name`"),
            ("<Terminal name=\"x\"/>", "line 2: `Terminal` has no `matchingRule`"),
            (
                "<Terminal name=\"x\" matchingRule=\"plug\"><TerminalMemberVariable variableName=\"u\" variableKind=\"signal\"/></Terminal>",
                "`u` has no memberName, which plug needs",
            ),
            (
                "<Terminal name=\"x\" matchingRule=\"bus\"><TerminalMemberVariable variableName=\"u\" memberName=\"m\" variableKind=\"signal\"/><TerminalMemberVariable variableName=\"y\" memberName=\"m\" variableKind=\"signal\"/></Terminal>",
                "two members are called `m`",
            ),
            (
                "<Terminal name=\"good\" matchingRule=\"plug\"/><Terminal name=\"good\" matchingRule=\"bus\"/>",
                "two terminals `good` side by side",
            ),
        ];
        for (wrong, expected) in cases {
            let (terminals, problems) =
                parse_terminals(&file(&format!("{wrong}{good}"))).expect("it is there");
            assert_eq!(Terminal::terminal_paths(&terminals), ["good"], "{wrong}");
            assert!(problems[0].contains(expected), "{problems:?}");
        }
        let deep = "<Terminal name=\"x\" matchingRule=\"bus\">".repeat(100);
        let (_, problems) =
            parse_terminals(&file(&format!("{deep}{}", "</Terminal>".repeat(100)))).expect("it is there");
        assert!(problems[0].contains("inside each other"), "{problems:?}");
        assert!(
            parse_terminals("<fmiModelDescription/>")
                .expect_err("a refusal")
                .contains("fmiTerminalsAndIcons")
        );
    }
}
