//! Describes terminals: variables that other tools connect at once (FMI 3.0, section 2.4.9).

/// What connected members have in common.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MemberKind {
    /// The same value.
    Signal,
    /// Flows whose sum is 0; this one is positive into the model.
    Inflow,
    /// Flows whose sum is 0; this one is positive out of the model.
    Outflow,
}

/// A variable of a terminal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Member {
    /// The name by which it finds the other one.
    pub name: &'static str,
    /// The variable, an input or output.
    pub variable: &'static str,
    /// What both have in common.
    pub kind: MemberKind,
}

impl Member {
    /// A member that has the value of the other one.
    #[must_use]
    pub const fn signal(name: &'static str, variable: &'static str) -> Self {
        Member { name, variable, kind: MemberKind::Signal }
    }

    /// A flow into the model.
    #[must_use]
    pub const fn inflow(name: &'static str, variable: &'static str) -> Self {
        Member { name, variable, kind: MemberKind::Inflow }
    }

    /// A flow out of the model.
    #[must_use]
    pub const fn outflow(name: &'static str, variable: &'static str) -> Self {
        Member { name, variable, kind: MemberKind::Outflow }
    }
}

/// Variables that other tools connect at once. Archives of FMI 3.0 have them.
///
/// ```
/// use fmu_export::{Member, Terminal};
///
/// const FLANGE: Terminal = Terminal::plug(
///     "flange",
///     "End of the shaft",
///     &[Member::signal("speed", "shaft.w"), Member::inflow("torque", "shaft.T")],
/// );
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Terminal {
    /// Its name, unique in the model.
    pub name: &'static str,
    /// One line about it.
    pub description: &'static str,
    /// Whether it can be connected to a terminal that lacks some of its members.
    pub partly: bool,
    /// Its variables.
    pub members: &'static [Member],
}

impl Terminal {
    /// A terminal of which another one may have some members: the rule `bus`.
    #[must_use]
    pub const fn bus(name: &'static str, description: &'static str, members: &'static [Member]) -> Self {
        Terminal { name, description, partly: true, members }
    }

    /// A terminal of which another one has to have all members: the rule `plug`.
    #[must_use]
    pub const fn plug(name: &'static str, description: &'static str, members: &'static [Member]) -> Self {
        Terminal { name, description, partly: false, members }
    }
}
