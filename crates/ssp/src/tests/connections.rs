//! Connections: directions, transformations, units, signal dictionaries.

use super::*;

/// A source `a` and a target `b` in systems `p` and `q`: the connections `a.y -> p.y -> q.u -> b.u`, each with its own rest.
/// The units are those of the four connectors.
fn far(units: [&str; 4], rests: [&str; 3]) -> String {
    let [a, p, q, b] = units;
    let carry = |name: &str, outer: &str, inner: &str, link: &str| {
        format!(
            r#"<ssd:System name="{name}">{outer}<ssd:Elements>{inner}</ssd:Elements><ssd:Connections>{link}</ssd:Connections></ssd:System>"#
        )
    };
    format!(
        "<ssd:Elements>{}{}</ssd:Elements><ssd:Connections>{}</ssd:Connections>",
        carry(
            "p",
            &connectors(&[("y", "output", p)]),
            &component("a", &[("y", "output", a)], ""),
            &connection("a.y", "y", rests[0])
        ),
        carry(
            "q",
            &connectors(&[("u", "input", q)]),
            &component("b", &[("u", "input", b)], ""),
            &connection("u", "b.u", rests[2])
        ),
        connection("p.y", "q.u", rests[1]),
    )
}

/// The value that comes out of the only connection for 1 at its beginning, when the caller converts the units.
fn carried(contents: &str) -> f64 {
    let system = good(contents);
    assert_eq!(names(&system), ["p.a.y -> q.b.u"]);
    let conversion = &system.connections[0].conversion;
    let (factor, offset) = match &conversion.units {
        (Some(from), Some(to)) if !conversion.suppress_unit_conversion => {
            from.conversion_to(to).expect("units")
        }
        _ => (1.0, 0.0),
    };
    let (a, b) = factors(&conversion.transformation);
    a * (factor + offset) + b
}

#[test]
fn transformations_through_three_connections_are_one() {
    let rests = [linear("2", "1"), linear("3", "-1"), linear("0.5", "4")];
    let rests = [&rests[0], &rests[1], &rests[2]].map(String::as_str);
    // 1 -> 3 -> 8 -> 8.
    assert_eq!(carried(&far(["", "", "", ""], rests)), 8.0);
    assert!(good(&far(["", "", "", ""], rests)).connections[0].conversion.assumes_equal_units);
    assert!(!good(&far(["", "", "", ""], ["", "", rests[2]])).connections[0].conversion.assumes_equal_units);
    // 1 km = 1000 m -> 2001 m = 2001000 mm -> 6002999 mm = 6002.999 m -> 3005.4995 m.
    let value = carried(&far(["km", "m", "mm", "m"], rests));
    assert!((value - 3005.4995).abs() < 1e-9, "{value}");
    // Connectors of systems without units stand for those of the components: 1 km -> 3 km = 3000 m -> 8999 m -> 4503.5 m.
    let value = carried(&far(["km", "", "", "m"], rests));
    assert!((value - 4503.5).abs() < 1e-9, "{value}");
    // 1 degC = 274.15 K; 2 x + 1 in K = 549.3 K, in degC 276.15; 3 x - 1 there = 827.45; 0.5 x + 4 = 417.725 degC.
    let value = carried(&far(["degC", "K", "degC", "degC"], rests));
    assert!((value - 417.725).abs() < 1e-9, "{value}");
}

#[test]
fn suppressed_conversions_are_left_out() {
    let plain = ["", r#"suppressUnitConversion="true""#, ""];
    // 1 km = 1000 m, counted as 1000 mm, which are 1 m.
    assert_eq!(carried(&far(["km", "m", "mm", "m"], plain)), 1.0);
    let all = [r#"suppressUnitConversion="1""#; 3];
    assert_eq!(carried(&far(["km", "m", "mm", "s"], all)), 1.0);
    // What is left out only in part has to be known in the rest.
    let message = wrong(&far(["s", "m", "mm", "m"], plain));
    assert!(message.contains("`s` and `m`"), "{message}");
    let message = wrong(&far(["", "m", "mm", "m"], plain));
    assert!(message.contains("only the FMU knows"), "{message}");
}

#[test]
fn tables_are_composed_and_kinds_are_not_mixed() {
    let table = |kind: &str, rows: &[(&str, &str)]| {
        let rows: String =
            rows.iter().map(|(a, b)| format!(r#"<ssc:MapEntry source="{a}" target="{b}"/>"#)).collect();
        format!("<ssc:{kind}MappingTransformation>{rows}</ssc:{kind}MappingTransformation>")
    };
    let typed = |kind: &str, rests: [&str; 3]| {
        far(["", "", "", ""], rests).replace(r#"ssc:Real unit="""#, &format!("ssc:{kind}"))
    };
    let (first, second) =
        (table("Integer", &[("1", "2"), ("5", "6")]), table("Integer", &[("2", "3"), ("7", "8")]));
    let system = good(&typed("Int64", [&first, "", &second]));
    // 1 -> 2 -> 3, 5 -> 6, 2 -> 3, 7 -> 8, and 9 stays.
    let conversion = &system.connections[0].conversion.transformation;
    for (from, to) in [(1, 3), (5, 6), (2, 3), (7, 8), (9, 9)] {
        assert_eq!(conversion.apply(&SspValue::Integer(from)), Some(SspValue::Integer(to)));
    }
    let not = table("Boolean", &[("true", "false"), ("false", "true")]);
    let system = good(&typed("Boolean", [&not, &not, &not]));
    let conversion = &system.connections[0].conversion.transformation;
    assert_eq!(conversion.apply(&SspValue::Boolean(true)), Some(SspValue::Boolean(false)));

    let enumeration = table("Enumeration", &[("a", "b")]);
    let message = wrong(&typed(r#"Enumeration name="e""#, [&enumeration, &first, ""]));
    assert!(message.contains("whole numbers") && message.contains("enumerations"), "{message}");
    let message = wrong(&typed("Boolean", [&linear("2", "0"), "", ""]));
    assert!(message.contains("floating point"), "{message}");
}

#[test]
fn kinds_decide_the_direction() {
    let parts = [component("a", &[("y", "output", "")], ""), component("b", &[("u", "input", "")], "")];
    let contents = |link: &str| {
        format!("<ssd:Elements>{}</ssd:Elements><ssd:Connections>{link}</ssd:Connections>", parts.concat())
    };
    assert_eq!(names(&good(&contents(&connection("b.u", "a.y", "")))), ["a.y -> b.u"]);
    for (from, to) in [("a.y", "a.y"), ("b.u", "b.u")] {
        assert!(wrong(&contents(&connection(from, to, ""))).contains("gives values"));
    }
    let twice = connection("a.y", "b.u", "").repeat(2);
    assert!(wrong(&contents(&twice)).contains("already"));
}

#[test]
fn connectors_of_the_system_lead_to_components() {
    let contents = format!(
        "{}<ssd:Elements>{}{}</ssd:Elements><ssd:Connections>{}{}{}</ssd:Connections>",
        connectors(&[
            ("u", "input", "km"),
            ("p", "parameter", ""),
            ("y", "output", "m"),
            ("z", "output", "")
        ]),
        component("a", &[("u", "input", "m"), ("p", "parameter", ""), ("y", "output", "mm")], ""),
        component("b", &[("u", "input", "m")], ""),
        connection("u", "a.u", &linear("2", "0")) + &connection("u", "b.u", ""),
        connection("a.p", "p", ""),
        connection("a.y", "y", ""),
    );
    let system = good(&contents);
    let inputs: Vec<_> = system.inputs.iter().map(|x| (x.connector.name.as_str(), x.to.len())).collect();
    assert_eq!(inputs, [("u", 2), ("p", 1)]);
    let (port, conversion) = &system.inputs[0].to[0];
    assert_eq!((port.variable.as_str(), factors(&conversion.transformation)), ("u", (2.0, 0.0)));
    let units = [&conversion.units.0, &conversion.units.1].map(|x| x.as_ref().map(|x| x.name.clone()));
    assert_eq!(units, [Some("km".to_owned()), Some("m".to_owned())]);
    assert_eq!(system.outputs[0].from.as_ref().map(|x| x.0.variable.as_str()), Some("y"));
    assert!(system.outputs[1].from.is_none() && system.connections.is_empty());
    assert_eq!((system.experiment.start, system.experiment.stop), (Some(1.0), Some(2.5)));
}

#[test]
fn parameters_are_connected_with_parameters() {
    let contents = |kind: &str| {
        format!(
            "<ssd:Elements>{}{}</ssd:Elements><ssd:Connections>{}</ssd:Connections>",
            component("a", &[("y", kind, "")], ""),
            component("b", &[("k", "parameter", "")], ""),
            connection("a.y", "b.k", ""),
        )
    };
    assert_eq!(names(&good(&contents("calculatedParameter"))), ["a.y -> b.k"]);
    assert!(wrong(&contents("output")).contains("parameters only"));
}

#[test]
fn dictionaries_connect_elements_of_all_levels() {
    let reference = |name: &str, kind: &str| {
        format!(
            r#"<ssd:SignalDictionaryReference name="{name}" dictionary="bus">{}</ssd:SignalDictionaryReference>"#,
            connectors(&[("v", kind, "")])
        )
    };
    let contents = format!(
        r#"<ssd:Elements>{}{}<ssd:System name="sub"><ssd:Elements>{}{}</ssd:Elements>
        <ssd:Connections>{}</ssd:Connections></ssd:System></ssd:Elements><ssd:Connections>{}</ssd:Connections>
        <ssd:SignalDictionaries><ssd:SignalDictionary name="bus" source="bus.ssb"/></ssd:SignalDictionaries>"#,
        component("a", &[("y", "output", "m")], ""),
        reference("here", "inout"),
        reference("there", "inout"),
        component("b", &[("u", "input", "m")], ""),
        connection("there.v", "b.u", &linear("3", "0")),
        connection("a.y", "here.v", &linear("2", "1")),
    );
    let bus = format!(
        r#"<ssb:SignalDictionary version="1.0" {SPACES}><ssb:DictionaryEntry name="v"><ssc:Real unit="m"/></ssb:DictionaryEntry>{}</ssb:SignalDictionary>"#,
        UNITS.replace("ssd:", "ssb:")
    );
    let opened = |contents: &str| {
        let folder = folder(&[("SystemStructure.ssd", &description(contents)), ("bus.ssb", &bus)]);
        open_system(folder.path(), None)
    };
    let system = opened(&contents).expect("a system");
    assert_eq!(names(&system), ["a.y -> sub.b.u"]);
    assert_eq!(factors(&system.connections[0].conversion.transformation), (6.0, 3.0));
    let message =
        |from: &str, to: &str| opened(&contents.replace(from, to)).expect_err("an error").to_string();
    assert!(message(r#"dictionary="bus""#, r#"dictionary="bis""#).contains("`bis`"));
    assert!(message(r#""v" kind="inout""#, r#""w" kind="inout""#).contains("entry"));
}
