//! Turns the text of a condition into an expression.

use std::f64::consts::PI;
use std::marker::PhantomData;
use std::ops::Range;

use diagnostics::suggest::{self, Unknown};

use super::token::{Token, tokens};
use super::{
    Expression, Junction, Node, Operand, Operator, ParseError, Reducer, Reduction, Relation,
    TextSide,
};
use crate::{function, reducer};

/// Words and symbols that one condition may have; it bounds the recursion for a hostile text.
const LONGEST: usize = 400;

impl<S> Expression<S> {
    /// Reads a condition; `resolve` gives the index of a signal in the rows to come.
    ///
    /// # Errors
    /// When the text is malformed, a name is unknown, or signals and reductions are mixed.
    pub fn parse(
        text: &str,
        resolve: &mut dyn FnMut(&str) -> Option<Operand<S>>,
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
        Ok(Self { root, reductions: parser.reductions, space: PhantomData })
    }
}

/// Binding strength of a binary operator.
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

struct Parser<'a, S> {
    text: &'a str,
    tokens: Vec<(Token<'a>, Range<usize>)>,
    next: usize,
    resolve: &'a mut dyn FnMut(&str) -> Option<Operand<S>>,
    /// Places of signals and `time` outside every reduction.
    bare: Vec<Range<usize>>,
    reductions: Vec<Reduction>,
    /// Place of each reduction.
    reduced: Vec<Range<usize>>,
}

impl<'a, S> Parser<'a, S> {
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
        let (left, right) = match (left, right) {
            (Node::Either(_, index), right @ Node::Text(_)) => {
                (Node::Text(TextSide::Signal(index)), right)
            }
            (left @ Node::Text(_), Node::Either(_, index)) => {
                (left, Node::Text(TextSide::Signal(index)))
            }
            sides => sides,
        };
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
            Token::Text(text) => Node::Text(TextSide::Literal(text.to_owned())),
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
                Operand::Number(index) => Node::Signal(index.position()),
                Operand::Text(index) => Node::Text(TextSide::Signal(index.position())),
                Operand::Either(number, text) => Node::Either(number.position(), text.position()),
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
        let Some((reducer, parameter)) = reduction(name, &arguments, &whole)? else {
            return call(name, arguments, whole);
        };
        if let Some(inner) = self.reduced.get(reduced) {
            let message = format!("`{name}` runs over the window, and so does what is inside it");
            let mut error = ParseError::new(inner.clone(), message);
            error.help = (arguments.len() == 1 && function::find(name).is_some()).then(|| {
                format!(
                    "`{name}` of one argument runs over the window; \
                         give it two or more to compare values with each other"
                )
            });
            return Err(error);
        }
        self.bare.truncate(bare);
        self.reduced.push(whole);
        self.reductions.push(Reduction { reducer, parameter, argument: arguments.swap_remove(0) });
        Ok(Node::Reduced(self.reductions.len() - 1))
    }
}

fn is_function(name: &str) -> bool {
    function::find(name).is_some() || reducer::find(name).is_some()
}

fn unknown_function(name: &str, span: Range<usize>) -> ParseError {
    let functions = function::FUNCTIONS.iter().map(|function| function.name);
    let reducers = reducer::REDUCERS.iter().map(|reducer| reducer.name);
    let mut known: Vec<_> = functions.chain(reducers).collect();
    known.sort_unstable();
    known.dedup();
    let closest = suggest::closest_question(name, known.iter().copied());
    let Unknown { message, .. } = suggest::unknown("function", name, []);
    // All of them, also when they are many: there is no other list at hand.
    ParseError::new(span, message)
        .help(closest.unwrap_or_else(|| format!("known: {}", known.join(", "))))
}

/// The reduction that the call is, with its parameter, if it is not a function of one sample.
fn reduction(
    name: &str,
    arguments: &[Node],
    whole: &Range<usize>,
) -> Result<Option<(&'static Reducer, f64)>, ParseError> {
    let Some(reducer) = reducer::find(name) else { return Ok(None) };
    if let Some(parameter) = &reducer.parameter {
        return match arguments {
            [_, Node::Number(number)] if (parameter.accepts)(*number) => {
                Ok(Some((reducer, *number)))
            }
            _ => Err(ParseError::new(whole.clone(), format!("expected {}", parameter.expected))
                .help(parameter.example)),
        };
    }
    match arguments.len() {
        1 => Ok(Some((reducer, f64::NAN))),
        _ if function::find(name).is_some() => Ok(None),
        count => Err(ParseError::new(
            whole.clone(),
            format!("expected one argument for `{name}`, found {count}"),
        )),
    }
}

fn call(name: &str, arguments: Vec<Node>, whole: Range<usize>) -> Result<Node, ParseError> {
    let known = function::find(name);
    match known {
        Some(function) if function.arity.contains(&arguments.len()) => {
            Ok(Node::Call(function, arguments))
        }
        _ => {
            let wanted = known.map_or(1, |function| *function.arity.start());
            let found = arguments.len();
            let message = format!("expected {wanted} argument(s) for `{name}`, found {found}");
            Err(ParseError::new(whole, message))
        }
    }
}
