//! Systems in files of their own, archives, variants.

use super::*;

/// A system with a component `c` that takes the parameter `k` from its connector `p`.
fn inner(binding: &str) -> String {
    description(&format!(
        "{}{}<ssd:Elements>{}</ssd:Elements><ssd:Connections>{}{}</ssd:Connections>",
        connectors(&[("p", "parameter", ""), ("y", "output", "")]),
        binding,
        component("c", &[("k", "parameter", ""), ("y", "output", "")], ""),
        connection("p", "c.k", ""),
        connection("c.y", "y", ""),
    ))
}

fn values(name: &str, value: &str) -> String {
    bindings(&[binding("", &set(&[(name, &real(value))]), "")])
}

fn part(name: &str, source: &str, rest: &str) -> String {
    format!(
        r#"<ssd:Component name="{name}" type="application/x-ssp-definition" source="{source}">{rest}</ssd:Component>"#
    )
}

#[test]
fn systems_in_other_files_are_part_of_the_system() {
    let outer = description(&format!(
        "<ssd:Elements>{}{}{}{}</ssd:Elements><ssd:Connections>{}</ssd:Connections>",
        part("one", "parts/inner.ssd", &values("p", "2")),
        part("two", "parts/inner.ssd", ""),
        part("three", "parts/inner.ssp#other.ssd", ""),
        component("d", &[("u", "input", "")], ""),
        connection("two.y", "d.u", ""),
    ));
    let text = inner(&values("p", "1"));
    let text = text.replace("a.fmu", "../a.fmu");
    let folder = folder(&[("SystemStructure.ssd", &outer), ("parts/inner.ssd", &text)]);
    let other = inner(&values("p", "7")).replace("a.fmu", "resources/x%20y.fmu");
    let files: [(&str, &[u8]); 3] = [
        ("SystemStructure.ssd", b"nothing of use"),
        ("other.ssd", other.as_bytes()),
        ("resources/x y.fmu", b""),
    ];
    written(folder.path(), "parts/inner.ssp", &archive(&files));
    let system = open_system(folder.path(), None).expect("a system");
    // The bindings of the component come behind those of the file.
    assert_eq!((number(&system, "one.c", "k"), number(&system, "two.c", "k")), (2.0, 1.0));
    assert_eq!((number(&system, "three.c", "k"), names(&system)), (7.0, vec!["two.c.y -> d.u".to_owned()]));
    assert!(system.components.iter().all(|component| component.source.is_file()));
    assert_eq!(system.unpacked_folders().count(), 1);
}

#[test]
fn systems_of_the_same_file_can_be_used_twice() {
    let contents = format!(
        r##"<ssd:Elements><ssd:System name="first" id="it"><ssd:Elements>{}</ssd:Elements></ssd:System>{}</ssd:Elements>"##,
        component("c", &[], &values("k", "3")),
        part("second", "#it", &values("c.k", "4")),
    );
    let system = good(&contents);
    assert_eq!((number(&system, "first.c", "k"), number(&system, "second.c", "k")), (3.0, 4.0));
    let message = wrong(&contents.replace("#it", "#that"));
    assert!(message.contains("#that"), "{message}");
}

#[test]
fn three_levels_have_names_with_dots() {
    let level = |name: &str, inner: &str, rest: &str| {
        format!(r#"<ssd:System name="{name}">{rest}<ssd:Elements>{inner}</ssd:Elements></ssd:System>"#)
    };
    let c = component("c", &[], "");
    let contents = level("x", &level("y", &level("z", &c, &values("c.k", "1")), ""), &values("y.z.c.j", "2"));
    let system = good(&format!("{}<ssd:Elements>{contents}</ssd:Elements>", values("x.y.z.c.i", "3")));
    let found = ["k", "j", "i"].map(|name| number(&system, "x.y.z.c", name));
    assert_eq!(found, [1.0, 2.0, 3.0]);
}

#[test]
fn circles_of_files_end() {
    let outer = description(&format!("<ssd:Elements>{}</ssd:Elements>", part("a", "b.ssd", "")));
    let other = outer.replace("b.ssd", "SystemStructure.ssd");
    let folder = folder(&[("SystemStructure.ssd", &outer), ("b.ssd", &other)]);
    let message = open_system(folder.path(), None).expect_err("a circle").to_string();
    assert!(message.contains("in itself") && message.contains("b.ssd:7:"), "{message}");
}

#[test]
fn variants_are_chosen_by_file_or_name() {
    let text = |name: &str, k: &str| {
        let text =
            description(&format!("<ssd:Elements>{}</ssd:Elements>", component("c", &[], &values("k", k))));
        text.replace(r#"name="test""#, &format!("name=\"{name}\""))
    };
    let (first, second) = (text("plain", "1"), text("fast one", "2"));
    let files: [(&str, &[u8]); 3] =
        [("SystemStructure.ssd", first.as_bytes()), ("B.ssd", second.as_bytes()), ("a.fmu", b"")];
    let folder = TempDir::new().expect("a folder");
    let path = written(folder.path(), "system.ssp", &archive(&files));
    let k = |variant| number(&open_system(&path, variant).expect("a system"), "c", "k");
    assert_eq!(k(None), 1.0);
    assert_eq!([k(Some("B")), k(Some("B.ssd")), k(Some("fast one"))], [2.0; 3]);
    let message = open_system(&path, Some("C")).expect_err("an error").to_string();
    assert!(message.contains("B.ssd (fast one)"), "{message}");
    let names: Vec<_> = crate::list_variants(&path).expect("variants").into_iter().map(|x| x.name).collect();
    assert_eq!(names, ["plain", "fast one"]);
}

#[test]
fn a_description_opens_without_its_folder_being_named() {
    let contents = format!("<ssd:Elements>{}</ssd:Elements>", component("c", &[], ""));
    let folder = folder(&[("other.ssd", &description(&contents))]);
    let system = open_system(&folder.path().join("other.ssd"), None).expect("a system");
    assert_eq!(system.components[0].source, folder.path().join("a.fmu"));
}

#[test]
fn bindings_come_from_inside_of_an_fmu() {
    let values = set(&[("k", &real("6"))]);
    let bytes = archive(&[("resources/v.ssv", values.as_bytes())]);
    let source = r#"<ssd:ParameterBinding source="resources/v.ssv" sourceBase="component"/>"#;
    let contents = format!(
        r#"<ssd:Elements><ssd:Component name="c" source="b.fmu"><ssd:ParameterBindings>{source}</ssd:ParameterBindings></ssd:Component></ssd:Elements>"#
    );
    let folder = folder(&[("SystemStructure.ssd", &description(&contents))]);
    written(folder.path(), "b.fmu", &bytes);
    let system = open_system(folder.path(), None).expect("a system");
    assert_eq!(number(&system, "c", "k"), 6.0);
    assert!(start(&system, "c", "k").position.file_path().ends_with("b.fmu/resources/v.ssv"));
}
