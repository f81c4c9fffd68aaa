//! Writes `terminalsAndIcons.xml` of FMI 3.0.

use std::fmt::{self, Write};

use super::XmlEscaped;
use crate::terminal::{MemberKind, Terminal};

pub(super) fn write_terminals(out: &mut dyn Write, terminals: &[Terminal]) -> fmt::Result {
    writeln!(out, r#"<?xml version="1.0" encoding="UTF-8"?>"#)?;
    writeln!(out, r#"<fmiTerminalsAndIcons fmiVersion="3.0">"#)?;
    writeln!(out, "  <Terminals>")?;
    for Terminal { name, description, partly, members } in terminals {
        writeln!(
            out,
            r#"    <Terminal name="{}" matchingRule="{}" description="{}">"#,
            XmlEscaped(name),
            if *partly { "bus" } else { "plug" },
            XmlEscaped(description),
        )?;
        for member in *members {
            let kind = match member.kind {
                MemberKind::Signal => "signal",
                MemberKind::Inflow => "inflow",
                MemberKind::Outflow => "outflow",
            };
            writeln!(
                out,
                r#"      <TerminalMemberVariable variableName="{}" memberName="{}" variableKind="{kind}"/>"#,
                XmlEscaped(member.variable),
                XmlEscaped(member.name),
            )?;
        }
        writeln!(out, "    </Terminal>")?;
    }
    writeln!(out, "  </Terminals>")?;
    writeln!(out, "</fmiTerminalsAndIcons>")
}
