//! Resolves field paths in messages, such as `pose.pose.position.x` and `wheel_speed.0`.

use crate::definition::{Definition, EMPTY, Scalar, Struct, Type};
use crate::message::{LONGEST, Value};
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
pub struct LeafField {
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
    pub leaves: Vec<LeafField>,
    /// Lists of any length: path, steps and length.
    pub lists: Vec<(String, Vec<usize>, usize)>,
    /// Fields that are left out, each with the reason.
    pub left_out: Vec<String>,
}

/// A row of a message: most messages are one.
pub struct Row<'v> {
    /// Of a list whose elements are told apart by a text, that text.
    pub key: Option<&'v str>,
    /// Its values.
    pub value: &'v Value,
}

/// The list of transforms between frames, each named by its `child_frame_id`: two messages need not have the same ones.
struct Transforms {
    /// The index of the list among the fields.
    field: usize,
    /// The structure of its elements.
    element: usize,
    /// The index of the text.
    key: usize,
}

const TRANSFORMS: &str = "transforms";

impl Definition {
    fn transforms(&self) -> Option<Transforms> {
        let root = &self.structs[self.root()];
        if !matches!(root.name.as_str(), "tf2_msgs/TFMessage" | "tf/tfMessage") {
            return None;
        }
        let field = position(root, TRANSFORMS)?;
        let Type::Sequence(inner) = &root.fields[field].kind else { return None };
        let Type::Struct(element) = **inner else { return None };
        let key = position(&self.structs[element], "child_frame_id")?;
        Some(Transforms { field, element, key })
    }

    /// The structure of a row.
    fn row(&self) -> usize {
        self.transforms().map_or(self.root(), |it| it.element)
    }

    /// The rows of a message: itself, or each of its transforms.
    #[must_use]
    pub fn rows<'v>(&self, message: &'v Value) -> Vec<Row<'v>> {
        let Some(transforms) = self.transforms() else {
            return vec![Row { key: None, value: message }];
        };
        let Some(Value::List(elements)) = message.get(&[transforms.field]) else {
            return Vec::new();
        };
        let row = |value| match Value::get(value, &[transforms.key]) {
            Some(Value::Text(key)) => Some(Row { key: Some(key), value }),
            _ => None,
        };
        elements.iter().filter_map(row).collect()
    }

    /// The way to a field of messages.
    ///
    /// # Errors
    /// When there is none.
    pub fn find(&self, path: &str) -> Result<FieldPath, PathError> {
        let Some(transforms) = self.transforms() else {
            let steps = self.steps(&Type::Struct(self.root()), path)?;
            return Ok(FieldPath { key: None, steps });
        };
        let rest = path.strip_prefix(TRANSFORMS).and_then(|it| it.strip_prefix('.'));
        let rest = rest.ok_or(PathError::Missing)?;
        // A frame may have points in its name.
        let split = rest.match_indices('.').map(|(at, _)| (&rest[..at], &rest[at + 1..]));
        let mut found = split.filter_map(|(key, path)| {
            let steps = self.steps(&Type::Struct(transforms.element), path).ok()?;
            Some(FieldPath { key: Some(key.to_owned()), steps })
        });
        found.next().ok_or(PathError::Missing)
    }

    fn steps(&self, kind: &Type, path: &str) -> Result<Vec<usize>, PathError> {
        let (mut steps, mut kind) = (Vec::new(), kind);
        for name in path.split('.') {
            kind = match kind {
                Type::Struct(index) => {
                    let of = &self.structs[*index];
                    let step = position(of, name).ok_or(PathError::Missing)?;
                    steps.push(step);
                    &of.fields[step].kind
                }
                Type::Array(inner, _) | Type::Sequence(inner) => {
                    let step = name.parse().map_err(|_| PathError::Missing)?;
                    if matches!(kind, Type::Array(_, count) if step >= *count) {
                        return Err(PathError::Missing);
                    }
                    steps.push(step);
                    inner
                }
                _ => return Err(PathError::Missing),
            };
        }
        match kind {
            Type::Struct(_) => Err(PathError::Other("a message".to_owned())),
            Type::Array(..) | Type::Sequence(_) => {
                Err(PathError::Other("a list: add an index, as in `.0`".to_owned()))
            }
            Type::Scalar(Scalar::Quadruple) => {
                Err(PathError::Other("a number of 128 bits".to_owned()))
            }
            _ => Ok(steps),
        }
    }

    /// The fields of a row; without one those that the definition promises.
    #[must_use]
    pub fn list(&self, row: Option<&Row>) -> FieldListing {
        let prefix = match (self.transforms(), row.and_then(|row| row.key)) {
            (None, _) => String::new(),
            (Some(_), None) => return FieldListing::default(),
            (Some(_), Some(key)) => format!("{TRANSFORMS}.{key}"),
        };
        let mut walk =
            FieldLister { definition: self, steps: Vec::new(), listing: FieldListing::default() };
        let kind = Type::Struct(self.row());
        walk.go(&kind, row.map(|row| row.value), prefix, None);
        walk.listing
    }

    /// The unit of the number at the end of a way.
    #[must_use]
    pub fn unit(&self, way: &FieldPath) -> Option<&'static str> {
        let (mut kind, mut unit) = (&Type::Struct(self.row()), None);
        for step in &way.steps {
            kind = match kind {
                Type::Struct(index) => {
                    let structure = &self.structs[*index];
                    let field = structure.fields.get(*step)?;
                    unit = unit.or_else(|| units::of(&structure.name, &field.name));
                    &field.kind
                }
                Type::Array(inner, _) | Type::Sequence(inner) => inner,
                _ => return None,
            };
        }
        unit.flatten()
    }

    /// The steps to the time at which a row was measured: `header.stamp`, or `stamp`.
    fn stamp_steps(&self) -> Option<[Vec<usize>; 2]> {
        let row = &self.structs[self.row()];
        let (at, kind) = match (position(row, "header"), position(row, "stamp")) {
            (Some(header), _) => {
                let Type::Struct(index) = row.fields[header].kind else { return None };
                let inner = &self.structs[index];
                let stamp = position(inner, "stamp")?;
                (vec![header, stamp], &inner.fields[stamp].kind)
            }
            (None, Some(stamp)) => (vec![stamp], &row.fields[stamp].kind),
            (None, None) => return None,
        };
        let Type::Struct(index) = kind else { return None };
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
    pub fn stamp(&self, row: &Row) -> Option<i128> {
        let [seconds, nanoseconds] = self.stamp_steps()?;
        match (row.value.get(&seconds)?, row.value.get(&nanoseconds)?) {
            (Value::Integer(seconds), Value::Integer(nanoseconds)) => {
                Some(seconds * 1_000_000_000 + nanoseconds)
            }
            _ => None,
        }
    }
}

fn position(structure: &Struct, name: &str) -> Option<usize> {
    structure.fields.iter().position(|field| field.name == name)
}

/// A walk through all fields of a row.
struct FieldLister<'d> {
    definition: &'d Definition,
    steps: Vec<usize>,
    listing: FieldListing,
}

impl FieldLister<'_> {
    fn go(
        &mut self,
        kind: &Type,
        value: Option<&Value>,
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
            Type::Scalar(Scalar::Quadruple) => {
                self.listing.left_out.push(format!("`{path}`: a number of 128 bits"));
            }
            Type::Scalar(_) | Type::Text | Type::WideText => {
                let steps = self.steps.clone();
                self.listing.leaves.push(LeafField { path, steps, unit: unit.flatten() });
            }
            Type::Struct(index) => {
                let definition = self.definition;
                let structure = &definition.structs[*index];
                for (step, field) in structure.fields.iter().enumerate() {
                    if field.name == EMPTY {
                        continue;
                    }
                    let dot = if path.is_empty() { "" } else { "." };
                    let path = format!("{path}{dot}{}", field.name);
                    let value = value.and_then(|it| it.get(&[step]));
                    self.steps.push(step);
                    self.go(
                        &field.kind,
                        value,
                        path,
                        unit.or_else(|| units::of(&structure.name, &field.name)),
                    );
                    self.steps.pop();
                }
            }
            Type::Array(inner, count) => self.elements(inner, value, path, unit, *count),
            Type::Sequence(inner) => {
                // Without a message nobody knows how many there are.
                let count = match value {
                    Some(Value::List(elements)) => elements.len(),
                    Some(Value::Long(count)) => *count,
                    _ => 1,
                };
                self.listing.lists.push((path.clone(), self.steps.clone(), count));
                self.elements(inner, value, path, unit, count);
            }
        }
    }

    fn elements(
        &mut self,
        inner: &Type,
        value: Option<&Value>,
        path: String,
        unit: Option<Option<&'static str>>,
        count: usize,
    ) {
        if count > LONGEST || matches!(value, Some(Value::Long(_))) {
            self.listing.left_out.push(format!("`{path}`: a list of {count} elements"));
            return;
        }
        for step in 0..count {
            self.steps.push(step);
            let value = value.and_then(|it| it.get(&[step]));
            self.go(inner, value, format!("{path}.{step}"), unit);
            self.steps.pop();
        }
    }
}
