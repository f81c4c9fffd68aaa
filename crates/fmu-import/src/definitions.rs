//! Parses units and type definitions of a model description.
//!
//! fmi-rs 0.3.4 misspells the element of the units, and takes the first declared type only.

use std::collections::HashMap;
use std::str::FromStr;

use fmi_rs::model_description::fmi2::{Item, ModelDescription, SimpleType};
use fmi_rs::model_description::{BaseUnit, Unit};
use roxmltree::{Document, Node};

use crate::problem_list::{describe_place, enclosing_name};

/// What fmi-rs does not read of a declared type: limits and nominal value as numbers of 64 bits, and whether it is a difference.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct TypeLimits {
    /// Minimum, maximum and nominal value.
    pub range: [Option<f64>; 3],
    pub relative: bool,
}

/// What it does not read of a variable.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct VariableExtras {
    pub optional: bool,
    /// Whether it is a difference, if the variable itself says so.
    pub relative: Option<bool>,
}

/// What fmi-rs does not read: of declared types and of variables, by name.
#[derive(Debug, Default)]
pub(super) struct UnparsedAttributes {
    pub types: HashMap<String, TypeLimits>,
    pub variables: HashMap<String, VariableExtras>,
}

/// Puts the units and the declared types of the text into what was read of it.
pub(super) fn add_units_and_types(
    found: &mut ModelDescription,
    xml: &str,
) -> Result<UnparsedAttributes, String> {
    let document = Document::parse(xml).map_err(|error| error.to_string())?;
    let root = document.root_element();
    found.unitDefintions =
        list_elements(root, "UnitDefinitions", "Unit").map(parse_unit).collect::<Result<_, _>>()?;
    let types = list_elements(root, "TypeDefinitions", "SimpleType").map(simple_type);
    found.typeDefinitions = types.filter_map(Result::transpose).collect::<Result<_, _>>()?;
    let mut rest = UnparsedAttributes::default();
    for node in list_elements(root, "TypeDefinitions", "SimpleType") {
        let Some(kind) = node.children().find(Node::is_element) else { continue };
        let range =
            [parse_attribute(kind, "min")?, parse_attribute(kind, "max")?, parse_attribute(kind, "nominal")?];
        let relative = parse_relative_quantity(kind).unwrap_or_default();
        // Of two of one name the first one counts.
        rest.types.entry(parse_required_attribute(node, "name")?).or_insert(TypeLimits { range, relative });
    }
    for node in list_elements(root, "ModelVariables", "ScalarVariable") {
        let relative = node.children().find_map(parse_relative_quantity);
        let marks = VariableExtras { optional: is_optional(node), relative };
        if let Some(name) = node.attribute("name").filter(|_| marks.optional || relative.is_some()) {
            rest.variables.insert(name.to_owned(), marks);
        }
    }
    Ok(rest)
}

/// Whether an element says that its values are differences.
fn parse_relative_quantity(node: Node) -> Option<bool> {
    node.attribute("relativeQuantity").map(|word| matches!(word.trim(), "true" | "1"))
}

/// Whether a variable has the annotation that `fmu-export` gives to optional inputs.
fn is_optional(variable: Node) -> bool {
    list_elements(variable, "Annotations", "Tool").any(|tool| {
        tool.attribute("name") == Some("Trackside") && tool.children().any(|it| it.has_tag_name("Optional"))
    })
}

/// The elements called `name` in the element called `list`.
pub(super) fn list_elements<'a>(
    root: Node<'a, 'a>,
    list: &'static str,
    name: &'static str,
) -> impl Iterator<Item = Node<'a, 'a>> {
    let list = root.children().filter(move |node| node.has_tag_name(list));
    list.flat_map(move |list| list.children().filter(move |node| node.has_tag_name(name)))
}

fn parse_unit(node: Node) -> Result<Unit, String> {
    let base = node.children().find(|child| child.has_tag_name("BaseUnit"));
    let base = base.map(|base| -> Result<_, String> {
        let exponent = |name| Ok::<_, String>(parse_attribute(base, name)?.unwrap_or(0));
        Ok(BaseUnit {
            kg: exponent("kg")?,
            m: exponent("m")?,
            s: exponent("s")?,
            A: exponent("A")?,
            K: exponent("K")?,
            mol: exponent("mol")?,
            cd: exponent("cd")?,
            rad: exponent("rad")?,
            factor: parse_attribute(base, "factor")?.unwrap_or(1.0),
            offset: parse_attribute(base, "offset")?.unwrap_or(0.0),
            range: base.range(),
        })
    });
    Ok(Unit {
        name: parse_required_attribute(node, "name")?,
        baseUnit: base.transpose()?,
        displayUnits: Vec::new(),
        range: node.range(),
    })
}

/// A declared type; Boolean and String declare nothing that matters.
fn simple_type(node: Node) -> Result<Option<SimpleType>, String> {
    let (name, description, range) =
        (parse_required_attribute(node, "name")?, parse_attribute(node, "description")?, node.range());
    let Some(kind) = node.children().find(Node::is_element) else { return Ok(None) };
    Ok(match kind.tag_name().name() {
        "Real" => Some(SimpleType::Real {
            name,
            description,
            quantity: parse_attribute(kind, "quantity")?,
            unit: parse_attribute(kind, "unit")?,
            displayUnit: parse_attribute(kind, "displayUnit")?,
            relativeQuantity: false,
            min: None,
            max: None,
            nominal: None,
            unbounded: false,
            range,
        }),
        "Integer" => Some(SimpleType::Integer {
            name,
            description,
            quantity: parse_attribute(kind, "quantity")?,
            min: None,
            max: None,
            range,
        }),
        "Enumeration" => {
            let items =
                kind.children().filter(|child| child.has_tag_name("Item")).map(parse_enumeration_item);
            let items = items.collect::<Result<_, _>>()?;
            let quantity = parse_attribute(kind, "quantity")?;
            Some(SimpleType::Enumeration { name, description, items, quantity, range })
        }
        _ => None,
    })
}

fn parse_enumeration_item(node: Node) -> Result<Item, String> {
    Ok(Item {
        name: parse_required_attribute(node, "name")?,
        description: parse_attribute(node, "description")?,
        value: parse_required_attribute(node, "value")?,
        range: node.range(),
    })
}

/// The unit that a file defines by exponents of SI units, a factor and an offset.
///
/// # Errors
/// When nothing can be converted by these numbers.
pub(super) fn base_unit(exponents: [i32; 8], [factor, offset]: [f64; 2]) -> Result<units::Unit, String> {
    let mut small = [0_i8; 8];
    for (to, from) in small.iter_mut().zip(exponents) {
        *to = i8::try_from(from)
            .map_err(|_| format!("<BaseUnit>: expected exponents of -128 to 127, found {from}"))?;
    }
    units::Unit::try_from_base(small, factor, offset)
        .map_err(|error| format!("<BaseUnit>: {error}; correct it"))
}

/// Whether a name stands for a unit where the file defines none of this name: some tools write an empty one, or a dash, for none.
pub(super) fn is_unit(name: &str) -> bool {
    !matches!(name.trim(), "" | "-")
}

/// So many names that are there twice are listed in an error.
const LISTED: usize = 5;

/// Refuses names of variables that are there twice (FMI 2.0, section 2.2.7; FMI 3.0, section 2.4.7.1): nobody could say which one is
/// meant. Each name comes with its place in the text [B].
pub(super) fn check_unique_names<'a>(
    names: impl Iterator<Item = (&'a str, usize)>,
    xml: &str,
) -> Result<(), String> {
    let (mut known, mut twice) = (HashMap::new(), Vec::new());
    for (name, place) in names {
        if let Some(first) = known.insert(name, place) {
            twice.push((name, [first, place]));
        }
    }
    if twice.is_empty() {
        return Ok(());
    }
    let line = |place: usize| 1 + xml.as_bytes()[..place].iter().filter(|it| **it == b'\n').count();
    let listed = twice
        .iter()
        .take(LISTED)
        .map(|(name, [first, second])| format!("`{name}` in lines {} and {}", line(*first), line(*second)));
    let listed = listed.collect::<Vec<_>>().join(", ");
    let more = twice.len().saturating_sub(LISTED);
    let more = if more > 0 { format!(", and {more} more") } else { String::new() };
    Err(format!("expected a name of its own for each variable, found {listed}{more}"))
}

/// The variable, type or unit that an element is a part of, and its line.
pub(super) fn describe_node_place(node: Node) -> String {
    describe_place(node.document().input_text(), enclosing_name(node), node.range().start)
}

pub(super) fn parse_attribute<T: FromStr>(node: Node, name: &str) -> Result<Option<T>, String> {
    let Some(text) = node.attribute(name) else { return Ok(None) };
    text.parse().map(Some).map_err(|_| {
        let element = node.tag_name().name();
        format!(
            "{}: the attribute {name}=\"{text}\" of <{element}> is no value of its type",
            describe_node_place(node)
        )
    })
}

pub(super) fn parse_required_attribute<T: FromStr>(node: Node, name: &str) -> Result<T, String> {
    let missing =
        || format!("{}: <{}> has no attribute {name}", describe_node_place(node), node.tag_name().name());
    parse_attribute(node, name)?.ok_or_else(missing)
}
