//! Parses the model description of FMI 3.0, and expands arrays to their elements.

mod attributes;
mod clocks;
mod structure;

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use fmi_rs::model_description::fmi3::ModelDescription;
use roxmltree::{Document, Node};
use units::Unit;

use crate::attributes::Causality;
use crate::definitions::{self, list_elements, parse_attribute, parse_required_attribute};
use crate::description::{
    EnumerationItem, EquationStructure, FmiInterface, FmiType, FmiVersion, FmuDescription, StorageType,
    Variable, VariableNameIndex,
};
use crate::fmi1_attributes::Fmi1Attributes;
use crate::validation::{self, StructureVariable, locate_validation_error};

/// A description may have this many elements of arrays in all, which take 0.5 GB.
const MOST: usize = 1 << 20;
/// All elements together may have this many bytes of texts: an array may have a million elements and a long description.
const MOST_TEXT: usize = 1 << 28;

/// Names of the elements of variables.
const TYPES: [(&str, FmiType, StorageType); 15] = [
    ("Float64", FmiType::Real, StorageType::Float64),
    ("Float32", FmiType::Real, StorageType::Float32),
    ("Int8", FmiType::Integer, StorageType::Int8),
    ("UInt8", FmiType::Integer, StorageType::UInt8),
    ("Int16", FmiType::Integer, StorageType::Int16),
    ("UInt16", FmiType::Integer, StorageType::UInt16),
    ("Int32", FmiType::Integer, StorageType::Int32),
    ("UInt32", FmiType::Integer, StorageType::UInt32),
    ("Int64", FmiType::Integer, StorageType::Int64),
    ("UInt64", FmiType::Integer, StorageType::UInt64),
    ("Boolean", FmiType::Boolean, StorageType::Boolean),
    ("String", FmiType::String, StorageType::String),
    ("Binary", FmiType::Binary, StorageType::Binary),
    ("Enumeration", FmiType::Enumeration, StorageType::Int64),
    ("Clock", FmiType::Clock, StorageType::Clock),
];

/// Sizes that structural parameters have in place of their start values, by reference.
pub(crate) type StructuralSizes = BTreeMap<u32, u64>;

/// Reads the text of a `modelDescription.xml`.
///
/// # Errors
/// When the text is no description of an FMU of FMI 3.0 with this interface.
pub(crate) fn parse(
    xml: &str,
    sizes: &StructuralSizes,
    interface: FmiInterface,
) -> Result<FmuDescription, String> {
    let document = Document::parse(xml).map_err(|error| error.to_string())?;
    let root = document.root_element();
    let element = |name: &str| root.children().find(|node| node.has_tag_name(name));
    let is_co_simulation = interface == FmiInterface::CoSimulation;
    let own = element(&interface.to_string()).ok_or_else(|| format!("expected <{interface}>, found none"))?;
    let identifier: String = parse_required_attribute(own, "modelIdentifier")?;
    if identifier.contains(['/', '\\']) || identifier.is_empty() {
        return Err(format!("modelIdentifier {identifier:?} is not a name"));
    }
    let problems = description_problems(&document);
    let flag = |name: &str| Ok::<_, String>(parse_bool_attribute(own, name)?.unwrap_or(false));
    let experiment = element("DefaultExperiment");
    let default = |name: &str| -> Option<f64> {
        experiment?.attribute(name)?.trim().parse().ok().filter(|it: &f64| it.is_finite())
    };
    Ok(FmuDescription {
        version: FmiVersion::Three,
        interface,
        interfaces: Vec::new(),
        equations: match interface {
            FmiInterface::CoSimulation => EquationStructure::default(),
            FmiInterface::ModelExchange => structure::equation_structure(
                root,
                &parse_declared_variables(root, sizes)?,
                flag("needsCompletedIntegratorStep")?,
            )?,
        },
        name: parse_required_attribute(root, "modelName")?,
        guid: parse_required_attribute(root, "instantiationToken")?,
        identifier,
        summary: parse_attribute(root, "description")?,
        tool: parse_attribute(root, "generationTool")?,
        variable_step: !is_co_simulation || flag("canHandleVariableCommunicationStepSize")?,
        state: flag("canGetAndSetFMUState")?,
        serialised_state: flag("canSerializeFMUState")?,
        directional_derivative: flag("providesDirectionalDerivatives")?,
        // FMI 3.0 has no derivatives of inputs without intermediate update.
        interpolated_inputs: !is_co_simulation,
        output_derivatives: parse_attribute(own, "maxOutputDerivativeOrder")?.unwrap_or(0),
        event_mode: !is_co_simulation || flag("hasEventMode")?,
        early_return: flag("mightReturnEarlyFromDoStep")? || flag("canReturnEarlyAfterIntermediateUpdate")?,
        only_once: flag("canBeInstantiatedOnlyOncePerProcess")?,
        default_step: default("stepSize"),
        internal_step: parse_attribute(own, "fixedInternalStepSize")?,
        default_start: default("startTime").unwrap_or(0.0),
        default_stop: default("stopTime"),
        default_tolerance: default("tolerance"),
        log_categories: list_elements(root, "LogCategories", "Category")
            .map(|category| parse_required_attribute(category, "name"))
            .collect::<Result<_, _>>()?,
        variables: parse_variables(root, sizes)?,
        corrections: Vec::new(),
        problems,
        names: VariableNameIndex::default(),
        fmi1: Fmi1Attributes::default(),
    })
}

/// What breaks the rules, by variable and line.
fn description_problems(document: &Document) -> Vec<String> {
    let xml = document.input_text();
    let refused = |xml: &str| ModelDescription::from_string(xml).err().map(|it| it.to_string());
    let found = match ModelDescription::from_string(xml) {
        Ok(found) => found,
        Err(error) => return vec![locate_validation_error(document, &error.to_string(), refused)],
    };
    let variables = found.modelVariables.iter().map(|it| StructureVariable {
        id: it.valueReference,
        name: &it.name,
        place: it.range.start,
        clocked: !it.clocks.is_empty(),
    });
    let variables: Vec<_> = variables.collect();
    let states = found.derivatives.iter().chain(&found.clockedStates);
    let unknowns = found.outputs.iter().chain(states).chain(&found.initialUnknowns);
    let unknowns = unknowns.chain(&found.eventIndicators);
    let unknowns = unknowns.map(|it| (it.range.start, it.valueReference));
    validation::validation_problems(xml, || found.validate(), &variables, unknowns)
}

/// A variable of the file, which may be an array.
struct DeclaredVariable<'a> {
    node: Node<'a, 'a>,
    kind: FmiType,
    storage: StorageType,
    reference: u32,
    dimensions: Vec<usize>,
    /// Place of its first element among the variables.
    first: usize,
}

impl DeclaredVariable<'_> {
    fn element_count(&self) -> usize {
        self.dimensions.iter().product()
    }

    /// `[2]` or `[1,2]`, counted from 1; nothing for a variable of its own.
    fn element_subscript(&self, element: usize) -> String {
        let mut rest = element;
        let mut places: Vec<String> = Vec::new();
        for size in self.dimensions.iter().rev() {
            places.insert(0, (rest % size + 1).to_string());
            rest /= size;
        }
        if places.is_empty() { String::new() } else { format!("[{}]", places.join(",")) }
    }
}

/// The variables of the file, with the sizes of arrays.
fn parse_declared_variables<'a>(
    root: Node<'a, 'a>,
    sizes: &StructuralSizes,
) -> Result<Vec<DeclaredVariable<'a>>, String> {
    let list = root.children().filter(|node| node.has_tag_name("ModelVariables"));
    let nodes = || list.clone().flat_map(|list| list.children().filter(Node::is_element));
    let sizes = structure::structural_sizes(nodes(), sizes)?;
    let (mut all, mut first, mut count) = (Vec::new(), 0_usize, 0_usize);
    for node in nodes() {
        let name = node.tag_name().name();
        let Some((_, kind, storage)) = TYPES.iter().find(|known| known.0 == name) else {
            return Err(format!(
                "{}: expected a variable of a type of FMI 3.0, found <{name}>",
                definitions::describe_node_place(node)
            ));
        };
        let dimensions = structure::parse_dimensions(node, &sizes)?;
        let reference = parse_required_attribute(node, "valueReference")?;
        let elements = dimensions.iter().try_fold(1_usize, |n, size| n.checked_mul(*size));
        let names = 1 + alias_nodes(node).count();
        let all_names = elements.and_then(|elements| elements.checked_mul(names));
        let fits = |count: &usize| *count <= MOST;
        count = all_names.and_then(|n| count.checked_add(n)).filter(fits).ok_or_else(|| {
            format!(
                "expected at most {MOST} elements of arrays, found more: look at the sizes of structural parameters"
            )
        })?;
        all.push(DeclaredVariable { node, kind: *kind, storage: *storage, reference, dimensions, first });
        first += elements.unwrap_or_default();
    }
    Ok(all)
}

fn alias_nodes<'a>(node: Node<'a, 'a>) -> impl Iterator<Item = Node<'a, 'a>> {
    node.children().filter(|child| child.has_tag_name("Alias"))
}

fn parse_variables<'a>(root: Node<'a, 'a>, sizes: &StructuralSizes) -> Result<Vec<Variable>, String> {
    let all = parse_declared_variables(root, sizes)?;
    let places = |it: &DeclaredVariable| (it.reference, it.first..it.first + it.element_count());
    let follows = structure::parse_output_dependencies(root, &all.iter().map(places).collect())?;
    let types = declared_types(root)?;
    let units = parse_units(root)?;
    let (mut variables, mut places, mut length) = (Vec::new(), Vec::new(), 0_usize);
    for one in &all {
        let follows = follows.get(&one.reference).cloned().flatten();
        let elements = expand_array_elements(one, &types, &units, follows, &mut length)?;
        places.extend(elements.iter().map(|_| one.node.range().start));
        variables.extend(elements);
    }
    for one in &all {
        for alias in alias_nodes(one.node) {
            let name: String = parse_required_attribute(alias, "name")?;
            for element in 0..one.element_count() {
                let mut variable = variables[one.first + element].clone();
                variable.name = format!("{name}{}", one.element_subscript(element));
                // The variable itself is connected; by its other name it can be looked at.
                variable.causality = Causality::Local;
                places.push(alias.range().start);
                variables.push(variable);
            }
        }
    }
    let names = variables.iter().map(|it| it.name.as_str());
    definitions::check_unique_names(names.zip(places), root.document().input_text())?;
    Ok(variables)
}

type TypeNodes<'a> = HashMap<String, Node<'a, 'a>>;
type UnitTable = HashMap<String, Option<Unit>>;

fn declared_types<'a>(root: Node<'a, 'a>) -> Result<TypeNodes<'a>, String> {
    let list = root.children().filter(|node| node.has_tag_name("TypeDefinitions"));
    let types = list.flat_map(|list| list.children().filter(Node::is_element));
    types.map(|node| Ok((parse_required_attribute(node, "name")?, node))).collect()
}

fn parse_units(root: Node) -> Result<UnitTable, String> {
    list_elements(root, "UnitDefinitions", "Unit").map(parse_unit).collect()
}

fn parse_unit(node: Node) -> Result<(String, Option<Unit>), String> {
    let name: String = parse_required_attribute(node, "name")?;
    let base = node.children().find(|child| child.has_tag_name("BaseUnit"));
    let base = base.map(|base| -> Result<Unit, String> {
        let mut exponents = [0_i32; 8];
        for (exponent, name) in exponents.iter_mut().zip(["kg", "m", "s", "A", "K", "mol", "cd", "rad"]) {
            *exponent = parse_attribute(base, name)?.unwrap_or(0);
        }
        let factor = parse_attribute(base, "factor")?.unwrap_or(1.0);
        let offset = parse_attribute(base, "offset")?.unwrap_or(0.0);
        let unit = definitions::base_unit(exponents, [factor, offset]);
        unit.map_err(|what| format!("the unit {}: {what}", definitions::describe_node_place(base)))
    });
    let base = base.transpose()?;
    Ok((name, base))
}

fn is_unit(name: &str, units: &UnitTable) -> bool {
    matches!(units.get(name), Some(Some(_))) || definitions::is_unit(name)
}

/// The elements of a variable, row by row.
fn expand_array_elements(
    one: &DeclaredVariable,
    types: &TypeNodes,
    units: &UnitTable,
    follows: Option<Arc<[usize]>>,
    length: &mut usize,
) -> Result<Vec<Variable>, String> {
    let DeclaredVariable { node, kind, storage, reference, .. } = *one;
    let declared = node.attribute("declaredType").and_then(|name| types.get(name)).copied();
    let of =
        |name: &str| node.attribute(name).or_else(|| declared.and_then(|declared| declared.attribute(name)));
    let number = |name: &str| -> Option<f64> { of(name)?.trim().parse().ok() };
    let unit = of("unit").filter(|name| is_unit(name, units)).map(str::to_owned);
    let measure = unit.as_deref().and_then(|name| find_unit(name, units));
    let is_relative = |word: &str| kind == FmiType::Real && matches!(word.trim(), "true" | "1");
    let relative = of("relativeQuantity").is_some_and(is_relative);
    let causality = attributes::parse_causality(node)?;
    let variability = attributes::parse_variability(node, kind, causality)?;
    let starts = parse_start_values(node, storage);
    let count = one.element_count();
    let name: String = parse_required_attribute(node, "name")?;
    let variable = Variable {
        name: String::new(),
        reference,
        kind,
        storage,
        element: (0, count),
        items: declared.map_or(Ok(Vec::new()), parse_enumeration_items)?,
        causality,
        variability,
        initial: attributes::parse_initial(node, kind, causality, variability)?,
        min: number("min"),
        max: number("max"),
        nominal: number("nominal"),
        unit,
        dimension: measure.map(|it| if relative { it.difference_unit() } else { it }),
        relative: relative.then(|| measure.map_or(0.0, |it| it.offset)),
        start: None,
        description: parse_attribute(node, "description")?,
        dependencies: follows,
        optional: list_elements(node, "Annotations", "Annotation")
            .any(|it| it.attribute("type") == Some("trackside.optional")),
        ticks: (kind == FmiType::Clock).then(|| clocks::parse_clock_attributes(node, &of)).transpose()?,
        clocks: clocks::parse_variable_clocks(node)?,
    };
    let texts = [Some(&name), variable.unit.as_ref(), variable.description.as_ref()];
    let items = variable.items.iter().map(|item| item.name.len() + size_of::<EnumerationItem>());
    let text = texts.into_iter().flatten().map(String::len).sum::<usize>() + items.sum::<usize>();
    let names = 1 + alias_nodes(node).count();
    *length = length.saturating_add(text.saturating_mul(count).saturating_mul(names));
    if count > 1 && *length > MOST_TEXT {
        return Err(format!(
            "expected at most {MOST_TEXT} bytes of names, units and descriptions of elements, found more at `{name}`"
        ));
    }
    let element = |index: usize| Variable {
        name: format!("{name}{}", one.element_subscript(index)),
        element: (index, count),
        // One value is that of all elements; a list of another length belongs to another size.
        start: match starts.len() {
            1 => starts.first().cloned(),
            given if given == count => starts.get(index).cloned(),
            _ => None,
        },
        ..variable.clone()
    };
    Ok((0..count).map(element).collect())
}

/// The unit of a name: by the description's own definition, or else by what the name says.
fn find_unit(name: &str, units: &UnitTable) -> Option<Unit> {
    units.get(name).copied().flatten().or_else(|| Unit::parse(name).ok())
}

fn parse_start_values(node: Node, storage: StorageType) -> Vec<String> {
    if let StorageType::String | StorageType::Binary = storage {
        let starts = node.children().filter(|child| child.has_tag_name("Start"));
        return starts.filter_map(|start| start.attribute("value")).map(str::to_owned).collect();
    }
    node.attribute("start").unwrap_or_default().split_whitespace().map(str::to_owned).collect()
}

fn parse_enumeration_items(declared: Node) -> Result<Vec<EnumerationItem>, String> {
    let items = declared.children().filter(|child| child.has_tag_name("Item"));
    let items = items.map(|item| {
        Ok(EnumerationItem {
            name: parse_required_attribute(item, "name")?,
            value: parse_required_attribute(item, "value")?,
        })
    });
    let mut items = items.collect::<Result<Vec<_>, String>>()?;
    items.sort_by_key(|item| item.value);
    Ok(items)
}

fn parse_bool_attribute(node: Node, name: &str) -> Result<Option<bool>, String> {
    match node.attribute(name).map(str::trim) {
        None => Ok(None),
        Some("true" | "1") => Ok(Some(true)),
        Some("false" | "0") => Ok(Some(false)),
        Some(_) => parse_attribute(node, name),
    }
}
