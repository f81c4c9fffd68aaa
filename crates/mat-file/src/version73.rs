//! Reads version 7.3, which is HDF5 with attributes that name MATLAB's classes; and plain HDF5, whose arrays have none.

use hdf5_pure::{AttrValue, DType, Dataset, File, Group, Object};

use crate::bytes::{MemoryBudget, character_rows, element_count};
use crate::{Error, MatFile, MatValue, MatVariable, NumericArray, cell};

/// Structs and cells within each other, at most.
const DEPTH: usize = 32;

/// What a look at an object takes of the budget [B]: cells that hold each other many times over end by it.
const LOOK: usize = 256;

/// What an array is.
#[derive(Clone, Copy, PartialEq)]
enum MatlabClass {
    Numbers,
    Texts,
    Cell,
    /// A field of an array of structs: a reference for each element.
    Field,
    Unread(&'static str),
}

pub(crate) fn read_version73(bytes: &[u8]) -> Result<MatFile, Error> {
    let file = File::from_bytes(bytes.to_vec())
        .map_err(|error| Error::without_offset(format!("the HDF5 file cannot be read: {error}")))?;
    let mut reader = Version73Reader { found: MatFile::default(), budget: MemoryBudget::new() };
    reader.read_group(&file.root(), "", 0)?;
    Ok(reader.found)
}

struct Version73Reader {
    found: MatFile,
    budget: MemoryBudget,
}

impl Version73Reader {
    fn skip_variable(&mut self, name: &str, why: impl Into<String>) {
        self.found.skipped.push((name.to_owned(), why.into()));
    }

    fn add_variable(&mut self, name: &str, value: MatValue) {
        self.found.variables.push(MatVariable { name: name.to_owned(), value });
    }

    fn check_depth(&mut self, name: &str, depth: usize) -> Result<(), Error> {
        if depth > DEPTH {
            let what = format!("expected at most {DEPTH} structs within each other, found more");
            return Err(Error::without_offset(format!("`{name}`: {what}")));
        }
        self.budget.reserve(name.len() + LOOK, None)
    }

    /// The variables of the file, or the fields of a struct.
    fn read_group(&mut self, group: &Group, name: &str, depth: usize) -> Result<(), Error> {
        self.check_depth(name, depth)?;
        let attributes = group.attrs().unwrap_or_default();
        if attributes.contains_key("MATLAB_sparse") {
            self.skip_variable(name, crate::SPARSE);
            return Ok(());
        }
        let wrong = |error| {
            let what = "was the file copied whole? In older files, a group with soft links cannot be read";
            Error::without_offset(format!(
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
            self.read_object(member, &name, depth + 1)?;
        }
        Ok(())
    }

    fn read_object(&mut self, object: &Object, name: &str, depth: usize) -> Result<(), Error> {
        match object {
            Object::Group(group) => self.read_group(group, name, depth),
            Object::Dataset(dataset) => self.read_dataset(dataset, name, depth),
            _ => {
                self.skip_variable(name, "an object of HDF5 of neither numbers nor texts");
                Ok(())
            }
        }
    }

    /// An array. What is wrong with it alone leaves it out, with the reason.
    fn read_dataset(&mut self, dataset: &Dataset, name: &str, depth: usize) -> Result<(), Error> {
        self.check_depth(name, depth)?;
        let attributes = dataset.attrs().unwrap_or_default();
        let class = dataset_class(dataset, attributes.get("MATLAB_class").and_then(AttrValue::as_str));
        if let MatlabClass::Unread(why) = class {
            self.skip_variable(name, why);
            return Ok(());
        }
        let empty = attributes.contains_key("MATLAB_empty");
        let shape = match dataset.shape() {
            Ok(shape) => shape,
            Err(error) => {
                self.skip_variable(name, error.to_string());
                return Ok(());
            }
        };
        // HDF5 counts the slowest dimension first, MATLAB the fastest.
        let mut shape: Vec<usize> =
            shape.iter().rev().map(|it| usize::try_from(*it).unwrap_or(usize::MAX)).collect();
        shape.resize(shape.len().max(2), 1);
        let elements = element_count(&shape).ok_or_else(|| {
            Error::without_offset(format!("`{name}` states more elements than can be counted"))
        })?;
        self.budget.reserve(elements.saturating_mul(8), None)?;
        let read = match class {
            // The dimensions of an empty array stand where its numbers would.
            MatlabClass::Numbers if empty => dataset.read_f64().map(|shape| {
                let shape = shape.iter().map(|it| *it as usize).collect();
                MatValue::Numbers(NumericArray { shape, values: vec![] })
            }),
            MatlabClass::Texts if empty => Ok(MatValue::Texts(vec![String::new()])),
            MatlabClass::Cell | MatlabClass::Field if empty => return Ok(()),
            MatlabClass::Numbers => {
                dataset.read_f64().map(|values| MatValue::Numbers(NumericArray { shape, values }))
            }
            MatlabClass::Texts => read_text_rows(dataset, &shape),
            _ => match dataset.dereference() {
                Ok(members) => return self.read_members(&members, name, class, depth),
                Err(error) => Err(error),
            },
        };
        match read {
            Ok(MatValue::Numbers(array)) if !empty && array.values.len() != elements => {
                let there = array.values.len();
                self.skip_variable(name, format!("expected {elements} numbers, found {there}"));
            }
            Ok(value) => self.add_variable(name, value),
            Err(error) => {
                self.skip_variable(name, error.to_string());
                return Ok(());
            }
        }
        // Programs other than MATLAB say the unit in an attribute.
        let unit = ["units", "unit"].iter().find_map(|it| attributes.get(*it).and_then(AttrValue::as_str));
        if let Some(unit) = unit {
            self.add_variable(&format!("{name}_units"), MatValue::Texts(vec![unit.to_owned()]));
        }
        Ok(())
    }

    /// What a cell holds, or a field of each element of an array of structs.
    fn read_members(
        &mut self,
        members: &[Object],
        name: &str,
        class: MatlabClass,
        depth: usize,
    ) -> Result<(), Error> {
        let begin = cell::CellStart::at_end_of(&self.found);
        for (k, member) in (1..).zip(members) {
            let name = match (class, name.rsplit_once('.')) {
                (MatlabClass::Field, Some((of, field))) => format!("{of}({k}).{field}"),
                _ => format!("{name}{{{k}}}"),
            };
            self.read_object(member, &name, depth + 1)?;
        }
        if class == MatlabClass::Cell {
            begin.join_texts(&mut self.found, name, members.len());
        }
        Ok(())
    }
}

/// What a dataset is, by the class that MATLAB names and by what it holds.
fn dataset_class(dataset: &Dataset, named: Option<&str>) -> MatlabClass {
    let kind = match dataset.dtype() {
        Ok(kind) => kind,
        Err(_) => return MatlabClass::Unread("an array of an unknown type"),
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
        (Some("char"), _) if number => MatlabClass::Texts,
        (Some("cell"), DType::ObjectReference) => MatlabClass::Cell,
        // An empty one holds its dimensions.
        (Some("cell"), _) if number => MatlabClass::Cell,
        (Some("struct"), _) if number => MatlabClass::Cell,
        (Some("function_handle"), _) => MatlabClass::Unread("a function"),
        (
            None
            | Some(
                "double" | "single" | "logical" | "int8" | "int16" | "int32" | "int64" | "uint8" | "uint16"
                | "uint32" | "uint64" | "canonical empty",
            ),
            _,
        ) if number => MatlabClass::Numbers,
        (None, DType::ObjectReference) => MatlabClass::Field,
        (None, DType::String | DType::VariableLengthString) => MatlabClass::Texts,
        (_, DType::Compound(_)) => MatlabClass::Unread("complex numbers, or a table of HDF5"),
        (Some(_), _) => MatlabClass::Unread(crate::OBJECT),
        (None, _) => MatlabClass::Unread("an array of HDF5 of neither numbers nor texts"),
    }
}

/// The rows of a text: of UTF-16 as MATLAB has it, or the texts of HDF5.
fn read_text_rows(dataset: &Dataset, shape: &[usize]) -> Result<MatValue, hdf5_pure::Error> {
    let kind = dataset.dtype()?;
    if matches!(kind, DType::String | DType::VariableLengthString) {
        return dataset.read_string().map(MatValue::Texts);
    }
    let units = dataset.read_u16()?;
    let characters: Vec<char> = text_encoding::utf16_units(units).chars().collect();
    Ok(MatValue::Texts(character_rows(&characters, shape)))
}
