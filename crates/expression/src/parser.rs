//! Turns the text of a condition into an expression.

use std::f64::consts::PI;
use std::marker::PhantomData;
use std::ops::Range;

use diagnostics::suggest::{self, UnknownName};
use units::Unit;

use super::token::{Token, tokens};
use super::{Expression, Node, Operand, ParseError, Reducer, Reduction, Signal, TextSide};
use crate::dimension::Dimension;
use crate::inference::{Part, Rules};
use crate::operator::{COMPARISON, POWER, combine, strength};
use crate::{function, reducer};

/// Words and symbols that one condition may have; it bounds the recursion for a hostile text.
const LONGEST: usize = 400;

impl<S> Expression<S> {
    /// Reads a condition; `resolve` gives the index of a signal in the rows to come, and its unit.
    ///
    /// # Errors
    /// When the text is malformed, a name is unknown, units do not fit, or signals and reductions are mixed.
    pub fn parse(
        text: &str,
        resolve: &mut dyn FnMut(&str) -> Option<Signal<S>>,
    ) -> Result<Self, ParseError> {
        let tokens = tokens(text)?;
        if tokens.len() > LONGEST {
            let message = format!("expected at most {LONGEST} words and symbols in one condition");
            return Err(ParseError::new(tokens[LONGEST].1.clone(), message)
                .help("split it into several checks"));
        }
        let mut parser = Parser {
            text,
            rules: Rules { text },
            tokens,
            next: 0,
            resolve,
            bare: Vec::new(),
            reductions: Vec::new(),
            compared: None,
            reduced: Vec::new(),
        };
        let Part { node: root, dimension, .. } = parser.number(0)?;
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
        let dimension = Box::new(dimension);
        let compared = parser.compared.filter(|_| matches!(root, Node::Compare(..)));
        let compared = compared.map(String::into_boxed_str);
        let reductions = parser.reductions;
        Ok(Self { root, dimension, compared, reductions, space: PhantomData })
    }
}

struct Parser<'a, S> {
    text: &'a str,
    rules: Rules<'a>,
    tokens: Vec<(Token<'a>, Range<usize>)>,
    next: usize,
    resolve: &'a mut dyn FnMut(&str) -> Option<Signal<S>>,
    /// Places of signals and `time` outside every reduction.
    bare: Vec<Range<usize>>,
    reductions: Vec<Reduction>,
    /// The unit of the last comparison, which is the root if the root is one.
    compared: Option<String>,
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
    fn number(&mut self, least: u8) -> Result<Part, ParseError> {
        let part = self.expression(least)?;
        self.refuse_text(&part)?;
        Ok(part)
    }

    /// Refuses a text.
    fn refuse_text(&self, part: &Part) -> Result<(), ParseError> {
        let Node::Text(_) = part.node else { return Ok(()) };
        let quoted = &self.text[part.span.clone()];
        let message = format!("`{quoted}` is a text, not a number");
        let help = format!("compare it with another text: `{quoted} == 'on'`");
        Err(ParseError::new(part.span.clone(), message).help(help))
    }

    /// The comparison of two numbers or two texts.
    fn compare(&self, symbol: &str, mut left: Part, mut right: Part) -> Result<Part, ParseError> {
        let span = left.span.start..right.span.end;
        let text = |part: &mut Part| {
            if let Node::Either(_, index) = part.node {
                part.node = Node::Text(TextSide::Signal(index));
            }
        };
        match (&left.node, &right.node) {
            (Node::Text(_), _) => text(&mut right),
            (_, Node::Text(_)) => text(&mut left),
            _ => {}
        }
        match (symbol, left.node, right.node) {
            ("==" | "!=", Node::Text(a), Node::Text(b)) => {
                Ok(Part::plain(Node::Same(symbol == "==", [a, b]), span))
            }
            (_, Node::Text(_), Node::Text(_)) => {
                Err(ParseError::new(span, "texts are compared by `==` and `!=` only"))
            }
            (_, Node::Text(_), _) | (_, _, Node::Text(_)) => {
                Err(ParseError::new(span, "this compares a text with a number")
                    .help("what stands in quotes is a text, also '1'"))
            }
            (_, a, b) => {
                combine(self.rules, symbol, Part { node: a, ..left }, Part { node: b, ..right })
            }
        }
    }

    fn expression(&mut self, least: u8) -> Result<Part, ParseError> {
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
                self.refuse_text(&left)?;
            }
            self.next += 1;
            // A power groups from the right: 2^3^2 is 2^(3^2).
            let least = strength + u8::from(strength != POWER);
            left = match compared {
                true => {
                    let right = self.expression(least)?;
                    self.compared = left.dimension.shown().or_else(|| right.dimension.shown());
                    self.compare(symbol, left, right)?
                }
                false => combine(self.rules, symbol, left, self.number(least)?)?,
            };
        }
        Ok(left)
    }

    fn prefix(&mut self) -> Result<Part, ParseError> {
        let start = self.span().start;
        if self.skip("not") {
            let part = self.number(COMPARISON)?;
            Ok(Part::plain(Node::Not(Box::new(part.node)), start..part.span.end))
        } else if self.skip("-") {
            // -a^2 is -(a^2), as in mathematics.
            let part = self.number(POWER)?;
            let span = start..part.span.end;
            self.rules.negative(part, span)
        } else {
            self.operand()
        }
    }

    fn operand(&mut self) -> Result<Part, ParseError> {
        let (token, span) = self.tokens[self.next].clone();
        let part = match token {
            Token::Number(number) => {
                self.next += 1;
                return self.literal(number, span);
            }
            Token::Text(text) => Part::plain(Node::Text(TextSide::Literal(text.to_owned())), span),
            Token::Name("pi") => Part::number(PI, None, span),
            Token::Name("time") => {
                self.bare.push(span.clone());
                Part { node: Node::Time, dimension: Dimension::seconds(), span }
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
                Part { span: span.start..self.span().end, ..inner }
            }
            _ => return Err(self.expected("a number, a signal, a function or `(`")),
        };
        self.next += 1;
        Ok(part)
    }

    /// A number, with the unit that follows it.
    fn literal(&mut self, number: f64, span: Range<usize>) -> Result<Part, ParseError> {
        let Token::Unit(name) = self.peek() else { return Ok(Part::number(number, None, span)) };
        let place = self.span();
        self.next += 1;
        let unit =
            Unit::parse(name).map_err(|error| ParseError::new(place.clone(), error.to_string()))?;
        Ok(Part::number(number, Some((unit, name)), span.start..place.end))
    }

    fn signal(&mut self, name: &str, span: Range<usize>) -> Result<Part, ParseError> {
        if let Some(Signal { operand, unit }) = (self.resolve)(name) {
            self.bare.push(span.clone());
            let node = match operand {
                Operand::Number(index) => Node::Signal(index.position()),
                Operand::Text(index) => Node::Text(TextSide::Signal(index.position())),
                Operand::Either(number, text) => Node::Either(number.position(), text.position()),
            };
            return Ok(Part { node, dimension: Dimension::of(name, unit), span });
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
    fn call(&mut self, name: &str, span: &Range<usize>) -> Result<Part, ParseError> {
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
            return call(self.rules, name, arguments, whole);
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
        self.reduced.push(whole.clone());
        arguments.truncate(reducer.quantities);
        let (arguments, dimension) = self.rules.call(name, reducer.units, arguments)?;
        self.reductions.push(Reduction { reducer, parameter, arguments });
        Ok(Part { node: Node::Reduced(self.reductions.len() - 1), dimension, span: whole })
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
    let UnknownName { message, .. } = suggest::unknown("function", name, []);
    // All of them, also when they are many: there is no other list at hand.
    ParseError::new(span, message)
        .help(closest.unwrap_or_else(|| format!("known: {}", known.join(", "))))
}

/// The reduction that the call is, with its parameter, if it is not a function of one sample.
fn reduction(
    name: &str,
    arguments: &[Part],
    whole: &Range<usize>,
) -> Result<Option<(&'static Reducer, f64)>, ParseError> {
    let Some(reducer) = reducer::find(name) else { return Ok(None) };
    if let Some(form) = &reducer.form {
        let constant = arguments.get(reducer.quantities);
        let parameter = match (form.parameter, constant.map(|part| (&part.node, &part.dimension))) {
            (None, None) if arguments.len() == reducer.quantities => Some(f64::NAN),
            (Some(accepts), Some((Node::Number(number), Dimension::Number)))
                if arguments.len() == reducer.quantities + 1 && accepts(*number) =>
            {
                Some(*number)
            }
            _ => None,
        };
        let wrong = || ParseError::new(whole.clone(), format!("expected {}", form.expected));
        return match parameter {
            Some(parameter) => Ok(Some((reducer, parameter))),
            None => Err(wrong().help(form.example)),
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

fn call(
    rules: Rules,
    name: &str,
    arguments: Vec<Part>,
    whole: Range<usize>,
) -> Result<Part, ParseError> {
    let known = function::find(name);
    match known {
        Some(function) if function.arity.contains(&arguments.len()) => {
            let (nodes, dimension) = rules.call(name, function.units, arguments)?;
            Ok(Part { node: Node::Call(function, nodes), dimension, span: whole })
        }
        _ => {
            let wanted = known.map_or(1, |function| *function.arity.start());
            let found = arguments.len();
            let message = format!("expected {wanted} argument(s) for `{name}`, found {found}");
            Err(ParseError::new(whole, message))
        }
    }
}
