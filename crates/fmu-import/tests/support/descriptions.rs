//! What tries damaged descriptions of FMI 2.0.

use damage::FuzzTarget;

use super::opened::attempt;

pub const TARGET: FuzzTarget = FuzzTarget {
    name: "descriptions",
    corpus: concat!(env!("CARGO_MANIFEST_DIR"), "/../fmu-import/tests/corpus/descriptions"),
    sound: || vec![TWO.as_bytes().to_vec()],
    words: &[
        "fmiVersion",
        "valueReference",
        "causality",
        "variability",
        "initial",
        "input",
        "output",
        "parameter",
        "local",
        "independent",
        "calculatedParameter",
        "constant",
        "fixed",
        "tunable",
        "discrete",
        "continuous",
        "exact",
        "approx",
        "calculated",
        "<Real/>",
        "<Integer/>",
        "<Boolean/>",
        "<String/>",
        "declaredType",
        "unit",
        "derivative",
        "reinit",
        "dependencies",
        "dependenciesKind",
        "factor",
        "offset",
        "kg",
        "rad",
        "start",
        "min",
        "max",
        "nominal",
        "<Unknown index=\"1\"/>",
        "<Category name=\"a\"/>",
        "<!--",
        "-->",
        "<![CDATA[",
        "]]>",
        "&#0;",
        "&lt;",
        "<?x?>",
        "<!DOCTYPE a>",
        "../",
        "\u{1f980}",
        " ",
        "true",
        "false",
    ],
    own: None,
    attempt,
};

const TWO: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="m" guid="{1}" variableNamingConvention="structured">
  <CoSimulation modelIdentifier="m" canGetAndSetFMUstate="true" maxOutputDerivativeOrder="1"/>
  <UnitDefinitions><Unit name="m/s"><BaseUnit m="1" s="-1" factor="2.5"/><DisplayUnit name="kn"/></Unit></UnitDefinitions>
  <TypeDefinitions>
    <SimpleType name="Speed"><Real unit="m/s" min="-2" max="1e3"/></SimpleType>
    <SimpleType name="Mode"><Enumeration><Item name="a" value="-1"/><Item name="b" value="2"/></Enumeration></SimpleType>
  </TypeDefinitions>
  <LogCategories><Category name="logAll"/></LogCategories>
  <DefaultExperiment startTime="0" stopTime="1" stepSize="0.1" tolerance="1e-4"/>
  <ModelVariables>
    <ScalarVariable name="a.u" valueReference="0" causality="input"><Real declaredType="Speed" start="1"/></ScalarVariable>
    <ScalarVariable name="a.y[1]" valueReference="1" causality="output"><Real unit="m/s"/></ScalarVariable>
    <ScalarVariable name="n" valueReference="2" causality="parameter" variability="fixed"><Integer start="3" max="7"/></ScalarVariable>
    <ScalarVariable name="mode" valueReference="3" causality="output" variability="discrete"><Enumeration declaredType="Mode"/></ScalarVariable>
    <ScalarVariable name="der(x)" valueReference="4"><Real derivative="2"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="2" dependencies="1 3" dependenciesKind="constant fixed"/><Unknown index="4"/></Outputs>
    <InitialUnknowns><Unknown index="2"/><Unknown index="4"/></InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"#;
