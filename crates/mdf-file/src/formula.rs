//! Reads and evaluates the formula of an algebraic conversion: numbers, `X`, `+ - * / ^ **`, parentheses and functions.

/// The deepest nesting of a formula.
const DEEPEST: usize = 64;
/// The longest formula [B].
const LONGEST: usize = 4096;

/// A formula, as operations on a stack.
#[derive(Clone, Debug)]
pub(crate) struct Formula(Vec<Operation>);

#[derive(Clone, Copy, Debug)]
enum Operation {
    Number(f64),
    X,
    Negative,
    One(One),
    Two(Two),
}

type One = fn(f64) -> f64;
type Two = fn(f64, f64) -> f64;

/// Functions of one number.
const ONE: [(&str, One); 17] = [
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
const TWO: [(&str, Two); 2] = [("pow", power), ("atan2", f64::atan2)];

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

impl Formula {
    /// Reads a formula, or says what is wrong with it.
    pub fn read(text: &str) -> Result<Self, String> {
        if text.len() > LONGEST {
            return Err(format!(
                "expected a formula of at most {LONGEST} bytes, found {}",
                text.len()
            ));
        }
        let mut reader = Reader { text, at: 0, depth: 0, found: Vec::new() };
        reader.sum()?;
        match reader.peek() {
            None => Ok(Self(reader.found)),
            Some(_) => Err(reader.wrong("an operator or the end")),
        }
    }

    /// Its value at X.
    pub fn value(&self, x: f64, stack: &mut Vec<f64>) -> f64 {
        stack.clear();
        for operation in &self.0 {
            let value = match operation {
                Operation::Number(number) => *number,
                Operation::X => x,
                Operation::Negative => -stack.pop().unwrap_or(f64::NAN),
                Operation::One(function) => function(stack.pop().unwrap_or(f64::NAN)),
                Operation::Two(function) => {
                    let second = stack.pop().unwrap_or(f64::NAN);
                    function(stack.pop().unwrap_or(f64::NAN), second)
                }
            };
            stack.push(value);
        }
        stack.pop().unwrap_or(f64::NAN)
    }
}

struct Reader<'t> {
    text: &'t str,
    at: usize,
    depth: usize,
    found: Vec<Operation>,
}

impl Reader<'_> {
    fn rest(&self) -> &str {
        &self.text[self.at..]
    }

    fn peek(&mut self) -> Option<char> {
        self.at = self.text.len() - self.rest().trim_start().len();
        self.rest().chars().next()
    }

    fn take(&mut self, word: &str) -> bool {
        let there = self.peek().is_some() && self.rest().starts_with(word);
        if there {
            self.at += word.len();
        }
        there
    }

    fn wrong(&mut self, expected: &str) -> String {
        let found = self.peek().map_or("the end".to_owned(), |it| format!("`{it}`"));
        format!("expected {expected} at character {} of the formula, found {found}", self.at + 1)
    }

    /// Goes deeper, but not too deep.
    fn within(&mut self, read: fn(&mut Self) -> Result<(), String>) -> Result<(), String> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(format!("expected at most {DEEPEST} levels of a formula, found more"));
        }
        read(self)?;
        self.depth -= 1;
        Ok(())
    }

    fn sum(&mut self) -> Result<(), String> {
        self.product()?;
        loop {
            let function: Two = match () {
                () if self.take("+") => |a, b| a + b,
                () if self.take("-") => |a, b| a - b,
                () => return Ok(()),
            };
            self.product()?;
            self.found.push(Operation::Two(function));
        }
    }

    fn product(&mut self) -> Result<(), String> {
        self.signed()?;
        loop {
            let function: Two = match () {
                () if !self.rest().trim_start().starts_with("**") && self.take("*") => |a, b| a * b,
                () if self.take("/") => |a, b| a / b,
                () => return Ok(()),
            };
            self.signed()?;
            self.found.push(Operation::Two(function));
        }
    }

    /// A sign binds less than a power: -X^2 is -(X^2).
    fn signed(&mut self) -> Result<(), String> {
        if self.take("-") {
            self.within(Self::signed)?;
            self.found.push(Operation::Negative);
            return Ok(());
        }
        if self.take("+") {
            return self.within(Self::signed);
        }
        self.atom()?;
        if self.take("**") || self.take("^") {
            self.within(Self::signed)?;
            self.found.push(Operation::Two(power));
        }
        Ok(())
    }

    fn atom(&mut self) -> Result<(), String> {
        if self.take("(") {
            self.within(Self::sum)?;
            return if self.take(")") { Ok(()) } else { Err(self.wrong("`)`")) };
        }
        match self.peek() {
            Some('0'..='9' | '.') => self.number(),
            Some('a'..='z' | 'A'..='Z') => self.word(),
            _ => Err(self.wrong("a number, X, a function or `(`")),
        }
    }

    fn number(&mut self) -> Result<(), String> {
        let digits = |text: &str| {
            text.len() - text.trim_start_matches(|it: char| it.is_ascii_digit() || it == '.').len()
        };
        let mut length = digits(self.rest());
        if let Some(exponent) = self.rest()[length..].strip_prefix(['e', 'E']) {
            let sign = usize::from(exponent.starts_with(['+', '-']));
            let figures = digits(&exponent[sign..]);
            length += if figures > 0 { 1 + sign + figures } else { 0 };
        }
        let number = self.rest()[..length].parse().map_err(|_| self.wrong("a number"))?;
        self.at += length;
        self.found.push(Operation::Number(number));
        Ok(())
    }

    fn word(&mut self) -> Result<(), String> {
        let rest = self.rest();
        let length =
            rest.len() - rest.trim_start_matches(|it: char| it.is_ascii_alphanumeric()).len();
        let word = rest[..length].to_ascii_lowercase();
        let named = |name: &&str| **name == *word;
        let one = ONE.iter().find(|it| named(&it.0)).map(|it| it.1);
        let two = TWO.iter().find(|it| named(&it.0)).map(|it| it.1);
        let operation = match (word.as_str(), one, two) {
            ("x" | "x1", ..) => Operation::X,
            ("pi", ..) => Operation::Number(std::f64::consts::PI),
            (_, Some(function), _) => Operation::One(function),
            (_, _, Some(function)) => Operation::Two(function),
            // Of the logarithm some tools mean the natural one, others that of base 10.
            _ => return Err(self.wrong("X or a function such as sin, exp, ln, log10, sqrt, pow")),
        };
        self.at += length;
        if matches!(operation, Operation::One(_) | Operation::Two(_)) {
            if !self.take("(") {
                return Err(self.wrong("`(`"));
            }
            self.within(Self::sum)?;
            if matches!(operation, Operation::Two(_)) {
                if !self.take(",") {
                    return Err(self.wrong("`,`"));
                }
                self.within(Self::sum)?;
            }
            if !self.take(")") {
                return Err(self.wrong("`)`"));
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
        Formula::read(text).expect("a formula").value(x, &mut Vec::new())
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
        let error = |text: &str| Formula::read(text).expect_err("no formula");
        assert!(error("X +").contains("character 4"), "{}", error("X +"));
        assert!(error("log(X)").contains("ln, log10"));
        assert!(error("X ? 1 : 2").contains("an operator"));
        assert!(error(&"(".repeat(100)).contains("levels"));
        assert!(error("X 2").contains("an operator"));
        assert!(error("1.2.3").contains("a number"));
    }
}
