//! What tries damaged descriptions and terminals of FMI 3.0.

use damage::FuzzTarget;

use super::opened::attempt;

pub const TARGET: FuzzTarget = FuzzTarget {
    name: "descriptions_3",
    corpus: concat!(env!("CARGO_MANIFEST_DIR"), "/../fmu-import/tests/corpus/descriptions_3"),
    sound: || vec![THREE.as_bytes().to_vec(), format!("{THREE}<!-- terminals -->{TERMINALS}").into_bytes()],
    words: &[
        "valueReference",
        "causality",
        "variability",
        "initial",
        "input",
        "output",
        "structuralParameter",
        "parameter",
        "calculatedParameter",
        "dependent",
        "independent",
        "constant",
        "tunable",
        "discrete",
        "continuous",
        "<Float64 name=\"z\" valueReference=\"99\"/>",
        "<Int8",
        "<UInt64",
        "<Binary",
        "<String",
        "<Clock",
        "<Boolean",
        "<Alias name=\"other\"/>",
        "<Dimension start=\"2\"/>",
        "<Dimension valueReference=\"1\"/>",
        "<Start value=\"0\"/>",
        "clocks",
        "intervalVariability",
        "changing",
        "countdown",
        "intervalDecimal",
        "intervalCounter",
        "resolution",
        "shiftCounter",
        "declaredType",
        "unit",
        "factor",
        "offset",
        "dependencies",
        "<Terminal name=\"x\" matchingRule=\"bus\"/>",
        "plug",
        "bus",
        "sequence",
        "inflow",
        "outflow",
        "signal",
        "memberName",
        "variableName",
        "<!--",
        "-->",
        "<![CDATA[",
        "&#0;",
        "<!DOCTYPE a>",
        "../",
        "\u{1f980}",
        "true",
        "1",
    ],
    own: None,
    attempt,
};

const THREE: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="m" instantiationToken="{1}">
  <CoSimulation modelIdentifier="m" canGetAndSetFMUState="1" hasEventMode="true"/>
  <UnitDefinitions><Unit name="kph"><BaseUnit m="1" s="-1" factor="0.25"/></Unit></UnitDefinitions>
  <TypeDefinitions>
    <Float64Type name="Speed" unit="kph" min="-2"/>
    <EnumerationType name="Mode"><Item name="b" value="2"/><Item name="a" value="-1"/></EnumerationType>
  </TypeDefinitions>
  <DefaultExperiment stopTime="1"/>
  <ModelVariables>
    <Float64 name="time" valueReference="0" causality="independent"/>
    <UInt64 name="n" valueReference="1" causality="structuralParameter" variability="tunable" start="2"/>
    <Float32 name="A" valueReference="2" causality="parameter" variability="tunable" start="1 2 3 4 5 6"><Dimension valueReference="1"/><Dimension start="3"/></Float32>
    <Float64 name="v" valueReference="3" causality="input" declaredType="Speed" start="1"><Alias name="speed"/></Float64>
    <Float64 name="y" valueReference="4" causality="output"><Dimension valueReference="1"/></Float64>
    <Enumeration name="mode" valueReference="5" declaredType="Mode" causality="input" start="2"/>
    <String name="s" valueReference="6" causality="input"><Start value="a &lt; b"/></String>
    <Binary name="b" valueReference="7" causality="input"><Start value="C0ffee"/></Binary>
    <Clock name="c" valueReference="9" causality="input" intervalVariability="triggered"/>
  </ModelVariables>
  <ModelStructure><Output valueReference="4" dependencies="2 3"/><InitialUnknown valueReference="4"/></ModelStructure>
</fmiModelDescription>
"#;

const TERMINALS: &str = r#"<fmiTerminalsAndIcons fmiVersion="3.0">
<Terminals>
<Terminal name="axle.f" matchingRule="plug" terminalKind="org.example.shaft">
<TerminalMemberVariable variableName="v" memberName="speed" variableKind="signal"/>
<TerminalMemberVariable variableName="y[1]" memberName="torque" variableKind="inflow"/>
<TerminalStreamMemberVariable inStreamMemberName="h_in" outStreamMemberName="h" inStreamVariableName="v" outStreamVariableName="y[2]"/>
<Terminal name="hub" matchingRule="sequence">
<TerminalMemberVariable variableName="mode" variableKind="signal"/>
</Terminal>
</Terminal>
<Terminal name="bus" matchingRule="bus"/>
</Terminals>
</fmiTerminalsAndIcons>
"#;
