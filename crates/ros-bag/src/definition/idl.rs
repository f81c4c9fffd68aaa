//! Reads definitions in IDL, as far as ROS 2 uses it: modules, structures, enumerations, constants, names of types.

use std::collections::HashMap;

use super::tokens::{Token, tokens};
use super::{Declaration, Declarations, Scalar, Type, TypeExpression, normal};

/// Modules in modules, and types in types, are read down to this depth.
const DEEPEST: usize = 32;

/// Reads all declarations of a text.
///
/// # Errors
/// With the line that cannot be read.
pub fn read(text: &str, declared: &mut Declarations) -> Result<(), String> {
    let tokens = tokens(text)?;
    let mut reader =
        Reader { tokens: &tokens, at: 0, scope: Vec::new(), constants: HashMap::new(), declared };
    while reader.at < tokens.len() {
        reader.declaration()?;
    }
    Ok(())
}

struct Reader<'t> {
    tokens: &'t [(Token, usize)],
    at: usize,
    /// The modules around what is read.
    scope: Vec<String>,
    /// Integers by their names, behind their modules.
    constants: HashMap<String, usize>,
    declared: &'t mut Declarations,
}

impl Reader<'_> {
    fn peek(&self) -> Option<&Token> {
        self.tokens.get(self.at).map(|(token, _)| token)
    }

    fn is(&self, sign: char) -> bool {
        self.peek() == Some(&Token::Sign(sign))
    }

    /// Takes the sign if it is there.
    fn takes(&mut self, sign: char) -> bool {
        let is = self.is(sign);
        self.at += usize::from(is);
        is
    }

    fn takes_word(&mut self, word: &str) -> bool {
        let is = matches!(self.peek(), Some(Token::Word(found)) if found == word);
        self.at += usize::from(is);
        is
    }

    fn wrong(&self, expected: &str) -> String {
        let last = self.tokens.len().saturating_sub(1);
        match self.tokens.get(self.at.min(last)) {
            None => format!("expected {expected}, found nothing"),
            Some((_, line)) if self.at > last => {
                format!("expected {expected} behind line {line}, found the end")
            }
            Some((token, line)) => {
                let found = match token {
                    Token::Word(text) | Token::Number(text) => text.clone(),
                    Token::Text => "a text".to_owned(),
                    Token::Sign(sign) => sign.to_string(),
                };
                format!("expected {expected} in line {line}, found `{found}`")
            }
        }
    }

    fn sign(&mut self, sign: char) -> Result<(), String> {
        match self.takes(sign) {
            true => Ok(()),
            false => Err(self.wrong(&format!("`{sign}`"))),
        }
    }

    fn word(&mut self, expected: &str) -> Result<String, String> {
        match self.peek() {
            Some(Token::Word(word)) => {
                let word = word.clone();
                self.at += 1;
                Ok(word)
            }
            _ => Err(self.wrong(expected)),
        }
    }

    /// A name behind the modules around it.
    fn full(&self, name: &str) -> String {
        let parts = self.scope.iter().map(String::as_str).chain([name]);
        normal(&parts.collect::<Vec<_>>().join("/"))
    }

    /// What a name can mean: the innermost module first.
    fn meanings(&self, name: &str) -> Vec<String> {
        if let Some(absolute) = name.strip_prefix("::") {
            return vec![normal(absolute)];
        }
        let modules = (0..=self.scope.len()).rev().map(|depth| &self.scope[..depth]);
        let meaning =
            |modules: &[String]| normal(&[modules, &[name.to_owned()]].concat().join("/"));
        modules.map(meaning).collect()
    }

    fn declaration(&mut self) -> Result<(), String> {
        let word = self.word("a module, a structure or a type")?;
        match word.as_str() {
            "module" => {
                if self.scope.len() >= DEEPEST {
                    return Err(self.wrong("no more modules in modules"));
                }
                let name = self.word("the name of a module")?;
                self.scope.push(name);
                self.sign('{')?;
                while !self.is('}') {
                    self.declaration()?;
                }
                self.scope.pop();
                self.sign('}')?;
            }
            "struct" => self.structure()?,
            "const" => self.constant()?,
            "enum" => self.enumeration()?,
            "typedef" => {
                let kind = self.kind(0)?;
                for (name, kind) in self.declarators(&kind)? {
                    let name = self.full(&name);
                    self.declared.insert(name, Declaration::Alias(kind));
                }
            }
            other => return Err(format!("`{other}` cannot be read here")),
        }
        match self.takes(';') || word == "module" {
            true => Ok(()),
            false => Err(self.wrong("`;`")),
        }
    }

    fn structure(&mut self) -> Result<(), String> {
        let name = self.word("the name of a structure")?;
        let name = self.full(&name);
        if self.is(':') {
            return Err(format!("`{name}` extends another structure, which cannot be read here"));
        }
        self.sign('{')?;
        let mut fields = Vec::new();
        while !self.takes('}') {
            let kind = self.kind(0)?;
            fields.extend(self.declarators(&kind)?);
            self.sign(';')?;
        }
        self.declared.insert(name, Declaration::Struct(fields));
        Ok(())
    }

    fn constant(&mut self) -> Result<(), String> {
        self.kind(0)?;
        let name = self.word("the name of a constant")?;
        let name = self.full(&name);
        self.sign('=')?;
        let begin = self.at;
        let number = self.number();
        match number {
            Ok(number) if self.is(';') => drop(self.constants.insert(name, number)),
            // A text, a broken or a calculated number is no size.
            _ => self.at = begin,
        }
        while self.at < self.tokens.len() && !self.is(';') {
            self.at += 1;
        }
        Ok(())
    }

    fn enumeration(&mut self) -> Result<(), String> {
        let name = self.word("the name of an enumeration")?;
        let name = self.full(&name);
        self.sign('{')?;
        while !self.takes('}') {
            self.word("the name of a value")?;
            self.takes(',');
        }
        let number =
            TypeExpression::Plain(Type::Scalar(Scalar::Integer { bytes: 4, signed: false }));
        self.declared.insert(name, Declaration::Alias(number));
        Ok(())
    }

    /// The names behind a type, each with the sizes of an array.
    fn declarators(
        &mut self,
        kind: &TypeExpression,
    ) -> Result<Vec<(String, TypeExpression)>, String> {
        let mut all = Vec::new();
        loop {
            let name = self.word("a name")?;
            let mut sizes = Vec::new();
            while self.takes('[') {
                sizes.push(self.number()?);
                self.sign(']')?;
            }
            if sizes.len() > DEEPEST {
                return Err(self.wrong("an array of fewer dimensions"));
            }
            let kind = sizes
                .into_iter()
                .rev()
                .fold(kind.clone(), |kind, size| TypeExpression::Array(Box::new(kind), size));
            all.push((name, kind));
            if !self.takes(',') {
                return Ok(all);
            }
        }
    }

    /// A size: a number, or the name of one.
    fn number(&mut self) -> Result<usize, String> {
        let wrong = self.wrong("a number");
        let found = match self.peek() {
            Some(Token::Number(number)) => match number.strip_prefix("0x") {
                Some(hex) => usize::from_str_radix(hex, 16).ok(),
                None => number.parse().ok(),
            },
            Some(Token::Word(name)) => {
                self.meanings(name).iter().find_map(|it| self.constants.get(it)).copied()
            }
            _ => None,
        };
        self.at += 1;
        found.ok_or(wrong)
    }

    /// Skips a bound, which changes nothing in a message.
    fn bound(&mut self) -> Result<(), String> {
        if self.takes('<') {
            self.number()?;
            self.sign('>')?;
        }
        Ok(())
    }

    fn kind(&mut self, depth: usize) -> Result<TypeExpression, String> {
        if depth > DEEPEST {
            return Err(self.wrong("no more types in types"));
        }
        let integer = |bytes, signed| scalar(Scalar::Integer { bytes, signed });
        let word = self.word("a type")?;
        Ok(match word.as_str() {
            "boolean" => scalar(Scalar::Bool),
            "octet" | "uint8" | "char" => integer(1, false),
            "int8" => integer(1, true),
            "int16" | "short" => integer(2, true),
            "uint16" => integer(2, false),
            "int32" => integer(4, true),
            "uint32" => integer(4, false),
            "int64" => integer(8, true),
            "uint64" => integer(8, false),
            "float" => scalar(Scalar::Single),
            "double" => scalar(Scalar::Double),
            "long" if self.takes_word("double") => scalar(Scalar::Quadruple),
            "long" => integer(if self.takes_word("long") { 8 } else { 4 }, true),
            "unsigned" if self.takes_word("short") => integer(2, false),
            "unsigned" if self.takes_word("long") => {
                integer(if self.takes_word("long") { 8 } else { 4 }, false)
            }
            "string" | "wstring" => {
                self.bound()?;
                TypeExpression::Plain(if word == "string" { Type::Text } else { Type::WideText })
            }
            "sequence" => {
                self.sign('<')?;
                let inner = self.kind(depth + 1)?;
                if self.takes(',') {
                    self.number()?;
                }
                self.sign('>')?;
                TypeExpression::Sequence(Box::new(inner))
            }
            "wchar" | "unsigned" | "fixed" | "any" | "map" | "bitset" | "union" => {
                return Err(format!("the type `{word}` cannot be read here"));
            }
            name => TypeExpression::Named(self.meanings(name)),
        })
    }
}

fn scalar(scalar: Scalar) -> TypeExpression {
    TypeExpression::Plain(Type::Scalar(scalar))
}
