//! Start values: mappings, prefixes, precedence, units.

use super::*;

/// A component `c` in a system `sub`, with bindings of the root, of `sub` and of `c`.
fn nested(root: &[String], sub: &[String], own: &[String]) -> String {
    format!(
        r#"{}<ssd:Elements><ssd:System name="sub">{}<ssd:Elements>{}</ssd:Elements></ssd:System></ssd:Elements>"#,
        bindings(root),
        bindings(sub),
        component("c", &[("k", "parameter", "m")], &bindings(own)),
    )
}

fn single(name: &str, value: &str) -> String {
    binding("", &set(&[(name, &real(value))]), "")
}

#[test]
fn outer_bindings_win_and_later_ones_among_their_siblings() {
    let k = |root: &[String], sub: &[String], own: &[String]| {
        number(&good(&nested(root, sub, own)), "sub.c", "k")
    };
    let (a, b) = (single("sub.c.k", "1"), single("sub.c.k", "2"));
    let (c, d) = (single("c.k", "3"), single("c.k", "4"));
    let (e, f) = (single("k", "5"), single("k", "6"));
    let [a, b, c, d, e, f] = [&a, &b, &c, &d, &e, &f].map(String::clone);
    assert_eq!(k(&[], &[], &[e.clone(), f.clone()]), 6.0);
    let own = std::slice::from_ref(&e);
    assert_eq!(k(&[], &[c.clone(), d.clone()], own), 4.0);
    assert_eq!(k(&[], &[d.clone(), c.clone()], own), 3.0);
    assert_eq!(k(&[a.clone(), b.clone()], std::slice::from_ref(&c), own), 2.0);
    assert_eq!(k(&[b, a], &[d, c], &[f, e]), 1.0);
}

#[test]
fn prefixes_come_before_names_and_mappings() {
    let plain = binding(r#"prefix="sub.c.""#, &set(&[("k", &real("7"))]), "");
    assert_eq!(number(&good(&nested(&[plain], &[], &[])), "sub.c", "k"), 7.0);
    // A mapping sees the names with the prefix, and 3 * 7 + 0.5 = 21.5.
    let entry = format!(
        r#"<ssm:MappingEntry source="x.k" target="sub.c.k">{}</ssm:MappingEntry>"#,
        linear("3", "0.5")
    );
    let mapped = binding(r#"prefix="x.""#, &set(&[("k", &real("7"))]), &entry);
    assert_eq!(number(&good(&nested(&[mapped], &[], &[])), "sub.c", "k"), 21.5);
    // With a mapping nothing else counts, though its name fits.
    let both = set(&[("k", &real("7")), ("sub.c.k", &real("8"))]);
    let entry = r#"<ssm:MappingEntry source="k" target="sub.c.j"/>"#;
    let system = good(&nested(&[binding("", &both, entry)], &[], &[]));
    let variables: Vec<_> = system.components[0].start_values.iter().map(|x| x.variable.as_str()).collect();
    assert_eq!((variables, number(&system, "sub.c", "j")), (vec!["j"], 7.0));
}

#[test]
fn one_value_goes_to_several_names_and_unknown_names_are_noted() {
    let entries = r#"<ssm:MappingEntry source="v" target="sub.c.k"/>
        <ssm:MappingEntry source="v" target="sub.c.j"/><ssm:MappingEntry source="w" target="a"/>"#;
    let values = binding("", &set(&[("v", &real("-2"))]), entries);
    let lost = single("sub.other", "1");
    let system = good(&nested(&[values, lost], &[], &[]));
    assert_eq!((number(&system, "sub.c", "k"), number(&system, "sub.c", "j")), (-2.0, -2.0));
    let noted = |word: &str| system.notes.iter().any(|note| note.contains(word));
    assert!(noted("`w` has no value") && noted("sub.other"), "{:?}", system.notes);
}

#[test]
fn dots_in_names_reach_all_that_they_may_mean() {
    // Section 5.2.3: a system `a` with a component `b`, and a component `a.b`: both are `a.b.k`. A flat system cannot have both.
    let inner = component("b", &[], "");
    let contents = format!(
        r#"{}<ssd:Elements><ssd:System name="a"><ssd:Elements>{inner}</ssd:Elements></ssd:System>{}</ssd:Elements>"#,
        bindings(&[single("a.b.k", "9"), single("a.b.c.k", "4")]),
        component("a.b.c", &[], ""),
    );
    let system = good(&contents);
    assert_eq!(number(&system, "a.b", "k"), 9.0);
    // The variable `c.k` of `a.b`, and the variable `k` of `a.b.c`.
    assert_eq!((number(&system, "a.b", "c.k"), number(&system, "a.b.c", "k")), (4.0, 4.0));
    let twice = contents.replace("a.b.c\"", "a.b\"");
    assert!(wrong(&twice).contains("`a.b`"), "{}", wrong(&twice));
}

#[test]
fn units_of_values_are_handed_over_with_what_comes_after_the_conversion() {
    let value = r#"<ssv:Real value="2" unit="mm"/>"#;
    let entry = |rest: &str| {
        format!(r#"<ssm:MappingEntry source="k" target="k" {rest}>{}</ssm:MappingEntry>"#, linear("3", "1"))
    };
    let own = binding("", &set(&[("k", value)]), &entry(""));
    let system = good(&nested(&[], &[], &[own]));
    let found = start(&system, "sub.c", "k");
    let (unit, to) = (found.unit.clone().expect("mm"), found.connector_unit.clone().expect("m"));
    assert_eq!((unit.name.as_str(), to.name.as_str()), ("mm", "m"));
    assert_eq!((&found.value, factors(&found.transformation)), (&SspValue::Real(2.0), (3.0, 1.0)));
    // 2 mm are 0.002 m, and 3 * 0.002 + 1 = 1.006.
    let (factor, offset) = unit.conversion_to(&to).expect("lengths");
    assert_eq!(found.converted_value(factor, offset), Some(SspValue::Real(3.0 * (0.001 * 2.0) + 1.0)));
    // Suppressed: 3 * 2 + 1 = 7, in the unit of the connector.
    let own = binding("", &set(&[("k", value)]), &entry(r#"suppressUnitConversion="true""#));
    let system = good(&nested(&[], &[], &[own]));
    assert_eq!((number(&system, "sub.c", "k"), &start(&system, "sub.c", "k").unit), (7.0, &None));
}

#[test]
fn values_of_all_types_have_places() {
    let values = set(&[
        ("i", r#"<ssv:UInt64 value="18446744073709551615"/>"#),
        ("b", r#"<ssv:Boolean value="1"/>"#),
        ("s", r#"<ssv:String value="a  b"/>"#),
        ("e", r#"<ssv:Enumeration value="on"/>"#),
        ("x", r#"<ssv:Binary value="00fF"/>"#),
        ("v", r#"<ssv:Float64 value="1 2 3 4 5 6"/><ssv:Dimension size="2"/><ssv:Dimension size="3"/>"#),
        (
            "t",
            r#"<ssv:String><ssv:Value value="p"/><ssv:Value value="q r"/></ssv:String><ssv:Dimension size="2"/>"#,
        ),
    ]);
    let entries = r#"<ssm:MappingEntry source="i" target="i"><ssc:IntegerMappingTransformation>
          <ssc:MapEntry source="18446744073709551615" target="-4"/></ssc:IntegerMappingTransformation></ssm:MappingEntry>
        <ssm:MappingEntry source="b" target="b"><ssc:BooleanMappingTransformation>
          <ssc:MapEntry source="true" target="false"/></ssc:BooleanMappingTransformation></ssm:MappingEntry>
        <ssm:MappingEntry source="e" target="e"><ssc:EnumerationMappingTransformation>
          <ssc:MapEntry source="on" target="off"/></ssc:EnumerationMappingTransformation></ssm:MappingEntry>"#;
    let system = good(&nested(&[], &[], &[binding("", &values, "")]));
    let value = |name: &str| start(&system, "sub.c", name).value.clone();
    assert_eq!(value("i"), SspValue::Integer(u64::MAX.into()));
    assert_eq!((value("b"), value("s")), (SspValue::Boolean(true), SspValue::String("a  b".into())));
    assert_eq!(value("e"), SspValue::Enumeration("on".into()));
    assert_eq!(value("x"), SspValue::Binary(vec![0, 255]));
    let elements = (1..7).map(|x| SspValue::Real(x.into())).collect();
    assert_eq!(value("v"), SspValue::Array { dimensions: vec![2, 3], elements });
    let elements = ["p", "q r"].map(|x| SspValue::String(x.into())).to_vec();
    assert_eq!(value("t"), SspValue::Array { dimensions: vec![2], elements });
    let position = &start(&system, "sub.c", "i").position;
    assert!(position.file_path().ends_with("SystemStructure.ssd") && position.line() > 1);

    let system = good(&nested(&[], &[], &[binding("", &values, entries)]));
    let value = |name: &str| start(&system, "sub.c", name).value.clone();
    assert_eq!(value("i"), SspValue::Integer(-4));
    assert_eq!((value("b"), value("e")), (SspValue::Boolean(false), SspValue::Enumeration("off".into())));
}

#[test]
fn values_of_connectors_go_through_connections_and_win() {
    // x is 4 [km]; the binding of `sub` gives 3; the connection makes 2 x + 1 of it, in m: 2 * 4000 + 1.
    let contents = format!(
        r#"{}{}<ssd:Elements><ssd:System name="sub">{}{}<ssd:Elements>{}</ssd:Elements>
        <ssd:Connections>{}</ssd:Connections></ssd:System></ssd:Elements>"#,
        connectors(&[("unused", "parameter", "m")]),
        bindings(&[single("sub.x", "4")]),
        connectors(&[("x", "parameter", "km")]),
        bindings(&[single("x", "3")]),
        component("c", &[("k", "parameter", "m")], &bindings(&[single("k", "5")])),
        connection("x", "c.k", &linear("2", "1")),
    );
    let system = good(&contents);
    let found = start(&system, "sub.c", "k");
    assert_eq!(found.value, SspValue::Real(4.0));
    let unit = found.unit.as_ref().map(|unit| unit.name.as_str());
    assert_eq!((unit, factors(&found.transformation)), (Some("km"), (2.0, 1.0)));
    assert_eq!(found.converted_value(1000.0, 0.0), Some(SspValue::Real(8001.0)));
    assert!(system.notes.iter().any(|note| note.contains("`sub.c.k` is replaced")));
}

#[test]
fn nothing_is_mapped_from_an_empty_source() {
    let values = set(&[("k", &real("3"))]);
    let entries = r#"<ssm:MappingEntry source="k" target="k"/><ssm:MappingEntry source="" target="u"/>"#;
    let system = good(&nested(&[], &[], &[binding("", &values, entries)]));
    assert_eq!(number(&system, "sub.c", "k"), 3.0);
    assert!(system.notes.iter().any(|it| it.contains("`u` has no source")), "{:?}", system.notes);
}
