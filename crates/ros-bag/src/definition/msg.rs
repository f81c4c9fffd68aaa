//! Reads definitions in the language of ROS: a line for each field, `type name`.

use super::{
    DefinitionLanguage, FieldType, ScalarType, TypeDeclaration, TypeDeclarations, TypeExpression,
    normalized_type_name,
};

/// Reads one definition.
///
/// # Errors
/// With the line that cannot be read.
pub fn parse_msg_definition(
    name: &str,
    language: DefinitionLanguage,
    text: &str,
    declared: &mut TypeDeclarations,
) -> Result<(), String> {
    let package = name.split('/').next().unwrap_or_default();
    let mut fields = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let wrong = || format!("expected `type name` in line {}, found `{}`", number + 1, line.trim());
        let words = line.split('#').next().unwrap_or_default().trim();
        let Some((kind, rest)) = words.split_once(char::is_whitespace) else {
            match words {
                "" => continue,
                _ => return Err(wrong()),
            }
        };
        let rest = rest.trim_start();
        let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let end = rest.find(|c| !is_name(c)).unwrap_or(rest.len());
        let (field, behind) = rest.split_at(end);
        if field.is_empty() {
            return Err(wrong());
        }
        // A constant takes no room in a message.
        if behind.trim_start().starts_with('=') {
            continue;
        }
        let kind = parse_type_with_bounds(kind, package, language).ok_or_else(wrong)?;
        fields.push((field.to_owned(), kind));
    }
    if fields.is_empty() && language != DefinitionLanguage::Msg1 {
        // ROS 2 gives a message without fields one of a byte, for the sake of IDL.
        fields.push((EMPTY.to_owned(), scalar_expression(ScalarType::Integer { bytes: 1, signed: false })));
    }
    declared.insert(name.to_owned(), TypeDeclaration::Struct(fields));
    Ok(())
}

/// The field of a message without fields, as ROS 2 names it.
pub const EMPTY: &str = "structure_needs_at_least_one_member";

fn scalar_expression(scalar: ScalarType) -> TypeExpression {
    TypeExpression::Plain(FieldType::Scalar(scalar))
}

/// A type with its bounds, `float64[9]`, `string<=10[<=3]`.
fn parse_type_with_bounds(word: &str, package: &str, language: DefinitionLanguage) -> Option<TypeExpression> {
    let Some((inner, bounds)) = word.strip_suffix(']').and_then(|it| it.rsplit_once('[')) else {
        return parse_element_type(word, package, language);
    };
    let inner = Box::new(parse_element_type(inner, package, language)?);
    match bounds.strip_prefix("<=") {
        None if bounds.is_empty() => Some(TypeExpression::Sequence(inner)),
        None => Some(TypeExpression::Array(inner, bounds.trim().parse().ok()?)),
        Some(bound) => bound.trim().parse::<usize>().ok().map(|_| TypeExpression::Sequence(inner)),
    }
}

fn parse_element_type(word: &str, package: &str, language: DefinitionLanguage) -> Option<TypeExpression> {
    let integer = |bytes, signed| Some(scalar_expression(ScalarType::Integer { bytes, signed }));
    let old = language == DefinitionLanguage::Msg1;
    let (word, bound) = word.split_once("<=").map_or((word, None), |(it, bound)| (it, Some(bound)));
    if let Some(bound) = bound {
        bound.trim().parse::<usize>().ok()?;
    }
    match word {
        "bool" => Some(scalar_expression(ScalarType::Bool)),
        "int8" => integer(1, true),
        // A byte of ROS 1 has a sign.
        "byte" => integer(1, old),
        "uint8" | "char" => integer(1, false),
        "int16" => integer(2, true),
        "uint16" => integer(2, false),
        "int32" => integer(4, true),
        "uint32" => integer(4, false),
        "int64" => integer(8, true),
        "uint64" => integer(8, false),
        "float32" => Some(scalar_expression(ScalarType::Single)),
        "float64" => Some(scalar_expression(ScalarType::Double)),
        "string" => Some(TypeExpression::Plain(FieldType::Text)),
        "wstring" => Some(TypeExpression::Plain(FieldType::WideText)),
        "time" if old => Some(TypeExpression::Named(vec!["ros1/Time".to_owned()])),
        "duration" if old => Some(TypeExpression::Named(vec!["ros1/Duration".to_owned()])),
        "time" => Some(TypeExpression::Named(vec!["builtin_interfaces/Time".to_owned()])),
        "duration" => Some(TypeExpression::Named(vec!["builtin_interfaces/Duration".to_owned()])),
        _ => {
            let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '/';
            if word.is_empty() || !word.chars().all(is_name) || bound.is_some() {
                return None;
            }
            let name = normalized_type_name(word);
            Some(TypeExpression::Named(match name.contains('/') {
                true => vec![name],
                // The header of ROS 1 is written without its package.
                false => vec![format!("{package}/{name}"), format!("std_msgs/{name}")],
            }))
        }
    }
}
