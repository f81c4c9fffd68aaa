//! Encodes values of variables for the script, and decodes its answers.

use fmu_export::{FmiResult, VariableValue, reject};

/// Writes the values at these places.
pub(crate) fn write_values(places: &[usize], values: &[VariableValue], bytes: &mut Vec<u8>) {
    for place in places {
        match &values[*place] {
            VariableValue::Real(value) => bytes.extend(value.to_le_bytes()),
            VariableValue::Integer(value) => bytes.extend(value.to_le_bytes()),
            VariableValue::Boolean(value) => bytes.push((*value).into()),
            VariableValue::String(value) => {
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
pub(crate) fn read_values(places: &[usize], mut bytes: &[u8], values: &mut [VariableValue]) -> FmiResult {
    for place in places {
        let read = read_value(&mut bytes, &mut values[*place]);
        if read.is_none() {
            return reject("the answer of Python is of other variables than the FMU has");
        }
    }
    match bytes {
        [] => Ok(()),
        _ => reject("the answer of Python is longer than its variables"),
    }
}

fn read_value(bytes: &mut &[u8], value: &mut VariableValue) -> Option<()> {
    match value {
        VariableValue::Real(value) => *value = f64::from_le_bytes(take_bytes(bytes)?),
        VariableValue::Integer(value) => *value = i32::from_le_bytes(take_bytes(bytes)?),
        VariableValue::Boolean(value) => *value = take_bytes::<1>(bytes)?[0] != 0,
        VariableValue::String(value) => {
            let length = u32::from_le_bytes(take_bytes(bytes)?) as usize;
            let (text, rest) = bytes.split_at_checked(length)?;
            std::str::from_utf8(text).ok()?.clone_into(value);
            *bytes = rest;
        }
    }
    Some(())
}

fn take_bytes<const N: usize>(bytes: &mut &[u8]) -> Option<[u8; N]> {
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
            VariableValue::String("ä\n".into()),
            VariableValue::Real(f64::NAN),
            VariableValue::Boolean(true),
            VariableValue::Integer(i32::MIN),
            VariableValue::Real(-0.0),
        ];
        let places = [1, 4, 3, 2, 0];
        let mut bytes = Vec::new();
        write_values(&places, &values, &mut bytes);
        let mut found = values.clone().map(|value| match value {
            VariableValue::Real(_) => VariableValue::Real(1.0),
            VariableValue::Integer(_) => VariableValue::Integer(1),
            VariableValue::Boolean(_) => VariableValue::Boolean(false),
            VariableValue::String(_) => VariableValue::String(String::new()),
        });
        read_values(&places, &bytes, &mut found).expect("the same variables");
        assert_eq!(format!("{found:?}"), format!("{values:?}"));
        assert!(read_values(&places, &bytes[..bytes.len() - 1], &mut found).is_err());
        bytes.push(0);
        assert!(read_values(&places, &bytes, &mut found).is_err());
    }
}
