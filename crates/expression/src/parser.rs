//! Turns the text of a condition into an expression.

use std::f64::consts::PI;
use std::ops::Range;

use super::{
    Expression, Function, Junction, Node, Operand, Operator, ParseError, Reducer, Reduction,
    Relation, Text,
};

/// Words and symbols that one condition may have; it bounds the recursion for a hostile text.
const LONGEST: usize = 400;

/// Name, function, and fewest and most arguments.
const FUNCTIONS: &[(&str, Function, usize, usize)] = &[
    ("abs", Function::Abs, 1, 1),
    ("sqrt", Function::Sqrt, 1, 1),
    ("sin", Function::Sin, 1, 1),
    ("cos", Function::Cos, 1, 1),
    ("tan", Function::Tan, 1, 1),
    ("atan", Function::Atan, 1, 1),
    ("atan2", Function::Atan2, 2, 2),
    ("exp", Function::Exp, 1, 1),
    ("ln", Function::Ln, 1, 1),
    ("min", Function::Min, 2, LONGEST),
    ("max", Function::Max, 2, LONGEST),
    ("sign", Function::Sign, 1, 1),
    ("deg", Function::Deg, 1, 1),
    ("rad", Function::Rad, 1, 1),
    ("isfinite", Function::IsFinite, 1, 1),
    ("hypot", Function::Hypot, 2, 2),
];

/// The reductions of one argument.
const REDUCERS: &[(&str, Reducer)] = &[
    ("max", Reducer::Max),
    ("min", Reducer::Min),
    ("mean", Reducer::Mean),
    ("rms", Reducer::Rms),
    ("std", Reducer::Std),
    ("sum", Reducer::Sum),
    ("first", Reducer::First),
    ("last", Reducer::Last),
    ("count", Reducer::Count),
];

impl Expression {
    /// Reads a condition; `resolve` gives the column of a signal in the rows to come.
    ///
    /// # Errors
    /// When the text is malformed, a name is unknown, or signals and reductions are mixed.
    pub fn parse(
        text: &str,
        resolve: &mut dyn FnMut(&str) -> Option<Operand>,
    ) -> Result<Self, ParseError> {
        let tokens = tokens(text)?;
        if tokens.len() > LONGEST {
            let message = format!("expected at most {LONGEST} words and symbols in one condition");
            return Err(ParseError::new(tokens[LONGEST].1.clone(), message)
                .help("split it into several checks"));
        }
        let mut parser = Parser {
            text,
            tokens,
            next: 0,
            resolve,
            bare: Vec::new(),
            reductions: Vec::new(),
            reduced: Vec::new(),
        };
        let root = parser.number(0)?;
        if parser.peek() != Token::End {
            return Err(parser.expected("an operator or the end"));
        }
        if let (Some(bare), Some(reduced)) = (parser.bare.first(), parser.reduced.first()) {
            let (name, reduced) = (&text[bare.clone()], &text[reduced.clone()]);
            let message =
                format!("`{name}` is one value per sample, but `{reduced}` is one for the window");
            return Err(ParseError::new(bare.clone(), message).help(format!(
                "put `{name}` inside a reduction too, such as `max({name})`, or make two checks"
            )));
        }
        Ok(Self { root, reductions: parser.reductions })
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Token<'a> {
    Number(f64),
    Name(&'a str),
    /// A signal name between backticks.
    Quoted(&'a str),
    /// A text between quotes.
    Text(&'a str),
    Symbol(&'static str),
    End,
}

/// Every spelling of an operator and the one that the parser works with; longer ones first.
const SYMBOLS: &[(&str, &str)] = &[
    ("<=", "<="),
    (">=", ">="),
    ("==", "=="),
    ("!=", "!="),
    ("&&", "and"),
    ("||", "or"),
    ("<", "<"),
    (">", ">"),
    ("!", "not"),
    ("+", "+"),
    ("-", "-"),
    ("*", "*"),
    ("/", "/"),
    ("^", "^"),
    ("(", "("),
    (")", ")"),
    (",", ","),
];

fn tokens(text: &str) -> Result<Vec<(Token<'_>, Range<usize>)>, ParseError> {
    let mut tokens = Vec::new();
    let mut at = 0;
    loop {
        at += text[at..].len() - text[at..].trim_start().len();
        let rest = &text[at..];
        let Some(first) = rest.chars().next() else {
            tokens.push((Token::End, at..at));
            return Ok(tokens);
        };
        let (token, length) = if first.is_ascii_digit() || first == '.' {
            number(rest, at)?
        } else if first.is_alphabetic() || first == '_' {
            let length = name_length(rest);
            let keyword = ["and", "or", "not"].into_iter().find(|word| *word == &rest[..length]);
            (keyword.map_or(Token::Name(&rest[..length]), Token::Symbol), length)
        } else if first == '`' {
            let name = quoted(rest, at, "expected a closing backtick after the signal name")?;
            (Token::Quoted(name), name.len() + 2)
        } else if first == '\'' || first == '"' {
            let text = quoted(rest, at, "expected a closing quote after the text")?;
            (Token::Text(text), text.len() + 2)
        } else {
            symbol(rest, first, at)?
        };
        tokens.push((token, at..at + length));
        at += length;
    }
}

/// What stands between the first letter of `rest`, a quote, and the next one like it.
fn quoted<'a>(rest: &'a str, at: usize, missing: &str) -> Result<&'a str, ParseError> {
    let (quote, inside) = rest.split_at(1);
    let end = inside.find(quote).ok_or_else(|| ParseError::new(at..at + rest.len(), missing))?;
    Ok(&inside[..end])
}

fn symbol(rest: &str, first: char, at: usize) -> Result<(Token<'_>, usize), ParseError> {
    let found = SYMBOLS.iter().find(|(spelling, _)| rest.starts_with(spelling));
    if let Some((spelling, symbol)) = found {
        return Ok((Token::Symbol(symbol), spelling.len()));
    }
    let message = format!("expected a number, a name or an operator, found `{first}`");
    let error = ParseError::new(at..at + first.len_utf8(), message);
    Err(match first {
        '=' => error.help("`==` compares for equality"),
        '&' => error.help("write `and` or `&&`"),
        '|' => error.help("write `or` or `||`"),
        _ => error.help("write a signal name with other characters between backticks"),
    })
}

fn number(rest: &str, at: usize) -> Result<(Token<'_>, usize), ParseError> {
    let digits = |from: usize| {
        let tail = &rest[from..];
        from + tail.len() - tail.trim_start_matches(|c: char| c.is_ascii_digit()).len()
    };
    let mut length = digits(0);
    if rest[length..].starts_with('.') {
        length = digits(length + 1);
    }
    if rest[length..].starts_with(['e', 'E']) {
        let sign = usize::from(rest[length + 1..].starts_with(['+', '-']));
        let end = digits(length + 1 + sign);
        if end > length + 1 + sign {
            length = end;
        }
    }
    match rest[..length].parse::<f64>() {
        Ok(value) if value.is_finite() => Ok((Token::Number(value), length)),
        _ => Err(ParseError::new(
            at..at + length,
            format!("expected a finite number, found `{}`", &rest[..length]),
        )),
    }
}

/// The bytes of the FMI structured name at the beginning of `text`: identifiers joined by dots,
/// each with optional indices `[1,2]`, and `der(...)` after a dot.
fn name_length(text: &str) -> usize {
    let mut at = 0;
    loop {
        let segment = at;
        let tail = &text[at..];
        at += tail.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(tail.len());
        let derivative = segment > 0 && &text[segment..at] == "der";
        if derivative && text[at..].starts_with('(') {
            let mut depth = 0;
            let closing = text[at..].find(|c| {
                depth += i32::from(c == '(') - i32::from(c == ')');
                depth == 0
            });
            return closing.map_or(at, |closing| at + closing + 1);
        }
        if text[at..].starts_with('[') {
            let Some(closing) = text[at..].find(']') else {
                return at;
            };
            at += closing + 1;
        }
        let mut tail = text[at..].chars();
        if tail.next() != Some('.') || !tail.next().is_some_and(|c| c.is_alphabetic() || c == '_') {
            return at;
        }
        at += 1;
    }
}

/// How tightly a binary operator holds its operands together.
fn strength(symbol: &str) -> Option<u8> {
    Some(match symbol {
        "or" => 1,
        "and" => 2,
        "<" | "<=" | ">" | ">=" | "==" | "!=" => COMPARISON,
        "+" | "-" => 4,
        "*" | "/" => 5,
        "^" => POWER,
        _ => return None,
    })
}

const COMPARISON: u8 = 3;
const POWER: u8 = 6;

fn combine(symbol: &str, left: Node, right: Node) -> Node {
    let sides = Box::new([left, right]);
    match symbol {
        "or" => Node::Join(Junction::Or, sides),
        "and" => Node::Join(Junction::And, sides),
        "<" => Node::Compare(Relation::Less, sides),
        "<=" => Node::Compare(Relation::LessOrEqual, sides),
        ">" => Node::Compare(Relation::Greater, sides),
        ">=" => Node::Compare(Relation::GreaterOrEqual, sides),
        "==" => Node::Compare(Relation::Equal, sides),
        "!=" => Node::Compare(Relation::NotEqual, sides),
        "+" => Node::Arithmetic(Operator::Add, sides),
        "-" => Node::Arithmetic(Operator::Subtract, sides),
        "*" => Node::Arithmetic(Operator::Multiply, sides),
        "/" => Node::Arithmetic(Operator::Divide, sides),
        _ => Node::Arithmetic(Operator::Power, sides),
    }
}

struct Parser<'a> {
    text: &'a str,
    tokens: Vec<(Token<'a>, Range<usize>)>,
    next: usize,
    resolve: &'a mut dyn FnMut(&str) -> Option<Operand>,
    /// Where signals and `time` stand outside every reduction.
    bare: Vec<Range<usize>>,
    reductions: Vec<Reduction>,
    /// Where each reduction stands.
    reduced: Vec<Range<usize>>,
}

impl<'a> Parser<'a> {
    fn peek(&self) -> Token<'a> {
        self.tokens[self.next].0
    }

    fn span(&self) -> Range<usize> {
        self.tokens[self.next].1.clone()
    }

    fn skip(&mut self, symbol: &str) -> bool {
        let found = matches!(self.peek(), Token::Symbol(s) if s == symbol);
        self.next += usize::from(found);
        found
    }

    fn expected(&self, expected: &str) -> ParseError {
        let found = match self.peek() {
            Token::End => "the end".to_owned(),
            _ => format!("`{}`", &self.text[self.span()]),
        };
        ParseError::new(self.span(), format!("expected {expected}, found {found}"))
    }

    /// An expression that is no text.
    fn number(&mut self, least: u8) -> Result<Node, ParseError> {
        let start = self.span().start;
        let node = self.expression(least)?;
        self.refuse_text(start, &node)?;
        Ok(node)
    }

    /// Refuses a text that began at `start` and was just parsed.
    fn refuse_text(&self, start: usize, node: &Node) -> Result<(), ParseError> {
        let Node::Text(_) = node else { return Ok(()) };
        let span = start..self.tokens[self.next - 1].1.end;
        let message = format!("`{}` is a text, not a number", &self.text[span.clone()]);
        let help = format!("compare it with another text: `{} == 'on'`", &self.text[span.clone()]);
        Err(ParseError::new(span, message).help(help))
    }

    /// The comparison that began at `start` and was just parsed, of two numbers or two texts.
    fn compare(
        &self,
        symbol: &str,
        start: usize,
        left: Node,
        right: Node,
    ) -> Result<Node, ParseError> {
        let error = |what| ParseError::new(start..self.tokens[self.next - 1].1.end, what);
        match (symbol, left, right) {
            ("==" | "!=", Node::Text(a), Node::Text(b)) => Ok(Node::Same(symbol == "==", [a, b])),
            (_, Node::Text(_), Node::Text(_)) => {
                Err(error("texts are compared by `==` and `!=` only"))
            }
            (_, Node::Text(_), _) | (_, _, Node::Text(_)) => {
                Err(error("this compares a text with a number")
                    .help("what stands in quotes is a text, also '1'"))
            }
            (_, left, right) => Ok(combine(symbol, left, right)),
        }
    }

    fn expression(&mut self, least: u8) -> Result<Node, ParseError> {
        let start = self.span().start;
        let mut left = self.prefix()?;
        let mut compared = false;
        while let Token::Symbol(symbol) = self.peek() {
            let Some(strength) = strength(symbol).filter(|strength| *strength >= least) else {
                break;
            };
            if compared && strength == COMPARISON {
                return Err(self
                    .expected("one comparison at a time")
                    .help("write `a < b and b < c` for a range"));
            }
            compared = strength == COMPARISON;
            if !compared {
                self.refuse_text(start, &left)?;
            }
            self.next += 1;
            // A power groups from the right: 2^3^2 is 2^(3^2).
            let least = strength + u8::from(strength != POWER);
            left = match compared {
                true => {
                    let right = self.expression(least)?;
                    self.compare(symbol, start, left, right)?
                }
                false => combine(symbol, left, self.number(least)?),
            };
        }
        Ok(left)
    }

    fn prefix(&mut self) -> Result<Node, ParseError> {
        if self.skip("not") {
            Ok(Node::Not(Box::new(self.number(COMPARISON)?)))
        } else if self.skip("-") {
            // -a^2 is -(a^2), as in mathematics.
            Ok(Node::Negate(Box::new(self.number(POWER)?)))
        } else {
            self.operand()
        }
    }

    fn operand(&mut self) -> Result<Node, ParseError> {
        let (token, span) = self.tokens[self.next].clone();
        let node = match token {
            Token::Number(number) => Node::Number(number),
            Token::Text(text) => Node::Text(Text::Literal(text.to_owned())),
            Token::Name("pi") => Node::Number(PI),
            Token::Name("time") => {
                self.bare.push(span);
                Node::Time
            }
            Token::Name(name) => {
                self.next += 1;
                if self.skip("(") {
                    return self.call(name, &span);
                }
                return self.signal(name, span);
            }
            Token::Quoted(name) => {
                self.next += 1;
                return self.signal(name, span);
            }
            Token::Symbol("(") => {
                self.next += 1;
                let inner = self.expression(0)?;
                if self.peek() != Token::Symbol(")") {
                    return Err(self.expected("an operator or `)`"));
                }
                inner
            }
            _ => return Err(self.expected("a number, a signal, a function or `(`")),
        };
        self.next += 1;
        Ok(node)
    }

    fn signal(&mut self, name: &str, span: Range<usize>) -> Result<Node, ParseError> {
        if let Some(operand) = (self.resolve)(name) {
            self.bare.push(span);
            return Ok(match operand {
                Operand::Number(column) => Node::Signal(column),
                Operand::Text(column) => Node::Text(Text::Signal(column)),
            });
        }
        let mut error = ParseError::new(span, format!("unknown signal `{name}`"));
        if is_function(name) {
            error.help = Some(format!("`{name}` is a function: write `{name}(...)`"));
        } else if !name.contains('.') {
            error.help = Some("a signal is written `node.variable`".to_owned());
        }
        error.unknown = Some(name.to_owned());
        Err(error)
    }

    /// The rest of a call, after its opening parenthesis.
    fn call(&mut self, name: &str, span: &Range<usize>) -> Result<Node, ParseError> {
        if !is_function(name) {
            return Err(unknown_function(name, span.clone()));
        }
        let (bare, reduced) = (self.bare.len(), self.reduced.len());
        let mut arguments = vec![self.number(0)?];
        while self.skip(",") {
            arguments.push(self.number(0)?);
        }
        if self.peek() != Token::Symbol(")") {
            return Err(self.expected("`,` or `)`"));
        }
        let whole = span.start..self.span().end;
        self.next += 1;
        let Some(reducer) = reducer(name, &arguments, &whole)? else {
            return function(name, arguments, whole);
        };
        if let Some(inner) = self.reduced.get(reduced) {
            let message = format!("`{name}` runs over the window, and so does what is inside it");
            let mut error = ParseError::new(inner.clone(), message);
            error.help = (arguments.len() == 1 && matches!(name, "max" | "min")).then(|| {
                format!(
                    "`{name}` of one argument runs over the window; \
                         give it two or more to compare values with each other"
                )
            });
            return Err(error);
        }
        self.bare.truncate(bare);
        self.reduced.push(whole);
        self.reductions.push(Reduction { reducer, argument: arguments.swap_remove(0) });
        Ok(Node::Reduced(self.reductions.len() - 1))
    }
}

fn is_function(name: &str) -> bool {
    name == "quantile"
        || FUNCTIONS.iter().any(|(known, ..)| *known == name)
        || REDUCERS.iter().any(|(known, _)| *known == name)
}

fn unknown_function(name: &str, span: Range<usize>) -> ParseError {
    let functions = FUNCTIONS.iter().map(|(name, ..)| *name);
    let reducers = REDUCERS.iter().map(|(name, _)| *name);
    let mut known: Vec<_> = functions.chain(reducers).chain(["quantile"]).collect();
    known.sort_unstable();
    known.dedup();
    ParseError::new(span, format!("unknown function `{name}`"))
        .help(format!("the functions are {}", known.join(", ")))
}

/// The reduction that the call is, if it is not a function per sample.
fn reducer(
    name: &str,
    arguments: &[Node],
    whole: &Range<usize>,
) -> Result<Option<Reducer>, ParseError> {
    if name == "quantile" {
        return match arguments {
            [_, Node::Number(p)] if (0.0..=1.0).contains(p) => Ok(Some(Reducer::Quantile(*p))),
            _ => Err(ParseError::new(
                whole.clone(),
                "expected `quantile(x, p)` with a number p from 0 to 1",
            )
            .help("`quantile(x, 0.95)` is what 95 % of the samples do not exceed")),
        };
    }
    let known = REDUCERS.iter().find(|(known, _)| *known == name);
    match (known, arguments.len()) {
        (Some((_, reducer)), 1) => Ok(Some(*reducer)),
        (Some(_), _) if matches!(name, "min" | "max") => Ok(None),
        (Some(_), count) => Err(ParseError::new(
            whole.clone(),
            format!("expected one argument for `{name}`, found {count}"),
        )),
        (None, _) => Ok(None),
    }
}

fn function(name: &str, arguments: Vec<Node>, whole: Range<usize>) -> Result<Node, ParseError> {
    let known = FUNCTIONS.iter().find(|(known, ..)| *known == name);
    match known {
        Some((_, function, fewest, most)) if (*fewest..=*most).contains(&arguments.len()) => {
            Ok(Node::Call(*function, arguments))
        }
        _ => {
            let wanted = known.map_or(1, |(_, _, fewest, _)| *fewest);
            let found = arguments.len();
            let message = format!("expected {wanted} argument(s) for `{name}`, found {found}");
            Err(ParseError::new(whole, message))
        }
    }
}
