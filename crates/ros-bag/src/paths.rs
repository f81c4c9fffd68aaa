//! Resolves field paths in messages, such as `pose.pose.position.x` and `wheel_speed.0`.

use crate::definition::{EMPTY, FieldType, MessageDefinition, ScalarType, StructDefinition};
use crate::message::{LONGEST, MessageValue};
use crate::units;

/// Fields of one row that are listed at most.
const MOST: usize = 4096;

/// The way to a number or a text in the messages of a topic.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FieldPath {
    /// Of a list whose elements are told apart by a text, that text.
    pub key: Option<String>,
    /// Indices of fields and elements, from the row on.
    pub steps: Vec<usize>,
}

/// Why there is no such way.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PathError {
    /// No field is called that.
    Missing,
    /// What is there is neither a number nor a text but this.
    Other(String),
}

/// A field that is a number or a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PrimitiveField {
    /// Its path.
    pub path: String,
    /// Indices of fields and elements, from the row on.
    pub steps: Vec<usize>,
    /// Its unit, where its type is known.
    pub unit: Option<&'static str>,
}

/// What a row of a topic has.
#[derive(Clone, Debug, Default)]
pub struct FieldListing {
    /// The fields, in the order of the message.
    pub leaves: Vec<PrimitiveField>,
    /// Lists of any length: path, steps and length.
    pub lists: Vec<(String, Vec<usize>, usize)>,
    /// Fields that are left out, each with the reason.
    pub left_out: Vec<String>,
}

/// A row of a message: most messages are one.
pub struct RosMessageRow<'v> {
    /// Of a list whose elements are told apart by a text, that text.
    pub key: Option<&'v str>,
    /// Its values.
    pub value: &'v MessageValue,
}

/// The list of transforms between frames, each named by its `child_frame_id`: two messages need not have the same ones.
struct TransformListPath {
    /// The index of the list among the fields.
    field: usize,
    /// The structure of its elements.
    element: usize,
    /// The index of the text.
    key: usize,
}

const TRANSFORMS: &str = "transforms";

impl MessageDefinition {
    fn transform_list_path(&self) -> Option<TransformListPath> {
        let root = &self.structs[self.root_struct_index()];
        if !matches!(root.name.as_str(), "tf2_msgs/TFMessage" | "tf/tfMessage") {
            return None;
        }
        let field = field_position(root, TRANSFORMS)?;
        let FieldType::Sequence(inner) = &root.fields[field].kind else { return None };
        let FieldType::Struct(element) = **inner else { return None };
        let key = field_position(&self.structs[element], "child_frame_id")?;
        Some(TransformListPath { field, element, key })
    }

    /// The structure of a row.
    fn row_struct_index(&self) -> usize {
        self.transform_list_path().map_or(self.root_struct_index(), |it| it.element)
    }

    /// The rows of a message: itself, or each of its transforms.
    #[must_use]
    pub fn message_rows<'v>(&self, message: &'v MessageValue) -> Vec<RosMessageRow<'v>> {
        let Some(transforms) = self.transform_list_path() else {
            return vec![RosMessageRow { key: None, value: message }];
        };
        let Some(MessageValue::List(elements)) = message.get_at_path(&[transforms.field]) else {
            return Vec::new();
        };
        let row = |value| match MessageValue::get_at_path(value, &[transforms.key]) {
            Some(MessageValue::Text(key)) => Some(RosMessageRow { key: Some(key), value }),
            _ => None,
        };
        elements.iter().filter_map(row).collect()
    }

    /// The way to a field of messages.
    ///
    /// # Errors
    /// When there is none.
    pub fn resolve_field_path(&self, path: &str) -> Result<FieldPath, PathError> {
        let Some(transforms) = self.transform_list_path() else {
            let steps = self.resolve_path_steps(&FieldType::Struct(self.root_struct_index()), path)?;
            return Ok(FieldPath { key: None, steps });
        };
        let rest = path.strip_prefix(TRANSFORMS).and_then(|it| it.strip_prefix('.'));
        let rest = rest.ok_or(PathError::Missing)?;
        // A frame may have points in its name.
        let split = rest.match_indices('.').map(|(at, _)| (&rest[..at], &rest[at + 1..]));
        let mut found = split.filter_map(|(key, path)| {
            let steps = self.resolve_path_steps(&FieldType::Struct(transforms.element), path).ok()?;
            Some(FieldPath { key: Some(key.to_owned()), steps })
        });
        found.next().ok_or(PathError::Missing)
    }

    fn resolve_path_steps(&self, kind: &FieldType, path: &str) -> Result<Vec<usize>, PathError> {
        let (mut steps, mut kind) = (Vec::new(), kind);
        for name in path.split('.') {
            kind = match kind {
                FieldType::Struct(index) => {
                    let of = &self.structs[*index];
                    let step = field_position(of, name).ok_or(PathError::Missing)?;
                    steps.push(step);
                    &of.fields[step].kind
                }
                FieldType::Array(inner, _) | FieldType::Sequence(inner) => {
                    let step = name.parse().map_err(|_| PathError::Missing)?;
                    if matches!(kind, FieldType::Array(_, count) if step >= *count) {
                        return Err(PathError::Missing);
                    }
                    steps.push(step);
                    inner
                }
                _ => return Err(PathError::Missing),
            };
        }
        match kind {
            FieldType::Struct(_) => Err(PathError::Other("a message".to_owned())),
            FieldType::Array(..) | FieldType::Sequence(_) => {
                Err(PathError::Other("a list: add an index, as in `.0`".to_owned()))
            }
            FieldType::Scalar(ScalarType::Quadruple) => {
                Err(PathError::Other("a number of 128 bits".to_owned()))
            }
            _ => Ok(steps),
        }
    }

    /// The fields of a row; without one those that the definition promises.
    #[must_use]
    pub fn list_fields(&self, row: Option<&RosMessageRow>) -> FieldListing {
        let prefix = match (self.transform_list_path(), row.and_then(|row| row.key)) {
            (None, _) => String::new(),
            (Some(_), None) => return FieldListing::default(),
            (Some(_), Some(key)) => format!("{TRANSFORMS}.{key}"),
        };
        let mut walk = FieldLister { definition: self, steps: Vec::new(), listing: FieldListing::default() };
        let kind = FieldType::Struct(self.row_struct_index());
        walk.visit_field(&kind, row.map(|row| row.value), prefix, None);
        walk.listing
    }

    /// The unit of the number at the end of a way.
    #[must_use]
    pub fn field_unit(&self, way: &FieldPath) -> Option<&'static str> {
        let (mut kind, mut unit) = (&FieldType::Struct(self.row_struct_index()), None);
        for step in &way.steps {
            kind = match kind {
                FieldType::Struct(index) => {
                    let structure = &self.structs[*index];
                    let field = structure.fields.get(*step)?;
                    unit = unit.or_else(|| units::standard_field_unit(&structure.name, &field.name));
                    &field.kind
                }
                FieldType::Array(inner, _) | FieldType::Sequence(inner) => inner,
                _ => return None,
            };
        }
        unit.flatten()
    }

    /// The steps to the time at which a row was measured: `header.stamp`, or `stamp`.
    fn stamp_steps(&self) -> Option<[Vec<usize>; 2]> {
        let row = &self.structs[self.row_struct_index()];
        let (at, kind) = match (field_position(row, "header"), field_position(row, "stamp")) {
            (Some(header), _) => {
                let FieldType::Struct(index) = row.fields[header].kind else { return None };
                let inner = &self.structs[index];
                let stamp = field_position(inner, "stamp")?;
                (vec![header, stamp], &inner.fields[stamp].kind)
            }
            (None, Some(stamp)) => (vec![stamp], &row.fields[stamp].kind),
            (None, None) => return None,
        };
        let FieldType::Struct(index) = kind else { return None };
        let time = &self.structs[*index];
        if !matches!(time.name.as_str(), "builtin_interfaces/Time" | "ros1/Time") {
            return None;
        }
        let part = |part: usize| at.iter().copied().chain([part]).collect();
        Some([part(0), part(1)])
    }

    /// Whether rows say when they were measured, in `header.stamp` or `stamp`.
    #[must_use]
    pub fn has_stamp(&self) -> bool {
        self.stamp_steps().is_some()
    }

    /// The time at which a row was measured [ns].
    #[must_use]
    pub fn header_stamp(&self, row: &RosMessageRow) -> Option<i128> {
        let [seconds, nanoseconds] = self.stamp_steps()?;
        match (row.value.get_at_path(&seconds)?, row.value.get_at_path(&nanoseconds)?) {
            (MessageValue::Integer(seconds), MessageValue::Integer(nanoseconds)) => {
                Some(seconds * 1_000_000_000 + nanoseconds)
            }
            _ => None,
        }
    }
}

fn field_position(structure: &StructDefinition, name: &str) -> Option<usize> {
    structure.fields.iter().position(|field| field.name == name)
}

/// A walk through all fields of a row.
struct FieldLister<'d> {
    definition: &'d MessageDefinition,
    steps: Vec<usize>,
    listing: FieldListing,
}

impl FieldLister<'_> {
    fn visit_field(
        &mut self,
        kind: &FieldType,
        value: Option<&MessageValue>,
        path: String,
        unit: Option<Option<&'static str>>,
    ) {
        if self.listing.leaves.len() >= MOST {
            let more = format!("fields behind the first {MOST}");
            if self.listing.left_out.last() != Some(&more) {
                self.listing.left_out.push(more);
            }
            return;
        }
        match kind {
            FieldType::Scalar(ScalarType::Quadruple) => {
                self.listing.left_out.push(format!("`{path}`: a number of 128 bits"));
            }
            FieldType::Scalar(_) | FieldType::Text | FieldType::WideText => {
                let steps = self.steps.clone();
                self.listing.leaves.push(PrimitiveField { path, steps, unit: unit.flatten() });
            }
            FieldType::Struct(index) => {
                let definition = self.definition;
                let structure = &definition.structs[*index];
                for (step, field) in structure.fields.iter().enumerate() {
                    if field.name == EMPTY {
                        continue;
                    }
                    let dot = if path.is_empty() { "" } else { "." };
                    let path = format!("{path}{dot}{}", field.name);
                    let value = value.and_then(|it| it.get_at_path(&[step]));
                    self.steps.push(step);
                    self.visit_field(
                        &field.kind,
                        value,
                        path,
                        unit.or_else(|| units::standard_field_unit(&structure.name, &field.name)),
                    );
                    self.steps.pop();
                }
            }
            FieldType::Array(inner, count) => self.visit_elements(inner, value, path, unit, *count),
            FieldType::Sequence(inner) => {
                // Without a message nobody knows how many there are.
                let count = match value {
                    Some(MessageValue::List(elements)) => elements.len(),
                    Some(MessageValue::Long(count)) => *count,
                    _ => 1,
                };
                self.listing.lists.push((path.clone(), self.steps.clone(), count));
                self.visit_elements(inner, value, path, unit, count);
            }
        }
    }

    fn visit_elements(
        &mut self,
        inner: &FieldType,
        value: Option<&MessageValue>,
        path: String,
        unit: Option<Option<&'static str>>,
        count: usize,
    ) {
        if count > LONGEST || matches!(value, Some(MessageValue::Long(_))) {
            self.listing.left_out.push(format!("`{path}`: a list of {count} elements"));
            return;
        }
        for step in 0..count {
            self.steps.push(step);
            let value = value.and_then(|it| it.get_at_path(&[step]));
            self.visit_field(inner, value, format!("{path}.{step}"), unit);
            self.steps.pop();
        }
    }
}
