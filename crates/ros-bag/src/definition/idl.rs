//! Reads definitions in IDL, as far as ROS 2 uses it: modules, structures, enumerations, constants, names of types.

use std::collections::HashMap;

use super::tokens::{IdlToken, tokenize_idl};
use super::{FieldType, ScalarType, TypeDeclaration, TypeDeclarations, TypeExpression, normalized_type_name};

/// Modules in modules, and types in types, are read down to this depth.
const DEEPEST: usize = 32;

/// Reads all declarations of a text.
///
/// # Errors
/// With the line that cannot be read.
pub fn parse_idl_declarations(text: &str, declared: &mut TypeDeclarations) -> Result<(), String> {
    let tokens = tokenize_idl(text)?;
    let mut reader =
        IdlParser { tokens: &tokens, at: 0, scope: Vec::new(), constants: HashMap::new(), declared };
    while reader.at < tokens.len() {
        reader.parse_declaration()?;
    }
    Ok(())
}

struct IdlParser<'t> {
    tokens: &'t [(IdlToken, usize)],
    at: usize,
    /// The modules around what is read.
    scope: Vec<String>,
    /// Integers by their names, behind their modules.
    constants: HashMap<String, usize>,
    declared: &'t mut TypeDeclarations,
}

impl IdlParser<'_> {
    fn peek(&self) -> Option<&IdlToken> {
        self.tokens.get(self.at).map(|(token, _)| token)
    }

    fn is_next_sign(&self, sign: char) -> bool {
        self.peek() == Some(&IdlToken::Sign(sign))
    }

    /// Takes the sign if it is there.
    fn accept_sign(&mut self, sign: char) -> bool {
        let is = self.is_next_sign(sign);
        self.at += usize::from(is);
        is
    }

    fn accept_word(&mut self, word: &str) -> bool {
        let is = matches!(self.peek(), Some(IdlToken::Word(found)) if found == word);
        self.at += usize::from(is);
        is
    }

    fn unexpected_token_error(&self, expected: &str) -> String {
        let last = self.tokens.len().saturating_sub(1);
        match self.tokens.get(self.at.min(last)) {
            None => format!("expected {expected}, found nothing"),
            Some((_, line)) if self.at > last => {
                format!("expected {expected} behind line {line}, found the end")
            }
            Some((token, line)) => {
                let found = match token {
                    IdlToken::Word(text) | IdlToken::Number(text) => text.clone(),
                    IdlToken::Text => "a text".to_owned(),
                    IdlToken::Sign(sign) => sign.to_string(),
                };
                format!("expected {expected} in line {line}, found `{found}`")
            }
        }
    }

    fn expect_sign(&mut self, sign: char) -> Result<(), String> {
        match self.accept_sign(sign) {
            true => Ok(()),
            false => Err(self.unexpected_token_error(&format!("`{sign}`"))),
        }
    }

    fn expect_word(&mut self, expected: &str) -> Result<String, String> {
        match self.peek() {
            Some(IdlToken::Word(word)) => {
                let word = word.clone();
                self.at += 1;
                Ok(word)
            }
            _ => Err(self.unexpected_token_error(expected)),
        }
    }

    /// A name behind the modules around it.
    fn qualified_name(&self, name: &str) -> String {
        let parts = self.scope.iter().map(String::as_str).chain([name]);
        normalized_type_name(&parts.collect::<Vec<_>>().join("/"))
    }

    /// What a name can mean: the innermost module first.
    fn candidate_names(&self, name: &str) -> Vec<String> {
        if let Some(absolute) = name.strip_prefix("::") {
            return vec![normalized_type_name(absolute)];
        }
        let modules = (0..=self.scope.len()).rev().map(|depth| &self.scope[..depth]);
        let meaning =
            |modules: &[String]| normalized_type_name(&[modules, &[name.to_owned()]].concat().join("/"));
        modules.map(meaning).collect()
    }

    fn parse_declaration(&mut self) -> Result<(), String> {
        let word = self.expect_word("a module, a structure or a type")?;
        match word.as_str() {
            "module" => {
                if self.scope.len() >= DEEPEST {
                    return Err(self.unexpected_token_error("no more modules in modules"));
                }
                let name = self.expect_word("the name of a module")?;
                self.scope.push(name);
                self.expect_sign('{')?;
                while !self.is_next_sign('}') {
                    self.parse_declaration()?;
                }
                self.scope.pop();
                self.expect_sign('}')?;
            }
            "struct" => self.parse_structure()?,
            "const" => self.parse_constant()?,
            "enum" => self.parse_enumeration()?,
            "typedef" => {
                let kind = self.parse_type(0)?;
                for (name, kind) in self.parse_declarators(&kind)? {
                    let name = self.qualified_name(&name);
                    self.declared.insert(name, TypeDeclaration::Alias(kind));
                }
            }
            other => return Err(format!("`{other}` cannot be read here")),
        }
        match self.accept_sign(';') || word == "module" {
            true => Ok(()),
            false => Err(self.unexpected_token_error("`;`")),
        }
    }

    fn parse_structure(&mut self) -> Result<(), String> {
        let name = self.expect_word("the name of a structure")?;
        let name = self.qualified_name(&name);
        if self.is_next_sign(':') {
            return Err(format!("`{name}` extends another structure, which cannot be read here"));
        }
        self.expect_sign('{')?;
        let mut fields = Vec::new();
        while !self.accept_sign('}') {
            let kind = self.parse_type(0)?;
            fields.extend(self.parse_declarators(&kind)?);
            self.expect_sign(';')?;
        }
        self.declared.insert(name, TypeDeclaration::Struct(fields));
        Ok(())
    }

    fn parse_constant(&mut self) -> Result<(), String> {
        self.parse_type(0)?;
        let name = self.expect_word("the name of a constant")?;
        let name = self.qualified_name(&name);
        self.expect_sign('=')?;
        let begin = self.at;
        let number = self.parse_size();
        match number {
            Ok(number) if self.is_next_sign(';') => drop(self.constants.insert(name, number)),
            // A text, a broken or a calculated number is no size.
            _ => self.at = begin,
        }
        while self.at < self.tokens.len() && !self.is_next_sign(';') {
            self.at += 1;
        }
        Ok(())
    }

    fn parse_enumeration(&mut self) -> Result<(), String> {
        let name = self.expect_word("the name of an enumeration")?;
        let name = self.qualified_name(&name);
        self.expect_sign('{')?;
        while !self.accept_sign('}') {
            self.expect_word("the name of a value")?;
            self.accept_sign(',');
        }
        let number =
            TypeExpression::Plain(FieldType::Scalar(ScalarType::Integer { bytes: 4, signed: false }));
        self.declared.insert(name, TypeDeclaration::Alias(number));
        Ok(())
    }

    /// The names behind a type, each with the sizes of an array.
    fn parse_declarators(&mut self, kind: &TypeExpression) -> Result<Vec<(String, TypeExpression)>, String> {
        let mut all = Vec::new();
        loop {
            let name = self.expect_word("a name")?;
            let mut sizes = Vec::new();
            while self.accept_sign('[') {
                sizes.push(self.parse_size()?);
                self.expect_sign(']')?;
            }
            if sizes.len() > DEEPEST {
                return Err(self.unexpected_token_error("an array of fewer dimensions"));
            }
            let kind = sizes
                .into_iter()
                .rev()
                .fold(kind.clone(), |kind, size| TypeExpression::Array(Box::new(kind), size));
            all.push((name, kind));
            if !self.accept_sign(',') {
                return Ok(all);
            }
        }
    }

    /// A size: a number, or the name of one.
    fn parse_size(&mut self) -> Result<usize, String> {
        let wrong = self.unexpected_token_error("a number");
        let found = match self.peek() {
            Some(IdlToken::Number(number)) => match number.strip_prefix("0x") {
                Some(hex) => usize::from_str_radix(hex, 16).ok(),
                None => number.parse().ok(),
            },
            Some(IdlToken::Word(name)) => {
                self.candidate_names(name).iter().find_map(|it| self.constants.get(it)).copied()
            }
            _ => None,
        };
        self.at += 1;
        found.ok_or(wrong)
    }

    /// Skips a bound, which changes nothing in a message.
    fn skip_bound(&mut self) -> Result<(), String> {
        if self.accept_sign('<') {
            self.parse_size()?;
            self.expect_sign('>')?;
        }
        Ok(())
    }

    fn parse_type(&mut self, depth: usize) -> Result<TypeExpression, String> {
        if depth > DEEPEST {
            return Err(self.unexpected_token_error("no more types in types"));
        }
        let integer = |bytes, signed| scalar_expression(ScalarType::Integer { bytes, signed });
        let word = self.expect_word("a type")?;
        Ok(match word.as_str() {
            "boolean" => scalar_expression(ScalarType::Bool),
            "octet" | "uint8" | "char" => integer(1, false),
            "int8" => integer(1, true),
            "int16" | "short" => integer(2, true),
            "uint16" => integer(2, false),
            "int32" => integer(4, true),
            "uint32" => integer(4, false),
            "int64" => integer(8, true),
            "uint64" => integer(8, false),
            "float" => scalar_expression(ScalarType::Single),
            "double" => scalar_expression(ScalarType::Double),
            "long" if self.accept_word("double") => scalar_expression(ScalarType::Quadruple),
            "long" => integer(if self.accept_word("long") { 8 } else { 4 }, true),
            "unsigned" if self.accept_word("short") => integer(2, false),
            "unsigned" if self.accept_word("long") => {
                integer(if self.accept_word("long") { 8 } else { 4 }, false)
            }
            "string" | "wstring" => {
                self.skip_bound()?;
                TypeExpression::Plain(if word == "string" { FieldType::Text } else { FieldType::WideText })
            }
            "sequence" => {
                self.expect_sign('<')?;
                let inner = self.parse_type(depth + 1)?;
                if self.accept_sign(',') {
                    self.parse_size()?;
                }
                self.expect_sign('>')?;
                TypeExpression::Sequence(Box::new(inner))
            }
            "wchar" | "unsigned" | "fixed" | "any" | "map" | "bitset" | "union" => {
                return Err(format!("the type `{word}` cannot be read here"));
            }
            name => TypeExpression::Named(self.candidate_names(name)),
        })
    }
}

fn scalar_expression(scalar: ScalarType) -> TypeExpression {
    TypeExpression::Plain(FieldType::Scalar(scalar))
}
