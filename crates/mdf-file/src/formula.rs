//! Reads and evaluates the formula of an algebraic conversion: numbers, `X`, `+ - * / ^ **`, parentheses and functions.

/// The deepest nesting of a formula.
const DEEPEST: usize = 64;
/// The longest formula [B].
const LONGEST: usize = 4096;

/// A formula, as operations on a stack.
#[derive(Clone, Debug)]
pub(crate) struct ConversionFormula(Vec<StackOperation>);

#[derive(Clone, Copy, Debug)]
enum StackOperation {
    Number(f64),
    X,
    Negative,
    One(UnaryFunction),
    Two(BinaryFunction),
}

type UnaryFunction = fn(f64) -> f64;
type BinaryFunction = fn(f64, f64) -> f64;

/// Functions of one number.
const ONE: [(&str, UnaryFunction); 17] = [
    ("sin", f64::sin),
    ("cos", f64::cos),
    ("tan", f64::tan),
    ("asin", f64::asin),
    ("acos", f64::acos),
    ("atan", f64::atan),
    ("arcsin", f64::asin),
    ("arccos", f64::acos),
    ("arctan", f64::atan),
    ("sinh", f64::sinh),
    ("cosh", f64::cosh),
    ("tanh", f64::tanh),
    ("exp", f64::exp),
    ("ln", f64::ln),
    ("log10", f64::log10),
    ("sqrt", f64::sqrt),
    ("abs", f64::abs),
];

/// Functions of two numbers.
const TWO: [(&str, BinaryFunction); 2] = [("pow", power), ("atan2", f64::atan2)];

/// Small whole powers are products by repeated squaring, as `x * x` is more exact than a logarithm.
fn power(base: f64, exponent: f64) -> f64 {
    if exponent.fract() != 0.0 || !(1.0..=50.0).contains(&exponent) {
        return base.powf(exponent);
    }
    let (mut left, mut square, mut product) = (exponent as u32, base, None);
    while left > 0 {
        if left & 1 == 1 {
            product = Some(product.map_or(square, |it: f64| it * square));
        }
        left >>= 1;
        square *= square;
    }
    product.unwrap_or(1.0)
}

impl ConversionFormula {
    /// Reads a formula, or says what is wrong with it.
    pub fn parse(text: &str) -> Result<Self, String> {
        if text.len() > LONGEST {
            return Err(format!("expected a formula of at most {LONGEST} bytes, found {}", text.len()));
        }
        let mut reader = FormulaParser { text, at: 0, depth: 0, found: Vec::new() };
        reader.parse_sum()?;
        match reader.peek() {
            None => Ok(Self(reader.found)),
            Some(_) => Err(reader.unexpected_error("an operator or the end")),
        }
    }

    /// Its value at X.
    pub fn evaluate(&self, x: f64, stack: &mut Vec<f64>) -> f64 {
        stack.clear();
        for operation in &self.0 {
            let value = match operation {
                StackOperation::Number(number) => *number,
                StackOperation::X => x,
                StackOperation::Negative => -stack.pop().unwrap_or(f64::NAN),
                StackOperation::One(function) => function(stack.pop().unwrap_or(f64::NAN)),
                StackOperation::Two(function) => {
                    let second = stack.pop().unwrap_or(f64::NAN);
                    function(stack.pop().unwrap_or(f64::NAN), second)
                }
            };
            stack.push(value);
        }
        stack.pop().unwrap_or(f64::NAN)
    }
}

struct FormulaParser<'t> {
    text: &'t str,
    at: usize,
    depth: usize,
    found: Vec<StackOperation>,
}

impl FormulaParser<'_> {
    fn remaining_text(&self) -> &str {
        &self.text[self.at..]
    }

    fn peek(&mut self) -> Option<char> {
        self.at = self.text.len() - self.remaining_text().trim_start().len();
        self.remaining_text().chars().next()
    }

    fn accept_word(&mut self, word: &str) -> bool {
        let there = self.peek().is_some() && self.remaining_text().starts_with(word);
        if there {
            self.at += word.len();
        }
        there
    }

    fn unexpected_error(&mut self, expected: &str) -> String {
        let found = self.peek().map_or("the end".to_owned(), |it| format!("`{it}`"));
        format!("expected {expected} at character {} of the formula, found {found}", self.at + 1)
    }

    /// Goes deeper, but not too deep.
    fn parse_nested(&mut self, read: fn(&mut Self) -> Result<(), String>) -> Result<(), String> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(format!("expected at most {DEEPEST} levels of a formula, found more"));
        }
        read(self)?;
        self.depth -= 1;
        Ok(())
    }

    fn parse_sum(&mut self) -> Result<(), String> {
        self.parse_product()?;
        loop {
            let function: BinaryFunction = match () {
                () if self.accept_word("+") => |a, b| a + b,
                () if self.accept_word("-") => |a, b| a - b,
                () => return Ok(()),
            };
            self.parse_product()?;
            self.found.push(StackOperation::Two(function));
        }
    }

    fn parse_product(&mut self) -> Result<(), String> {
        self.parse_signed()?;
        loop {
            let function: BinaryFunction = match () {
                () if !self.remaining_text().trim_start().starts_with("**") && self.accept_word("*") => {
                    |a, b| a * b
                }
                () if self.accept_word("/") => |a, b| a / b,
                () => return Ok(()),
            };
            self.parse_signed()?;
            self.found.push(StackOperation::Two(function));
        }
    }

    /// A sign binds less than a power: -X^2 is -(X^2).
    fn parse_signed(&mut self) -> Result<(), String> {
        if self.accept_word("-") {
            self.parse_nested(Self::parse_signed)?;
            self.found.push(StackOperation::Negative);
            return Ok(());
        }
        if self.accept_word("+") {
            return self.parse_nested(Self::parse_signed);
        }
        self.parse_atom()?;
        if self.accept_word("**") || self.accept_word("^") {
            self.parse_nested(Self::parse_signed)?;
            self.found.push(StackOperation::Two(power));
        }
        Ok(())
    }

    fn parse_atom(&mut self) -> Result<(), String> {
        if self.accept_word("(") {
            self.parse_nested(Self::parse_sum)?;
            return if self.accept_word(")") { Ok(()) } else { Err(self.unexpected_error("`)`")) };
        }
        match self.peek() {
            Some('0'..='9' | '.') => self.parse_number(),
            Some('a'..='z' | 'A'..='Z') => self.parse_word(),
            _ => Err(self.unexpected_error("a number, X, a function or `(`")),
        }
    }

    fn parse_number(&mut self) -> Result<(), String> {
        let digits = |text: &str| {
            text.len() - text.trim_start_matches(|it: char| it.is_ascii_digit() || it == '.').len()
        };
        let mut length = digits(self.remaining_text());
        if let Some(exponent) = self.remaining_text()[length..].strip_prefix(['e', 'E']) {
            let sign = usize::from(exponent.starts_with(['+', '-']));
            let figures = digits(&exponent[sign..]);
            length += if figures > 0 { 1 + sign + figures } else { 0 };
        }
        let number =
            self.remaining_text()[..length].parse().map_err(|_| self.unexpected_error("a number"))?;
        self.at += length;
        self.found.push(StackOperation::Number(number));
        Ok(())
    }

    fn parse_word(&mut self) -> Result<(), String> {
        let rest = self.remaining_text();
        let length = rest.len() - rest.trim_start_matches(|it: char| it.is_ascii_alphanumeric()).len();
        let word = rest[..length].to_ascii_lowercase();
        let named = |name: &&str| **name == *word;
        let one = ONE.iter().find(|it| named(&it.0)).map(|it| it.1);
        let two = TWO.iter().find(|it| named(&it.0)).map(|it| it.1);
        let operation = match (word.as_str(), one, two) {
            ("x" | "x1", ..) => StackOperation::X,
            ("pi", ..) => StackOperation::Number(std::f64::consts::PI),
            (_, Some(function), _) => StackOperation::One(function),
            (_, _, Some(function)) => StackOperation::Two(function),
            // Of the logarithm some tools mean the natural one, others that of base 10.
            _ => {
                return Err(self.unexpected_error("X or a function such as sin, exp, ln, log10, sqrt, pow"));
            }
        };
        self.at += length;
        if matches!(operation, StackOperation::One(_) | StackOperation::Two(_)) {
            if !self.accept_word("(") {
                return Err(self.unexpected_error("`(`"));
            }
            self.parse_nested(Self::parse_sum)?;
            if matches!(operation, StackOperation::Two(_)) {
                if !self.accept_word(",") {
                    return Err(self.unexpected_error("`,`"));
                }
                self.parse_nested(Self::parse_sum)?;
            }
            if !self.accept_word(")") {
                return Err(self.unexpected_error("`)`"));
            }
        }
        self.found.push(operation);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(text: &str, x: f64) -> f64 {
        ConversionFormula::parse(text).expect("a formula").evaluate(x, &mut Vec::new())
    }

    #[test]
    fn formulas_have_the_usual_precedence() {
        assert_eq!(at("-X^2 + 3*(X1-1)/2", 3.0), -6.0);
        assert_eq!(at("2**3**2", 0.0), 512.0);
        assert_eq!(at("1e-3 * x", 2.0), 0.002);
        assert_eq!(at("pow(X, 2) - atan2(0, 1)", 3.0), 9.0);
        assert_eq!(at("sqrt(abs(-X))", 16.0), 4.0);
        assert_eq!(at("2^-1", 0.0), 0.5);
    }

    #[test]
    fn what_is_no_formula_is_refused_with_the_place() {
        let error = |text: &str| ConversionFormula::parse(text).expect_err("no formula");
        assert!(error("X +").contains("character 4"), "{}", error("X +"));
        assert!(error("log(X)").contains("ln, log10"));
        assert!(error("X ? 1 : 2").contains("an operator"));
        assert!(error(&"(".repeat(100)).contains("levels"));
        assert!(error("X 2").contains("an operator"));
        assert!(error("1.2.3").contains("a number"));
    }
}
