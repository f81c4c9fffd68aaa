//! Reads version 7.3, which is HDF5 with attributes that name MATLAB's classes; and plain HDF5, whose arrays have none.

use hdf5_pure::{AttrValue, DType, Dataset, File, Group, Object};

use crate::bytes::{Budget, count, rows};
use crate::{Array, Error, MatFile, Value, Variable, cell};

/// Structs and cells within each other, at most.
const DEPTH: usize = 32;

/// What a look at an object takes of the budget [B]: cells that hold each other many times over end by it.
const LOOK: usize = 256;

/// What an array is.
#[derive(Clone, Copy, PartialEq)]
enum Class {
    Numbers,
    Texts,
    Cell,
    /// A field of an array of structs: a reference for each element.
    Field,
    Unread(&'static str),
}

pub(crate) fn read(bytes: &[u8]) -> Result<MatFile, Error> {
    let file = File::from_bytes(bytes.to_vec())
        .map_err(|error| Error::of_file(format!("the HDF5 file cannot be read: {error}")))?;
    let mut reader = Reader { found: MatFile::default(), budget: Budget::new() };
    reader.group(&file.root(), "", 0)?;
    Ok(reader.found)
}

struct Reader {
    found: MatFile,
    budget: Budget,
}

impl Reader {
    fn skip(&mut self, name: &str, why: impl Into<String>) {
        self.found.skipped.push((name.to_owned(), why.into()));
    }

    fn keep(&mut self, name: &str, value: Value) {
        self.found.variables.push(Variable { name: name.to_owned(), value });
    }

    fn look(&mut self, name: &str, depth: usize) -> Result<(), Error> {
        if depth > DEPTH {
            let what = format!("expected at most {DEPTH} structs within each other, found more");
            return Err(Error::of_file(format!("`{name}`: {what}")));
        }
        self.budget.take(name.len() + LOOK, None)
    }

    /// The variables of the file, or the fields of a struct.
    fn group(&mut self, group: &Group, name: &str, depth: usize) -> Result<(), Error> {
        self.look(name, depth)?;
        let attributes = group.attrs().unwrap_or_default();
        if attributes.contains_key("MATLAB_sparse") {
            self.skip(name, crate::SPARSE);
            return Ok(());
        }
        let wrong = |error| {
            let what =
                "was the file copied whole? In older files, a group with soft links cannot be read";
            Error::of_file(format!(
                "group `/{}` of the HDF5 file: {error}: {what}",
                name.replace('.', "/")
            ))
        };
        let datasets = group.iter_datasets().map_err(wrong)?;
        let datasets = datasets.map(|(name, it)| (name, Object::Dataset(Box::new(it))));
        let groups = group.iter_groups().map_err(wrong)?;
        let groups = groups.map(|(name, it)| (name, Object::Group(it)));
        let mut members: Vec<_> = datasets.chain(groups).collect();
        members.sort_by(|a, b| a.0.cmp(&b.0));
        for (field, member) in &members {
            // MATLAB's own: what cells refer to, and the data of objects.
            if name.is_empty() && field.starts_with('#') {
                continue;
            }
            let name = if name.is_empty() { field.clone() } else { format!("{name}.{field}") };
            self.object(member, &name, depth + 1)?;
        }
        Ok(())
    }

    fn object(&mut self, object: &Object, name: &str, depth: usize) -> Result<(), Error> {
        match object {
            Object::Group(group) => self.group(group, name, depth),
            Object::Dataset(dataset) => self.dataset(dataset, name, depth),
            _ => {
                self.skip(name, "an object of HDF5 of neither numbers nor texts");
                Ok(())
            }
        }
    }

    /// An array. What is wrong with it alone leaves it out, with the reason.
    fn dataset(&mut self, dataset: &Dataset, name: &str, depth: usize) -> Result<(), Error> {
        self.look(name, depth)?;
        let attributes = dataset.attrs().unwrap_or_default();
        let class = class(dataset, attributes.get("MATLAB_class").and_then(AttrValue::as_str));
        if let Class::Unread(why) = class {
            self.skip(name, why);
            return Ok(());
        }
        let empty = attributes.contains_key("MATLAB_empty");
        let shape = match dataset.shape() {
            Ok(shape) => shape,
            Err(error) => {
                self.skip(name, error.to_string());
                return Ok(());
            }
        };
        // HDF5 counts the slowest dimension first, MATLAB the fastest.
        let mut shape: Vec<usize> =
            shape.iter().rev().map(|it| usize::try_from(*it).unwrap_or(usize::MAX)).collect();
        shape.resize(shape.len().max(2), 1);
        let elements = count(&shape).ok_or_else(|| {
            Error::of_file(format!("`{name}` states more elements than can be counted"))
        })?;
        self.budget.take(elements.saturating_mul(8), None)?;
        let read = match class {
            // The dimensions of an empty array stand where its numbers would.
            Class::Numbers if empty => dataset.read_f64().map(|shape| {
                let shape = shape.iter().map(|it| *it as usize).collect();
                Value::Numbers(Array { shape, values: vec![] })
            }),
            Class::Texts if empty => Ok(Value::Texts(vec![String::new()])),
            Class::Cell | Class::Field if empty => return Ok(()),
            Class::Numbers => {
                dataset.read_f64().map(|values| Value::Numbers(Array { shape, values }))
            }
            Class::Texts => texts(dataset, &shape),
            _ => match dataset.dereference() {
                Ok(members) => return self.members(&members, name, class, depth),
                Err(error) => Err(error),
            },
        };
        match read {
            Ok(Value::Numbers(array)) if !empty && array.values.len() != elements => {
                let there = array.values.len();
                self.skip(name, format!("expected {elements} numbers, found {there}"));
            }
            Ok(value) => self.keep(name, value),
            Err(error) => {
                self.skip(name, error.to_string());
                return Ok(());
            }
        }
        // Programs other than MATLAB say the unit in an attribute.
        let unit =
            ["units", "unit"].iter().find_map(|it| attributes.get(*it).and_then(AttrValue::as_str));
        if let Some(unit) = unit {
            self.keep(&format!("{name}_units"), Value::Texts(vec![unit.to_owned()]));
        }
        Ok(())
    }

    /// What a cell holds, or a field of each element of an array of structs.
    fn members(
        &mut self,
        members: &[Object],
        name: &str,
        class: Class,
        depth: usize,
    ) -> Result<(), Error> {
        let begin = cell::CellStart::of(&self.found);
        for (k, member) in (1..).zip(members) {
            let name = match (class, name.rsplit_once('.')) {
                (Class::Field, Some((of, field))) => format!("{of}({k}).{field}"),
                _ => format!("{name}{{{k}}}"),
            };
            self.object(member, &name, depth + 1)?;
        }
        if class == Class::Cell {
            begin.join_texts(&mut self.found, name, members.len());
        }
        Ok(())
    }
}

/// What a dataset is, by the class that MATLAB names and by what it holds.
fn class(dataset: &Dataset, named: Option<&str>) -> Class {
    let kind = match dataset.dtype() {
        Ok(kind) => kind,
        Err(_) => return Class::Unread("an array of an unknown type"),
    };
    let number = matches!(
        kind,
        DType::F32
            | DType::F64
            | DType::I8
            | DType::I16
            | DType::I32
            | DType::I64
            | DType::U8
            | DType::U16
            | DType::U32
            | DType::U64
            | DType::Enum(_)
    );
    match (named, kind) {
        (Some("char"), _) if number => Class::Texts,
        (Some("cell"), DType::ObjectReference) => Class::Cell,
        // An empty one holds its dimensions.
        (Some("cell"), _) if number => Class::Cell,
        (Some("struct"), _) if number => Class::Cell,
        (Some("function_handle"), _) => Class::Unread("a function"),
        (
            None
            | Some(
                "double" | "single" | "logical" | "int8" | "int16" | "int32" | "int64" | "uint8"
                | "uint16" | "uint32" | "uint64" | "canonical empty",
            ),
            _,
        ) if number => Class::Numbers,
        (None, DType::ObjectReference) => Class::Field,
        (None, DType::String | DType::VariableLengthString) => Class::Texts,
        (_, DType::Compound(_)) => Class::Unread("complex numbers, or a table of HDF5"),
        (Some(_), _) => Class::Unread(crate::OBJECT),
        (None, _) => Class::Unread("an array of HDF5 of neither numbers nor texts"),
    }
}

/// The rows of a text: of UTF-16 as MATLAB has it, or the texts of HDF5.
fn texts(dataset: &Dataset, shape: &[usize]) -> Result<Value, hdf5_pure::Error> {
    let kind = dataset.dtype()?;
    if matches!(kind, DType::String | DType::VariableLengthString) {
        return dataset.read_string().map(Value::Texts);
    }
    let units = dataset.read_u16()?;
    let characters: Vec<char> = text_encoding::utf16_units(units).chars().collect();
    Ok(Value::Texts(rows(&characters, shape)))
}
