//! Resolves message definitions (ROS msg or IDL) into a tree of types.

mod idl;
mod msg;
mod standard_messages;
mod tokens;

use std::collections::{HashMap, HashSet};

pub(crate) use self::msg::EMPTY;

/// Structures in structures are followed down to this depth.
const DEEPEST: usize = 32;

/// The language of a definition, as MCAP and rosbag2 name it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DefinitionLanguage {
    /// `ros2msg`: lines of `type name`.
    Msg,
    /// `ros2idl`: the interface definition language of OMG, as ROS 2 uses it.
    Idl,
    /// `ros1msg`: as `ros2msg`, with time and duration as types of their own.
    Msg1,
}

impl DefinitionLanguage {
    /// The language of this name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "ros2msg" => Some(DefinitionLanguage::Msg),
            "ros2idl" | "omgidl" => Some(DefinitionLanguage::Idl),
            "ros1msg" => Some(DefinitionLanguage::Msg1),
            _ => None,
        }
    }
}

/// A number that has a fixed size in a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScalarType {
    /// 0 or 1 in one byte.
    Bool,
    /// An integer of so many bytes, with a sign or without.
    Integer {
        /// 1, 2, 4 or 8.
        bytes: usize,
        /// Whether it has a sign.
        signed: bool,
    },
    /// A number of 32 bits.
    Single,
    /// A number of 64 bits.
    Double,
    /// A number of 128 bits, which nobody reads.
    Quadruple,
}

impl ScalarType {
    /// [B]
    #[must_use]
    pub fn size_in_bytes(self) -> usize {
        match self {
            ScalarType::Bool => 1,
            ScalarType::Integer { bytes, .. } => bytes,
            ScalarType::Single => 4,
            ScalarType::Double => 8,
            ScalarType::Quadruple => 16,
        }
    }
}

/// What a field of a message is.
#[derive(Clone, Debug, PartialEq)]
pub enum FieldType {
    /// A number.
    Scalar(ScalarType),
    /// A text in UTF-8.
    Text,
    /// A text of which each letter has 32 bits.
    WideText,
    /// The structure at this index.
    Struct(usize),
    /// So many of a type.
    Array(Box<FieldType>, usize),
    /// Any number of a type.
    Sequence(Box<FieldType>),
}

/// A field of a structure.
#[derive(Clone, Debug, PartialEq)]
pub struct StructField {
    /// Its name.
    pub name: String,
    /// What it is.
    pub kind: FieldType,
}

/// A structure: a message, or what messages consist of.
#[derive(Clone, Debug, PartialEq)]
pub struct StructDefinition {
    /// Its name, such as `sensor_msgs/Imu`.
    pub name: String,
    /// Its fields, in the order of the message.
    pub fields: Vec<StructField>,
    /// The fewest bytes that it takes in a message; 0 where it takes none at all.
    pub least_bytes: usize,
}

/// What the messages of a topic consist of.
#[derive(Clone, Debug)]
pub struct MessageDefinition {
    /// All structures; those inside others come first, the message last.
    pub structs: Vec<StructDefinition>,
    /// Whether the bag has no definition, so that one that is known here serves: it may be of another release.
    pub assumed: bool,
}

/// A declaration as it was read; names are resolved afterwards.
#[derive(Clone, Debug)]
pub(crate) enum TypeDeclaration {
    Struct(Vec<(String, TypeExpression)>),
    Alias(TypeExpression),
}

/// A type as it was written.
#[derive(Clone, Debug)]
pub(crate) enum TypeExpression {
    Plain(FieldType),
    /// The first of these names that is declared.
    Named(Vec<String>),
    Array(Box<TypeExpression>, usize),
    Sequence(Box<TypeExpression>),
}

/// All declarations of a text, by their names.
pub(crate) type TypeDeclarations = HashMap<String, TypeDeclaration>;

impl MessageDefinition {
    /// Reads the definition of a message: that of `name`, behind it those of the structures in it, each behind a line of `=` and `MSG:`
    /// or `IDL:` with its name.
    ///
    /// # Errors
    /// With what cannot be read, or is defined nowhere.
    pub fn parse(name: &str, language: DefinitionLanguage, text: &str) -> Result<Self, String> {
        let root = normalized_type_name(name);
        let mut declared = TypeDeclarations::new();
        for (section, form, text) in split_sections(&root, language, text) {
            let read = match form {
                DefinitionLanguage::Idl => idl::parse_idl_declarations(text, &mut declared),
                DefinitionLanguage::Msg | DefinitionLanguage::Msg1 => {
                    msg::parse_msg_definition(&section, form, text, &mut declared)
                }
            };
            read.map_err(|what| format!("the definition of `{section}`: {what}"))?;
        }
        Self::resolve_declarations(&root, language == DefinitionLanguage::Msg1, declared, false)
    }

    /// The definition of a usual message of ROS 2, for bags that hold none.
    ///
    /// # Errors
    /// When it is not known here.
    pub fn standard_message(name: &str) -> Result<Self, String> {
        Self::resolve_declarations(&normalized_type_name(name), false, TypeDeclarations::new(), true)
    }

    fn resolve_declarations(
        root: &str,
        old: bool,
        declared: TypeDeclarations,
        assumed: bool,
    ) -> Result<Self, String> {
        let mut linked = TypeResolver { declared, old, structs: Vec::new(), done: HashMap::new() };
        linked.resolve_struct(root, 0)?;
        Ok(MessageDefinition { structs: linked.structs, assumed })
    }

    /// The index of the message itself.
    #[must_use]
    pub fn root_struct_index(&self) -> usize {
        self.structs.len() - 1
    }

    /// The fewest bytes that a type takes in a message.
    #[must_use]
    pub fn min_encoded_bytes(&self, kind: &FieldType) -> usize {
        min_encoded_bytes(&self.structs, kind)
    }
}

fn min_encoded_bytes(structs: &[StructDefinition], kind: &FieldType) -> usize {
    match kind {
        FieldType::Scalar(scalar) => scalar.size_in_bytes(),
        FieldType::Text | FieldType::WideText | FieldType::Sequence(_) => 4,
        FieldType::Array(kind, count) => min_encoded_bytes(structs, kind).saturating_mul(*count),
        FieldType::Struct(index) => structs[*index].least_bytes,
    }
}

/// The sections of a text, each with the name and the language of its definition.
fn split_sections<'t>(
    root: &str,
    language: DefinitionLanguage,
    text: &'t str,
) -> Vec<(String, DefinitionLanguage, &'t str)> {
    let is_line = |line: &str| line.len() >= 40 && line.bytes().all(|byte| byte == b'=');
    let (mut sections, mut begin, mut at) = (Vec::new(), 0, 0);
    for line in text.split_inclusive('\n') {
        if is_line(line.trim_end()) {
            sections.push(&text[begin..at]);
            begin = at + line.len();
        }
        at += line.len();
    }
    sections.push(&text[begin..]);
    let named = |(index, section): (usize, &'t str)| {
        let head = section.trim_start();
        let (first, rest) = head.split_once('\n').unwrap_or((head, ""));
        if let Some(name) = first.strip_prefix("IDL:") {
            return (normalized_type_name(name), DefinitionLanguage::Idl, rest);
        }
        let form = if language == DefinitionLanguage::Idl { DefinitionLanguage::Msg } else { language };
        match first.strip_prefix("MSG:") {
            Some(name) => (normalized_type_name(name), form, rest),
            None if index == 0 => (root.to_owned(), language, section),
            None => (String::new(), language, ""),
        }
    };
    let sections = sections.into_iter().enumerate().map(named);
    sections.filter(|(name, ..)| !name.is_empty()).collect()
}

/// A name without the folder of messages: `sensor_msgs/msg/Imu` and `sensor_msgs::msg::Imu` are `sensor_msgs/Imu`.
pub(crate) fn normalized_type_name(name: &str) -> String {
    let parts: Vec<&str> = name.trim().split(['/', ':']).filter(|it| !it.is_empty()).collect();
    match parts[..] {
        [package, "msg", name] => format!("{package}/{name}"),
        _ => parts.join("/"),
    }
}

/// Declarations while their names are resolved.
struct TypeResolver {
    declared: TypeDeclarations,
    /// Whether it is of ROS 1, of which only its times are known here.
    old: bool,
    structs: Vec<StructDefinition>,
    /// The index of each structure; none while it is resolved.
    done: HashMap<String, Option<usize>>,
}

impl TypeResolver {
    fn resolve_struct(&mut self, name: &str, depth: usize) -> Result<usize, String> {
        match self.done.get(name) {
            Some(Some(index)) => return Ok(*index),
            Some(None) => return Err(format!("`{name}` contains itself")),
            None if depth > DEEPEST => {
                return Err(format!("`{name}` lies more than {DEEPEST} structures deep"));
            }
            None => {}
        }
        let Some(TypeDeclaration::Struct(type_expression)) = self.find_declaration(name) else {
            return Err(format!("there is no definition of `{name}` in it"));
        };
        self.done.insert(name.to_owned(), None);
        let (mut fields, mut names) = (Vec::new(), HashSet::new());
        for (field, kind) in type_expression {
            if !names.insert(field.clone()) {
                return Err(format!("`{name}` has two fields `{field}`"));
            }
            let kind = self.resolve_type(&kind, depth + 1)?;
            fields.push(StructField { name: field, kind });
        }
        let sum = |sum: usize, field: &StructField| {
            sum.saturating_add(min_encoded_bytes(&self.structs, &field.kind))
        };
        let least_bytes = fields.iter().fold(0, sum);
        self.structs.push(StructDefinition { name: name.to_owned(), fields, least_bytes });
        let index = self.structs.len() - 1;
        self.done.insert(name.to_owned(), Some(index));
        Ok(index)
    }

    /// What is declared in the text, or else known here.
    fn find_declaration(&self, name: &str) -> Option<TypeDeclaration> {
        let known = || {
            standard_messages::standard_declarations()
                .get(name)
                .filter(|_| self.old == name.starts_with("ros1/"))
        };
        self.declared.get(name).or_else(known).cloned()
    }

    fn resolve_type(&mut self, type_expression: &TypeExpression, depth: usize) -> Result<FieldType, String> {
        if depth > DEEPEST {
            return Err(format!("types lie more than {DEEPEST} deep"));
        }
        match type_expression {
            TypeExpression::Plain(kind) => Ok(kind.clone()),
            TypeExpression::Array(inner, count) => {
                Ok(FieldType::Array(Box::new(self.resolve_type(inner, depth + 1)?), *count))
            }
            TypeExpression::Sequence(inner) => {
                Ok(FieldType::Sequence(Box::new(self.resolve_type(inner, depth + 1)?)))
            }
            TypeExpression::Named(names) => {
                let found = names.iter().find_map(|it| Some((it, self.find_declaration(it)?)));
                match found {
                    Some((_, TypeDeclaration::Alias(type_expression))) => {
                        self.resolve_type(&type_expression, depth + 1)
                    }
                    Some((name, TypeDeclaration::Struct(_))) => {
                        let name = name.clone();
                        self.resolve_struct(&name, depth).map(FieldType::Struct)
                    }
                    None => {
                        let name = names.first().map_or("", String::as_str);
                        Err(format!("there is no definition of `{name}` in it"))
                    }
                }
            }
        }
    }
}

/// Adds the definition of a message in the language of ROS 2.
///
/// # Errors
/// With the line that cannot be read.
fn add_msg_declaration(name: &str, text: &str, declared: &mut TypeDeclarations) -> Result<(), String> {
    msg::parse_msg_definition(name, DefinitionLanguage::Msg, text, declared)
}
