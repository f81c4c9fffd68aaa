//! Writes values of variables for the script, and reads those that it answers with.

use fmu_export::{Cell, FmiResult, reject};

/// Writes the values at these places.
pub(crate) fn write(places: &[usize], values: &[Cell], bytes: &mut Vec<u8>) {
    for place in places {
        match &values[*place] {
            Cell::Real(value) => bytes.extend(value.to_le_bytes()),
            Cell::Integer(value) => bytes.extend(value.to_le_bytes()),
            Cell::Boolean(value) => bytes.push((*value).into()),
            Cell::String(value) => {
                bytes.extend((value.len() as u32).to_le_bytes());
                bytes.extend(value.as_bytes());
            }
        }
    }
}

/// Reads the values at these places.
///
/// # Errors
/// When the bytes are of other variables.
pub(crate) fn read(places: &[usize], mut bytes: &[u8], values: &mut [Cell]) -> FmiResult {
    for place in places {
        let read = read_one(&mut bytes, &mut values[*place]);
        if read.is_none() {
            return reject("the answer of Python is of other variables than the FMU has");
        }
    }
    match bytes {
        [] => Ok(()),
        _ => reject("the answer of Python is longer than its variables"),
    }
}

fn read_one(bytes: &mut &[u8], value: &mut Cell) -> Option<()> {
    match value {
        Cell::Real(value) => *value = f64::from_le_bytes(take(bytes)?),
        Cell::Integer(value) => *value = i32::from_le_bytes(take(bytes)?),
        Cell::Boolean(value) => *value = take::<1>(bytes)?[0] != 0,
        Cell::String(value) => {
            let length = u32::from_le_bytes(take(bytes)?) as usize;
            let (text, rest) = bytes.split_at_checked(length)?;
            std::str::from_utf8(text).ok()?.clone_into(value);
            *bytes = rest;
        }
    }
    Some(())
}

fn take<const N: usize>(bytes: &mut &[u8]) -> Option<[u8; N]> {
    let (first, rest) = bytes.split_first_chunk()?;
    *bytes = rest;
    Some(*first)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_come_back_as_they_were_and_nothing_else_does() {
        let values = [
            Cell::String("ä\n".into()),
            Cell::Real(f64::NAN),
            Cell::Boolean(true),
            Cell::Integer(i32::MIN),
            Cell::Real(-0.0),
        ];
        let places = [1, 4, 3, 2, 0];
        let mut bytes = Vec::new();
        write(&places, &values, &mut bytes);
        let mut found = values.clone().map(|value| match value {
            Cell::Real(_) => Cell::Real(1.0),
            Cell::Integer(_) => Cell::Integer(1),
            Cell::Boolean(_) => Cell::Boolean(false),
            Cell::String(_) => Cell::String(String::new()),
        });
        read(&places, &bytes, &mut found).expect("the same variables");
        assert_eq!(format!("{found:?}"), format!("{values:?}"));
        assert!(read(&places, &bytes[..bytes.len() - 1], &mut found).is_err());
        bytes.push(0);
        assert!(read(&places, &bytes, &mut found).is_err());
    }
}
