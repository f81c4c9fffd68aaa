//! Damages descriptions in many ways and asks for the mistake by its line. The verdicts of a validator of XML Schema on these kinds
//! of damage are the same.

use super::*;

const TWO: &str = r#"<?xml version="1.0"?>
<fmiModelDescription fmiVersion="2.0" modelName="m" guid="{1}">
  <CoSimulation modelIdentifier="m" canHandleVariableCommunicationStepSize="true"/>
  <UnitDefinitions><Unit name="m"><BaseUnit m="1"/></Unit></UnitDefinitions>
  <TypeDefinitions><SimpleType name="T"><Real unit="m"/></SimpleType><SimpleType name="S"><String/></SimpleType></TypeDefinitions>
  <LogCategories><Category name="all"/></LogCategories>
  <DefaultExperiment stopTime="1"/>
  <ModelVariables>
    <ScalarVariable name="u" valueReference="0" causality="input" variability="continuous" initial="exact"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="y" valueReference="1" causality="output"><Real/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="2" dependencies="1" dependenciesKind="constant"/></Outputs>
  </ModelStructure>
</fmiModelDescription>"#;

const THREE: &str = r#"<?xml version="1.0"?>
<fmiModelDescription fmiVersion="3.0" modelName="m" instantiationToken="{1}">
  <CoSimulation modelIdentifier="m" canHandleVariableCommunicationStepSize="true"/>
  <UnitDefinitions><Unit name="m"><BaseUnit m="1"/></Unit></UnitDefinitions>
  <TypeDefinitions><EnumerationType name="T"><Item name="a" value="1"/></EnumerationType></TypeDefinitions>
  <LogCategories><Category name="all"/></LogCategories>
  <DefaultExperiment stopTime="1"/>
  <ModelVariables>
    <Float64 name="u" valueReference="0" causality="input" variability="continuous" initial="exact" start="0 1"><Dimension start="2"/><Alias name="v"/></Float64>
    <Float64 name="y" valueReference="1" causality="output"/>
    <Binary name="b" valueReference="2" causality="input"><Start value="00ff"/></Binary>
    <Clock name="c" valueReference="3" causality="input" intervalVariability="triggered"/>
  </ModelVariables>
  <ModelStructure>
    <Output valueReference="1" dependencies="0" dependenciesKind="constant"/>
  </ModelStructure>
</fmiModelDescription>"#;

/// A text of the description, what it becomes, and a part of the mistake; nothing where that is allowed.
type Damage = (&'static str, &'static str, &'static str);

#[rustfmt::skip]
const BOTH: &[Damage] = &[
    ("modelName=\"m\"", "modelName=\"m\" colour=\"red\"", "line 2: <fmiModelDescription> has no attribute \"colour\""),
    ("causality=\"output\"", "causality=\"output\" colour=\"red\"", "line 10: "),
    ("<ModelVariables>", "<Extra/><ModelVariables>", "line 8: <fmiModelDescription> has no element <Extra>"),
    ("<ModelVariables>", "<ModelVariables><Extra/>", "line 8: <ModelVariables> has no element <Extra>"),
    ("<ModelStructure>", "<ModelStructure><Extra/>", "<ModelStructure> has no element <Extra>"),
    ("modelName=\"m\"", "", "line 2: <fmiModelDescription> lacks the attribute \"modelName\""),
    ("modelIdentifier=\"m\"", "", "line 3: <CoSimulation> lacks the attribute \"modelIdentifier\""),
    ("valueReference=\"1\" ", "", "line 10: "),
    (" name=\"u\"", "", "line 9: "),
    ("ModelStructure>", "modelStructure>", "line 2: <fmiModelDescription> lacks <ModelStructure>"),
    ("<DefaultExperiment stopTime=\"1\"/>", "<DefaultExperiment/><DefaultExperiment/>", "line 7: <fmiModelDescription> has more than one <DefaultExperiment>"),
    ("  <LogCategories>", "<DefaultExperiment/><LogCategories>", "comes too late in <fmiModelDescription>"),
    ("causality=\"output\"", "causality=\"outside\"", "line 10: causality of "),
    ("variability=\"continuous\"", "variability=\"often\"", "line 9: variability of "),
    ("initial=\"exact\"", "initial=\"never\"", "expected one of exact, approx, calculated, found \"never\""),
    ("valueReference=\"1\" ", "valueReference=\"-1\" ", "expected a natural number of 32 bits, found \"-1\""),
    ("valueReference=\"1\" ", "valueReference=\"4294967296\" ", "found \"4294967296\""),
    ("start=\"0", "start=\"soon", "expected a"),
    ("start=\"0", "start=\"inf", "number, found \"inf"),
    ("start=\"0", "start=\"-INF", ""),
    ("StepSize=\"true\"", "StepSize=\"True\"", "expected true or false, found \"True\""),
    ("StepSize=\"true\"", "StepSize=\" 1 \"", ""),
    ("modelName=\"m\"", "modelName=\"m\" generationDateAndTime=\"yesterday\"", "expected a date"),
    ("modelName=\"m\"", "modelName=\"m\" generationDateAndTime=\"2026-02-03T04:05:06.7+01:00\"", ""),
    ("modelName=\"m\"", "modelName=\"m\" variableNamingConvention=\"free\"", "expected one of flat, structured"),
    ("<ModelStructure>", "<ModelStructure>hello", "<ModelStructure> has a text inside: \"hello\""),
    ("<ModelStructure>", "<ModelStructure><!-- a --><?b c?>", ""),
    ("dependencies=\"", "dependencies=\"all ", "expected a list of a natural number"),
    ("dependenciesKind=\"constant\"", "dependenciesKind=\"loose\"", "found \"loose\""),
    ("<Category name=\"all\"", "<Category", "line 6: <Category> lacks the attribute \"name\""),
    ("m=\"1\"", "m=\"1.5\"", "line 4: m of <BaseUnit>: expected an integer of 32 bits"),
    ("<Category name=\"all\"/>", "<Category name=\"all\"/><Category name=\"all\"/>", "the name \"all\" is there twice, first in line 6"),
    ("name=\"y\"", "name=\"u\"", "line 10: the name \"u\" is there twice, first in line 9"),
    ("modelName=\"m\"", "modelName=\"m\" xmlns=\"x\"", "found <fmiModelDescription> of the namespace \"x\""),
    ("modelName=\"m\"", "modelName=\"m\" xmlns:i=\"http://www.w3.org/2001/XMLSchema-instance\" i:noNamespaceSchemaLocation=\"a\"", ""),
    ("<ModelVariables>", "<ModelVariables xmlns:q=\"x\" q:a=\"1\">", "line 8: <ModelVariables> has no attribute \"a\""),
    ("</ModelVariables>", "", "line "),
];

#[rustfmt::skip]
const OF_TWO: &[Damage] = &[
    ("<Real start=\"0\"/>", "<Real start=\"0\"/><Real/>", "line 9: <ScalarVariable> has more than one <Real>"),
    ("<Real start=\"0\"/>", "", "line 9: <ScalarVariable> lacks <Real> or <Integer>"),
    ("  <ModelVariables>", "<VendorAnnotations><Tool name=\"t\"><x a=\"1\">y</x></Tool></VendorAnnotations><ModelVariables>", ""),
    ("  <ModelVariables>", "<VendorAnnotations><Tool/></VendorAnnotations><ModelVariables>", "<Tool> lacks the attribute \"name\""),
    ("modelIdentifier=\"m\"", "modelIdentifier=\"m\" colour=\"red\"", "line 3: <CoSimulation> has no attribute \"colour\""),
];

#[rustfmt::skip]
const OF_THREE: &[Damage] = &[
    ("fmiVersion=\"3.0\"", "fmiVersion=\"3.0.2\"", ""),
    ("fmiVersion=\"3.0\"", "fmiVersion=\"3\"", "expected 3.0, found \"3\""),
    ("modelIdentifier=\"m\"", "modelIdentifier=\"m\" colour=\"red\"", ""),
    ("value=\"00ff\"", "value=\"00f\"", "line 11: value of <Start>: expected two hexadecimal digits"),
    (" intervalVariability=\"triggered\"", "", "line 12: <Clock> lacks the attribute \"intervalVariability\""),
    ("<Alias name=\"v\"/>", "<Alias name=\"y\"/>", "the name \"y\" is there twice"),
    ("<Alias name=\"v\"/>", "<Alias/>", "<Alias> lacks the attribute \"name\""),
    ("<Dimension start=\"2\"/><Alias name=\"v\"/>", "<Alias name=\"v\"/><Dimension start=\"2\"/>", "<Dimension> comes too late in <Float64>"),
    ("<Dimension start=\"2\"/>", "<Dimension size=\"2\"/>", "<Dimension> has no attribute \"size\""),
    ("</ModelStructure>", "</ModelStructure><Annotations><Annotation type=\"t\">x<y z=\"1\"/></Annotation></Annotations>", ""),
];

#[test]
fn each_damage_is_told_with_its_line() {
    for (xml, tables) in [(TWO, [BOTH, OF_TWO]), (THREE, [BOTH, OF_THREE])] {
        assert_eq!(schema_problems(xml), [""; 0]);
        for (from, to, says) in tables.concat() {
            assert!(xml.contains(from), "{from}");
            let found = schema_problems(&xml.replace(from, to));
            let right = match says {
                "" => found.is_empty(),
                says => found.iter().any(|mistake| mistake.contains(says)),
            };
            assert!(right, "{to}: expected {says:?}, found {found:?}");
        }
    }
}

#[test]
fn the_tables_know_the_rows_that_they_name() {
    for rows in [fmi2::ROWS, fmi3::ROWS] {
        for ElementRow(name, ..) in rows {
            let element =
                find_element_rule(rows, name).unwrap_or_else(|| panic!("{name} has a word of no meaning"));
            for (child, row) in element.places.iter().flat_map(|it| &it.choices) {
                assert!(rows.iter().any(|it| it.0 == *row), "{name}: no row {row} for {child}");
            }
            for attribute in &element.attributes {
                let refused = check_value_type("\u{7f}", attribute.kind).err().unwrap_or_default();
                assert!(!refused.contains("a type that the table has"), "{name}: {attribute:?}");
            }
        }
    }
}

#[test]
fn a_deep_description_ends_no_program() {
    let deep = "<Annotations><Tool name='t'>".to_owned() + &"<a>".repeat(500) + &"</a>".repeat(500);
    let xml = TWO.replace("<Real/>", &format!("<Real/>{deep}</Tool></Annotations>"));
    assert_eq!(schema_problems(&xml), [""; 0]);
}
