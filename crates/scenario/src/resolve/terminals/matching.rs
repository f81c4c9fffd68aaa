//! Matches the members of two terminals by the rules plug, bus and sequence.

use fmu_import::{MatchingRule, MemberKind, Terminal};

/// Two variables of terminals that belong together.
pub(super) struct MemberPair<'a> {
    /// The names that messages tell.
    pub name: &'a str,
    pub variables: [&'a str; 2],
    /// Whether one is the negative of the other: the sum of both flows is 0.
    pub inverted: bool,
    /// Whether one of both may be left without a value.
    pub optional: bool,
}

/// Adds the pairs of two terminals of these names, and of the terminals inside them.
///
/// # Errors
/// When a rule of one of them is not kept, or not known.
pub(super) fn add_member_pairs<'a>(
    terminals: [&'a Terminal; 2],
    names: &[String; 2],
    found: &mut Vec<MemberPair<'a>>,
) -> Result<(), String> {
    let [a, b] = terminals;
    for (terminal, name) in terminals.into_iter().zip(names) {
        if let MatchingRule::Other(rule) = &terminal.rule {
            return Err(format!(
                "`{name}` matches by the rule `{rule}`, and only `plug`, `bus` and `sequence` are known"
            ));
        }
    }
    let by_order = [a, b].map(|terminal| terminal.rule == MatchingRule::Sequence);
    if by_order[0] != by_order[1] {
        let [a, b] = [a, b].map(|terminal| &terminal.rule);
        return Err(format!(
            "`{}` matches by the rule `{a}` and `{}` by `{b}`: one by order and the other by name",
            names[0], names[1]
        ));
    }
    let own = |terminal: &'a Terminal| -> Vec<_> {
        let all = terminal.members.iter().enumerate();
        all.map(|(index, it)| (member_key(by_order[0], index, it.name.as_deref()), it)).collect()
    };
    let optional = [a, b].iter().any(|terminal| terminal.rule == MatchingRule::Bus);
    for (one, other) in match_by_key([a, b], names, [own(a), own(b)], "member")? {
        let inverted = are_inverted([&one.kind, &other.kind])
            .map_err(|what| format!("`{}` and `{}` {what}", one.variable, other.variable))?;
        let name = one.name.as_deref().unwrap_or(&one.variable);
        found.push(MemberPair { name, variables: [&one.variable, &other.variable], inverted, optional });
    }
    let own = |terminal: &'a Terminal| -> Vec<_> {
        let all = terminal.streams.iter().enumerate();
        all.map(|(index, it)| (member_key(by_order[0], index, Some(&it.names[1])), it)).collect()
    };
    for (one, other) in match_by_key([a, b], names, [own(a), own(b)], "stream")? {
        for side in [0, 1] {
            let variables = [one.variables[side].as_str(), &other.variables[1 - side]];
            found.push(MemberPair { name: &one.names[side], variables, inverted: false, optional });
        }
    }
    let own = |terminal: &'a Terminal| -> Vec<_> {
        let all = terminal.terminals.iter().enumerate();
        all.map(|(index, it)| (member_key(by_order[0], index, Some(&it.name)), it)).collect()
    };
    for (one, other) in match_by_key([a, b], names, [own(a), own(b)], "terminal")? {
        let names = [format!("{}.{}", names[0], one.name), format!("{}.{}", names[1], other.name)];
        add_member_pairs([one, other], &names, found)?;
    }
    Ok(())
}

/// What a member is found by: its index, or its name.
fn member_key(by_order: bool, index: usize, name: Option<&str>) -> String {
    if by_order { (index + 1).to_string() } else { name.unwrap_or_default().to_owned() }
}

/// Those of both terminals with the same key. A terminal that is no bus needs a partner for each.
fn match_by_key<'a, T>(
    terminals: [&Terminal; 2],
    names: &[String; 2],
    lists: [Vec<(String, &'a T)>; 2],
    what: &str,
) -> Result<Vec<(&'a T, &'a T)>, String> {
    for (one, other) in [(0, 1), (1, 0)] {
        let has = |key: &str| lists[other].iter().any(|(it, _)| it == key);
        let absent: Vec<_> = lists[one].iter().filter(|(key, _)| !has(key)).collect();
        let rule = &terminals[one].rule;
        if let (Some((key, _)), false) = (absent.first(), *rule == MatchingRule::Bus) {
            return Err(format!(
                "`{}` has no {what} `{key}`, which the rule `{rule}` of `{}` asks for",
                names[other], names[one]
            ));
        }
    }
    let [a, b] = lists;
    let partner = |key: &str| b.iter().find(|(it, _)| it == key).map(|(_, it)| *it);
    Ok(a.iter().filter_map(|(key, one)| Some((*one, partner(key)?))).collect())
}

/// Whether the values of members of these kinds are each other's negative.
fn are_inverted(kinds: [&MemberKind; 2]) -> Result<bool, String> {
    use MemberKind::{Inflow, Other, Outflow, Signal};
    match kinds {
        [Signal, Signal] | [Inflow, Outflow] | [Outflow, Inflow] => Ok(false),
        [Inflow, Inflow] | [Outflow, Outflow] => Ok(true),
        [Other(a), Other(b)] if a == b => {
            Err(format!("are of the kind `{a}`, and only `signal`, `inflow` and `outflow` are known"))
        }
        [a, b] => Err(format!("are of different kinds: `{a}` and `{b}`")),
    }
}
