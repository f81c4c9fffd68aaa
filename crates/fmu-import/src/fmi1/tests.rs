//! Reads descriptions of FMI 1.0: causalities, aliases, types, dependencies, and what is refused.

use crate::{
    Causality, FmiInterface, FmiVersion, FmuDescription, Initial, Variability, description,
    fmi3::StructuralSizes, parse_description,
};

const XML: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="1.0" modelName="m" modelIdentifier="m" guid="{1}"
    numberOfContinuousStates="2" numberOfEventIndicators="1">
  <UnitDefinitions><BaseUnit unit="rad"><DisplayUnitDefinition displayUnit="deg" gain="57.3"/></BaseUnit></UnitDefinitions>
  <TypeDefinitions>
    <Type name="Angle"><RealType unit="rad" min="-2" max="2"/></Type>
    <Type name="Mode"><EnumerationType><Item name="off"/><Item name="on"/></EnumerationType></Type>
  </TypeDefinitions>
  <DefaultExperiment startTime="1.0" stopTime="2.0" tolerance="1e-4"/>
  <ModelVariables>
    <ScalarVariable name="u" valueReference="0" causality="input"><Real declaredType="Angle" start="1"/></ScalarVariable>
    <ScalarVariable name="m" valueReference="1" variability="parameter" causality="input"><Real start="3"/></ScalarVariable>
    <ScalarVariable name="k" valueReference="2" variability="parameter"><Real start="4" fixed="true"/></ScalarVariable>
    <ScalarVariable name="c" valueReference="3" variability="parameter"><Real/></ScalarVariable>
    <ScalarVariable name="x" valueReference="4"><Real start="1" fixed="false"/></ScalarVariable>
    <ScalarVariable name="g" valueReference="4294967294" variability="constant"><Real start="9.81"/></ScalarVariable>
    <ScalarVariable name="y" valueReference="4" alias="alias" causality="output"><Real/>
      <DirectDependency><Name>u</Name></DirectDependency></ScalarVariable>
    <ScalarVariable name="n" valueReference="4" alias="negatedAlias" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="i" valueReference="4" alias="negatedAlias"><Integer/></ScalarVariable>
    <ScalarVariable name="mode" valueReference="7" causality="input"><Enumeration declaredType="Mode" start="2"/></ScalarVariable>
    <ScalarVariable name="s" valueReference="8" causality="none"><String start="a"/></ScalarVariable>
  </ModelVariables>
</fmiModelDescription>
"#;

fn read(xml: &str) -> Result<FmuDescription, String> {
    parse_description(xml, &StructuralSizes::new(), None).map_err(|error| format!("{error:?}"))
}

#[test]
fn variables_become_those_of_later_versions() {
    let found = read(XML).expect("a description");
    assert_eq!((found.version, found.interface), (FmiVersion::One, FmiInterface::ModelExchange));
    assert_eq!((found.equations.states.len(), found.equations.event_indicators), (2, 1));
    assert_eq!(
        (found.default_start, found.default_stop, found.default_tolerance),
        (1.0, Some(2.0), Some(1e-4))
    );
    let of = |name: &str| &found.variables[found.find_variable(name).expect("a variable")];
    for (name, causality, variability, initial) in [
        ("u", Causality::Input, Variability::Continuous, None),
        ("m", Causality::Parameter, Variability::Fixed, Some(Initial::Exact)),
        ("k", Causality::Parameter, Variability::Fixed, Some(Initial::Exact)),
        ("c", Causality::CalculatedParameter, Variability::Fixed, Some(Initial::Calculated)),
        ("x", Causality::Local, Variability::Continuous, Some(Initial::Approx)),
        ("g", Causality::Local, Variability::Constant, Some(Initial::Exact)),
        ("y", Causality::Output, Variability::Continuous, Some(Initial::Calculated)),
        ("mode", Causality::Input, Variability::Discrete, None),
        ("s", Causality::Local, Variability::Discrete, Some(Initial::Exact)),
    ] {
        let it = of(name);
        assert_eq!((it.causality, it.variability, it.initial), (causality, variability, initial), "{name}");
    }
    assert_eq!((of("u").min, of("u").unit.as_deref()), (Some(-2.0), Some("rad")));
    assert_eq!(description::describe_items(&of("mode").items), "off = 1, on = 2");
    assert_eq!(of("y").dependencies.as_deref(), Some([0].as_slice()));
    assert_eq!(of("n").dependencies, None);
}

#[test]
fn a_negated_alias_has_a_reference_that_no_other_variable_has() {
    let found = read(XML).expect("a description");
    let reference = |name: &str| found.variables[found.find_variable(name).expect("a variable")].reference;
    // The highest one is that of `g`, and the one above it stands for none.
    assert_eq!((reference("y"), reference("n"), reference("i")), (4, u32::MAX - 2, u32::MAX - 3));
    let shared = |name| found.fmi1.negated.shared_reference(reference(name));
    assert_eq!((shared("y"), shared("n"), shared("i")), (None, Some(4), Some(4)));
}

#[test]
fn the_element_for_co_simulation_tells_the_interface() {
    let implementation = "<Implementation><CoSimulation_Tool><Capabilities canInterpolateInputs=\"1\" maxOutputDerivativeOrder=\"2\"/>\
                          <Model entryPoint=\"fmu://a\" type=\"application/x-tool\"/></CoSimulation_Tool></Implementation>";
    let found =
        read(&XML.replace("</fmiModel", &format!("{implementation}</fmiModel"))).expect("a description");
    assert_eq!((found.interface, found.equations.states.len()), (FmiInterface::CoSimulation, 0));
    assert!(found.interpolated_inputs && found.output_derivatives == 2 && !found.variable_step);
    assert_eq!(found.fmi1.tool.as_deref(), Some("application/x-tool"));
}

#[test]
fn what_breaks_the_rules_is_told_with_its_line() {
    for (from, to, expected) in [
        (
            "causality=\"output\"><Real/>\n",
            "causality=\"out\"><Real/>\n",
            "`y` in line 17: causality=\\\"out\\\"",
        ),
        ("name=\"x\"", "name=\"u\"", "lines 11 and 15"),
        ("numberOfEventIndicators=\"1\"", "numberOfEventIndicators=\"9999999\"", "at most 1000000"),
        (" modelIdentifier=\"m\"", "", "no attribute modelIdentifier"),
        ("<Integer/>", "", "`i` in line 20: expected one of Real"),
    ] {
        assert!(XML.contains(from), "{from}");
        let what = read(&XML.replacen(from, to, 1)).expect_err(to);
        assert!(what.contains(expected), "{what}");
    }
    let odd =
        XML.replace("<Name>u<", "<Name>none<").replace("variability=\"constant\"", "variability=\"never\"");
    let found = read(&odd).expect("a description");
    assert_eq!(found.corrections.len(), 2, "{:?}", found.corrections);
}
