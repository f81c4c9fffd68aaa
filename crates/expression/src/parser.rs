//! Turns the text of a condition into an expression.

use std::f64::consts::PI;
use std::marker::PhantomData;
use std::ops::Range;

use diagnostics::suggest::{self, UnknownName};
use units::Unit;

use super::token::{Token, tokenize};
use super::{
    Expression, ExpressionNode, ParseError, ReductionCall, ResolvedSignal, SignalOperand, TextOperand,
    WindowReducer,
};
use crate::dimension::{InferredUnit, common_unit_label};
use crate::inference::{SubExpression, UnitInference};
use crate::operator::{COMPARISON, POWER, build_binary_operation, operator_precedence};
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
        resolve: &mut dyn FnMut(&str) -> Option<ResolvedSignal<S>>,
    ) -> Result<Self, ParseError> {
        let tokens = tokenize(text)?;
        if tokens.len() > LONGEST {
            let message = format!("expected at most {LONGEST} words and symbols in one condition");
            return Err(
                ParseError::new(tokens[LONGEST].1.clone(), message).with_help("split it into several checks")
            );
        }
        let mut parser = ExpressionParser {
            text,
            rules: UnitInference { text },
            tokens,
            next: 0,
            resolve,
            bare: Vec::new(),
            reductions: Vec::new(),
            compared: None,
            reduced: Vec::new(),
        };
        let SubExpression { node: root, dimension, .. } = parser.parse_number_expression(0)?;
        if parser.peek_token() != Token::End {
            return Err(parser.expected_token_error("an operator or the end"));
        }
        if let (Some(bare), Some(reduced)) = (parser.bare.first(), parser.reduced.first()) {
            let (name, reduced) = (&text[bare.clone()], &text[reduced.clone()]);
            let message = format!("`{name}` is one value per sample, but `{reduced}` is one for the window");
            return Err(ParseError::new(bare.clone(), message).with_help(format!(
                "put `{name}` inside a reduction too, such as `max({name})`, or make two checks"
            )));
        }
        let dimension = Box::new(dimension);
        let compared = parser.compared.filter(|_| matches!(root, ExpressionNode::Compare(..)));
        let compared = compared.map(String::into_boxed_str);
        let reductions = parser.reductions;
        Ok(Self { root, dimension, compared, reductions, space: PhantomData })
    }
}

struct ExpressionParser<'a, S> {
    text: &'a str,
    rules: UnitInference<'a>,
    tokens: Vec<(Token<'a>, Range<usize>)>,
    next: usize,
    resolve: &'a mut dyn FnMut(&str) -> Option<ResolvedSignal<S>>,
    /// Places of signals and `time` outside every reduction.
    bare: Vec<Range<usize>>,
    reductions: Vec<ReductionCall>,
    /// The unit of the last comparison, which is the root if the root is one.
    compared: Option<String>,
    /// Place of each reduction.
    reduced: Vec<Range<usize>>,
}

impl<'a, S> ExpressionParser<'a, S> {
    fn peek_token(&self) -> Token<'a> {
        self.tokens[self.next].0
    }

    fn next_token_span(&self) -> Range<usize> {
        self.tokens[self.next].1.clone()
    }

    fn skip_symbol_if_next(&mut self, symbol: &str) -> bool {
        let found = matches!(self.peek_token(), Token::Symbol(s) if s == symbol);
        self.next += usize::from(found);
        found
    }

    fn expected_token_error(&self, expected: &str) -> ParseError {
        let found = match self.peek_token() {
            Token::End => "the end".to_owned(),
            _ => format!("`{}`", &self.text[self.next_token_span()]),
        };
        ParseError::new(self.next_token_span(), format!("expected {expected}, found {found}"))
    }

    /// An expression that is no text.
    fn parse_number_expression(&mut self, least: u8) -> Result<SubExpression, ParseError> {
        let part = self.parse_expression(least)?;
        self.refuse_text(&part)?;
        Ok(part)
    }

    /// Refuses a text.
    fn refuse_text(&self, part: &SubExpression) -> Result<(), ParseError> {
        let ExpressionNode::Text(_) = part.node else { return Ok(()) };
        let quoted = &self.text[part.span.clone()];
        let message = format!("`{quoted}` is a text, not a number");
        let help = format!("compare it with another text: `{quoted} == 'on'`");
        Err(ParseError::new(part.span.clone(), message).with_help(help))
    }

    /// The comparison of two numbers or two texts.
    fn build_comparison(
        &self,
        symbol: &str,
        mut left: SubExpression,
        mut right: SubExpression,
    ) -> Result<SubExpression, ParseError> {
        let span = left.span.start..right.span.end;
        let text = |part: &mut SubExpression| {
            if let ExpressionNode::Either(_, index) = part.node {
                part.node = ExpressionNode::Text(TextOperand::Signal(index));
            }
        };
        match (&left.node, &right.node) {
            (ExpressionNode::Text(_), _) => text(&mut right),
            (_, ExpressionNode::Text(_)) => text(&mut left),
            _ => {}
        }
        match (symbol, left.node, right.node) {
            ("==" | "!=", ExpressionNode::Text(a), ExpressionNode::Text(b)) => {
                Ok(SubExpression::without_unit(ExpressionNode::Same(symbol == "==", [a, b]), span))
            }
            (_, ExpressionNode::Text(_), ExpressionNode::Text(_)) => {
                Err(ParseError::new(span, "texts are compared by `==` and `!=` only"))
            }
            (_, ExpressionNode::Text(_), _) | (_, _, ExpressionNode::Text(_)) => {
                Err(ParseError::new(span, "this compares a text with a number")
                    .with_help("what stands in quotes is a text, also '1'"))
            }
            (_, a, b) => build_binary_operation(
                self.rules,
                symbol,
                SubExpression { node: a, ..left },
                SubExpression { node: b, ..right },
            ),
        }
    }

    fn parse_expression(&mut self, least: u8) -> Result<SubExpression, ParseError> {
        let mut left = self.parse_prefix_operator()?;
        let mut compared = false;
        while let Token::Symbol(symbol) = self.peek_token() {
            let Some(strength) = operator_precedence(symbol).filter(|strength| *strength >= least) else {
                break;
            };
            if compared && strength == COMPARISON {
                return Err(self
                    .expected_token_error("one comparison at a time")
                    .with_help("write `a < b and b < c` for a range"));
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
                    let right = self.parse_expression(least)?;
                    self.compared = common_unit_label(&left.dimension, &right.dimension);
                    self.build_comparison(symbol, left, right)?
                }
                false => {
                    build_binary_operation(self.rules, symbol, left, self.parse_number_expression(least)?)?
                }
            };
        }
        Ok(left)
    }

    fn parse_prefix_operator(&mut self) -> Result<SubExpression, ParseError> {
        let start = self.next_token_span().start;
        if self.skip_symbol_if_next("not") {
            let part = self.parse_number_expression(COMPARISON)?;
            Ok(SubExpression::without_unit(ExpressionNode::Not(Box::new(part.node)), start..part.span.end))
        } else if self.skip_symbol_if_next("-") {
            // -a^2 is -(a^2), as in mathematics.
            let part = self.parse_number_expression(POWER)?;
            let span = start..part.span.end;
            self.rules.infer_negation(part, span)
        } else {
            self.parse_operand()
        }
    }

    fn parse_operand(&mut self) -> Result<SubExpression, ParseError> {
        let (token, span) = self.tokens[self.next].clone();
        let part = match token {
            Token::Number(number) => {
                self.next += 1;
                return self.parse_number_with_unit(number, span);
            }
            Token::Text(text) => {
                SubExpression::without_unit(ExpressionNode::Text(TextOperand::Literal(text.to_owned())), span)
            }
            Token::Name("pi") => SubExpression::from_number(PI, None, span),
            Token::Name("time") => {
                self.bare.push(span.clone());
                SubExpression { node: ExpressionNode::Time, dimension: InferredUnit::seconds(), span }
            }
            Token::Name(name) => {
                self.next += 1;
                if self.skip_symbol_if_next("(") {
                    return self.parse_call(name, &span);
                }
                return self.parse_signal(name, span);
            }
            Token::Quoted(name) => {
                self.next += 1;
                return self.parse_signal(name, span);
            }
            Token::Symbol("(") => {
                self.next += 1;
                let inner = self.parse_expression(0)?;
                if self.peek_token() != Token::Symbol(")") {
                    return Err(self.expected_token_error("an operator or `)`"));
                }
                SubExpression { span: span.start..self.next_token_span().end, ..inner }
            }
            _ => return Err(self.expected_token_error("a number, a signal, a function or `(`")),
        };
        self.next += 1;
        Ok(part)
    }

    /// A number, with the unit that follows it.
    fn parse_number_with_unit(
        &mut self,
        number: f64,
        span: Range<usize>,
    ) -> Result<SubExpression, ParseError> {
        let Token::Unit(name) = self.peek_token() else {
            return Ok(SubExpression::from_number(number, None, span));
        };
        let place = self.next_token_span();
        self.next += 1;
        let unit = Unit::parse(name).map_err(|error| ParseError::new(place.clone(), error.to_string()))?;
        Ok(SubExpression::from_number(number, Some((unit, name)), span.start..place.end))
    }

    fn parse_signal(&mut self, name: &str, span: Range<usize>) -> Result<SubExpression, ParseError> {
        if let Some(ResolvedSignal { operand, unit }) = (self.resolve)(name) {
            self.bare.push(span.clone());
            let node = match operand {
                SignalOperand::Number(index) => ExpressionNode::Signal(index.position()),
                SignalOperand::Text(index) => ExpressionNode::Text(TextOperand::Signal(index.position())),
                SignalOperand::Either(number, text) => {
                    ExpressionNode::Either(number.position(), text.position())
                }
            };
            return Ok(SubExpression { node, dimension: InferredUnit::from_signal_unit(name, unit), span });
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
    fn parse_call(&mut self, name: &str, span: &Range<usize>) -> Result<SubExpression, ParseError> {
        if !is_function(name) {
            return Err(unknown_function(name, span.clone()));
        }
        let (bare, reduced) = (self.bare.len(), self.reduced.len());
        let mut arguments = vec![self.parse_number_expression(0)?];
        while self.skip_symbol_if_next(",") {
            arguments.push(self.parse_number_expression(0)?);
        }
        if self.peek_token() != Token::Symbol(")") {
            return Err(self.expected_token_error("`,` or `)`"));
        }
        let whole = span.start..self.next_token_span().end;
        self.next += 1;
        let Some((reducer, parameter)) = find_reduction(name, &arguments, &whole)? else {
            return build_function_call(self.rules, name, arguments, whole);
        };
        if let Some(inner) = self.reduced.get(reduced) {
            let message = format!("`{name}` runs over the window, and so does what is inside it");
            let mut error = ParseError::new(inner.clone(), message);
            error.help = (arguments.len() == 1 && function::find_function(name).is_some()).then(|| {
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
        let (arguments, dimension) = self.rules.infer_call(name, reducer.units, arguments)?;
        self.reductions.push(ReductionCall { reducer, parameter, arguments });
        Ok(SubExpression { node: ExpressionNode::Reduced(self.reductions.len() - 1), dimension, span: whole })
    }
}

fn is_function(name: &str) -> bool {
    function::find_function(name).is_some() || reducer::find_reducer(name).is_some()
}

fn unknown_function(name: &str, span: Range<usize>) -> ParseError {
    let functions = function::FUNCTIONS.iter().map(|function| function.name);
    let reducers = reducer::REDUCERS.iter().map(|reducer| reducer.name);
    let mut known: Vec<_> = functions.chain(reducers).collect();
    known.sort_unstable();
    known.dedup();
    let closest = suggest::did_you_mean(name, known.iter().copied());
    let UnknownName { message, .. } = suggest::unknown_name("function", name, []);
    // All of them, also when they are many: there is no other list at hand.
    ParseError::new(span, message)
        .with_help(closest.unwrap_or_else(|| format!("known: {}", known.join(", "))))
}

/// The reduction that the call is, with its parameter, if it is not a function of one sample.
fn find_reduction(
    name: &str,
    arguments: &[SubExpression],
    whole: &Range<usize>,
) -> Result<Option<(&'static WindowReducer, f64)>, ParseError> {
    let Some(reducer) = reducer::find_reducer(name) else { return Ok(None) };
    if let Some(form) = &reducer.form {
        let constant = arguments.get(reducer.quantities);
        let parameter = match (form.parameter, constant.map(|part| (&part.node, &part.dimension))) {
            (None, None) if arguments.len() == reducer.quantities => Some(f64::NAN),
            (Some(accepts), Some((ExpressionNode::Number(number), InferredUnit::Number)))
                if arguments.len() == reducer.quantities + 1 && accepts(*number) =>
            {
                Some(*number)
            }
            _ => None,
        };
        let wrong = || ParseError::new(whole.clone(), format!("expected {}", form.expected));
        return match parameter {
            Some(parameter) => Ok(Some((reducer, parameter))),
            None => Err(wrong().with_help(form.example)),
        };
    }
    match arguments.len() {
        1 => Ok(Some((reducer, f64::NAN))),
        _ if function::find_function(name).is_some() => Ok(None),
        count => {
            Err(ParseError::new(whole.clone(), format!("expected one argument for `{name}`, found {count}")))
        }
    }
}

fn build_function_call(
    rules: UnitInference,
    name: &str,
    arguments: Vec<SubExpression>,
    whole: Range<usize>,
) -> Result<SubExpression, ParseError> {
    let known = function::find_function(name);
    match known {
        Some(function) if function.arity.contains(&arguments.len()) => {
            let (nodes, dimension) = rules.infer_call(name, function.units, arguments)?;
            Ok(SubExpression { node: ExpressionNode::Call(function, nodes), dimension, span: whole })
        }
        _ => {
            let wanted = known.map_or(1, |function| *function.arity.start());
            let found = arguments.len();
            let message = format!("expected {wanted} argument(s) for `{name}`, found {found}");
            Err(ParseError::new(whole, message))
        }
    }
}
