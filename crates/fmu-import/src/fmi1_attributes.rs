//! Defines what only descriptions of FMI 1.0 say: negated aliases and tools.

/// What only FMI 1.0 says of an FMU.
#[derive(Debug, Clone, Default)]
pub(crate) struct Fmi1Attributes {
    /// The variables that have the value of another one with the opposite sign, by the references that they got here.
    pub negated: NegatedAliases,
    /// The MIME type of the tool that co-simulation needs; none of an FMU that needs no tool.
    pub tool: Option<String>,
}

impl Fmi1Attributes {
    /// What to add to a refusal of an FMU that is coupled with a tool.
    pub fn tool_advice(&self) -> String {
        let advice = |tool| {
            format!("; it needs the tool of its description (CoSimulation_Tool, {tool}) on this machine")
        };
        self.tool.as_ref().map(advice).unwrap_or_default()
    }
}

/// Value references of negated aliases. In the description they share that of their variable, so they get their own ones here.
#[derive(Debug, Clone, Default)]
pub(crate) struct NegatedAliases {
    /// The references that they got, descending.
    own: Vec<u32>,
    /// The references of their variables, in the same order.
    shared: Vec<u32>,
}

impl NegatedAliases {
    /// Takes in one whose reference is below all before it.
    pub fn push(&mut self, own: u32, shared: u32) {
        self.own.push(own);
        self.shared.push(shared);
    }

    pub fn is_empty(&self) -> bool {
        self.own.is_empty()
    }

    /// The reference of the variable that a negated alias has the value of; none for another reference.
    #[inline]
    pub fn shared_reference(&self, own: u32) -> Option<u32> {
        let place = self.own.binary_search_by(|it| own.cmp(it)).ok()?;
        Some(self.shared[place])
    }
}
