//! Formulas of laws: parsed from a text, evaluated, and nothing else; no code is run.
//!
//! Main types: [`Formula`], [`Problem`] (what is wrong, and at which character). The grammar is in `formula.pest`; a sign binds
//! less than a power, so that −x^2 is −(x^2).

use std::sync::LazyLock;

use fingerpad_formats::significant;
use pest::Parser;
use pest::iterators::{Pair, Pairs};
use pest::pratt_parser::{Assoc, Op, PrattParser};

/// Parser that pest makes of the grammar.
mod grammar {
    #![allow(missing_docs)]

    #[derive(pest_derive::Parser)]
    #[grammar = "laws/formula.pest"]
    pub struct FormulaParser;
}
use grammar::{FormulaParser, Rule};

/// Longest formula, characters: brackets within brackets are read one inside the other.
const LONGEST: usize = 1000;
/// Digits of numbers in a message.
pub const DIGITS: usize = 6;

static PRECEDENCE: LazyLock<PrattParser<Rule>> = LazyLock::new(|| {
    PrattParser::new()
        .op(Op::infix(Rule::add, Assoc::Left) | Op::infix(Rule::subtract, Assoc::Left))
        .op(Op::infix(Rule::multiply, Assoc::Left) | Op::infix(Rule::divide, Assoc::Left))
        .op(Op::prefix(Rule::sign))
        .op(Op::infix(Rule::power, Assoc::Right))
});

/// What is wrong with a formula.
#[derive(Clone, Debug, PartialEq)]
pub struct Problem {
    /// Character of the formula at which it shows, from 1.
    pub character: usize,
    /// What it is.
    pub text: String,
}

/// An operation on two numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operation {
    /// Sum.
    Add,
    /// Difference.
    Subtract,
    /// Product.
    Multiply,
    /// Quotient.
    Divide,
    /// Power.
    Power,
    /// The lesser.
    Least,
    /// The larger.
    Most,
}

/// A function of one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Function {
    /// e to the power of it.
    Exp,
    /// Natural logarithm.
    Ln,
    /// Square root.
    Sqrt,
    /// Absolute value.
    Abs,
    /// Sine of radians.
    Sin,
    /// Cosine of radians.
    Cos,
    /// Hyperbolic tangent.
    Tanh,
}

/// Names of functions of one number.
const FUNCTIONS: [(&str, Function); 7] = [
    ("exp", Function::Exp),
    ("ln", Function::Ln),
    ("sqrt", Function::Sqrt),
    ("abs", Function::Abs),
    ("sin", Function::Sin),
    ("cos", Function::Cos),
    ("tanh", Function::Tanh),
];

/// A part of a formula; its second field is the character at which it stands, from 1.
#[derive(Clone, Debug)]
pub enum Part {
    /// A number.
    Number(f64),
    /// A variable, by its place in [`Formula::variables`].
    Variable(usize),
    /// The other sign.
    Negative(Box<Part>),
    /// Two numbers and an operation.
    Two(Operation, usize, Box<[Part; 2]>),
    /// A function of a number.
    One(Function, usize, Box<Part>),
}

/// A formula.
#[derive(Clone, Debug)]
pub struct Formula {
    /// Names of its variables, each once, with the character of the first place.
    pub variables: Vec<(String, usize)>,
    /// Its outermost part.
    pub part: Part,
}

impl Formula {
    /// Parses a text.
    ///
    /// # Errors
    /// [`Problem`] at the character where the text is no formula any more.
    pub fn parse(text: &str) -> Result<Self, Problem> {
        if text.chars().count() > LONGEST {
            let text = format!("the formula is longer than {LONGEST} characters");
            return Err(Problem { character: LONGEST, text });
        }
        let parsed = FormulaParser::parse(Rule::formula, text).map_err(|error| {
            let byte = match error.location {
                pest::error::InputLocation::Pos(at) | pest::error::InputLocation::Span((at, _)) => at,
            };
            let at = character(text, byte);
            let rest: String = text[byte..].chars().take(12).collect();
            let found = if rest.is_empty() { "the formula ends".to_owned() } else { format!("`{rest}` stands") };
            let text = format!("{found} where a number, a name, an operator or a bracket is expected");
            Problem { character: at, text }
        })?;
        let mut variables = Vec::new();
        let outermost = parsed.into_iter().next().and_then(|p| p.into_inner().next());
        let sum = outermost.expect("a formula has a sum, says the grammar");
        let part = part_of(text, sum.into_inner(), &mut variables)?;
        Ok(Self { variables, part })
    }

    /// Its value where the variables have these values.
    ///
    /// # Errors
    /// The first value that is not finite, with its place.
    pub fn value(&self, variables: &[f64]) -> Result<f64, Problem> {
        self.part.value(variables)
    }

    /// Its value, whether finite or not.
    pub fn plain_value(&self, variables: &[f64]) -> f64 {
        self.part.plain_value(variables)
    }
}

/// Character of a byte of a text, from 1.
fn character(text: &str, byte: usize) -> usize {
    text.char_indices().take_while(|(at, _)| *at < byte).count() + 1
}

fn part_of(text: &str, pairs: Pairs<'_, Rule>, variables: &mut Vec<(String, usize)>) -> Result<Part, Problem> {
    let place = |pair: &Pair<'_, Rule>| character(text, pair.as_span().start());
    let variables = std::cell::RefCell::new(variables);
    PRECEDENCE
        .map_primary(|pair| {
            let at = place(&pair);
            match pair.as_rule() {
                Rule::number => pair
                    .as_str()
                    .parse()
                    .map(Part::Number)
                    .map_err(|_| Problem { character: at, text: format!("`{}` is not a number", pair.as_str()) }),
                Rule::name => {
                    let mut variables = variables.borrow_mut();
                    let known = variables.iter().position(|(name, _)| name == pair.as_str());
                    Ok(Part::Variable(known.unwrap_or_else(|| {
                        variables.push((pair.as_str().to_owned(), at));
                        variables.len() - 1
                    })))
                }
                Rule::call => call(text, pair, at, &mut variables.borrow_mut()),
                _ => part_of(text, pair.into_inner(), &mut variables.borrow_mut()),
            }
        })
        .map_prefix(|_, of| Ok(Part::Negative(Box::new(of?))))
        .map_infix(|left, operator, right| {
            let operation = match operator.as_rule() {
                Rule::add => Operation::Add,
                Rule::subtract => Operation::Subtract,
                Rule::multiply => Operation::Multiply,
                Rule::divide => Operation::Divide,
                _ => Operation::Power,
            };
            Ok(Part::Two(operation, place(&operator), Box::new([left?, right?])))
        })
        .parse(pairs)
}

fn call(text: &str, pair: Pair<'_, Rule>, at: usize, variables: &mut Vec<(String, usize)>) -> Result<Part, Problem> {
    let mut inner = pair.into_inner();
    let name = inner.next().map_or("", |name| name.as_str());
    let mut arguments = Vec::new();
    for sum in inner {
        arguments.push(part_of(text, sum.into_inner(), variables)?);
    }
    let refuse = |text: String| Problem { character: at, text };
    if let Some((_, function)) = FUNCTIONS.iter().find(|(known, _)| *known == name) {
        let count = arguments.len();
        let [one] = <[Part; 1]>::try_from(arguments)
            .map_err(|_| refuse(format!("{name} takes one number, {count} are given")))?;
        return Ok(Part::One(*function, at, Box::new(one)));
    }
    let operation = match name {
        "min" => Operation::Least,
        "max" => Operation::Most,
        _ => {
            let known = FUNCTIONS.map(|(known, _)| known).join(", ");
            return Err(refuse(format!("`{name}` is no function; there are {known}, min and max")));
        }
    };
    let count = arguments.len();
    let two =
        <[Part; 2]>::try_from(arguments).map_err(|_| refuse(format!("{name} takes two numbers, {count} are given")))?;
    Ok(Part::Two(operation, at, Box::new(two)))
}

impl Operation {
    fn of(self, a: f64, b: f64) -> f64 {
        match self {
            Self::Add => a + b,
            Self::Subtract => a - b,
            Self::Multiply => a * b,
            Self::Divide => a / b,
            Self::Power => a.powf(b),
            Self::Least => a.min(b),
            Self::Most => a.max(b),
        }
    }
}

impl Function {
    fn of(self, x: f64) -> f64 {
        match self {
            Self::Exp => x.exp(),
            Self::Ln => x.ln(),
            Self::Sqrt => x.sqrt(),
            Self::Abs => x.abs(),
            Self::Sin => x.sin(),
            Self::Cos => x.cos(),
            Self::Tanh => x.tanh(),
        }
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        FUNCTIONS.iter().find(|(_, function)| *function == self).map_or("", |(name, _)| name)
    }
}

impl Part {
    fn plain_value(&self, variables: &[f64]) -> f64 {
        match self {
            Self::Number(x) => *x,
            Self::Variable(k) => variables[*k],
            Self::Negative(x) => -x.plain_value(variables),
            Self::Two(operation, _, parts) => {
                let [a, b] = &**parts;
                operation.of(a.plain_value(variables), b.plain_value(variables))
            }
            Self::One(function, _, x) => function.of(x.plain_value(variables)),
        }
    }

    fn value(&self, variables: &[f64]) -> Result<f64, Problem> {
        let (value, character, what) = match self {
            Self::Number(x) => return Ok(*x),
            Self::Variable(k) => return Ok(variables[*k]),
            Self::Negative(x) => return Ok(-x.value(variables)?),
            Self::Two(operation, at, parts) => {
                let (a, b) = (parts[0].value(variables)?, parts[1].value(variables)?);
                let [left, right] = [a, b].map(|v| significant(v, DIGITS));
                let what = match operation {
                    Operation::Divide if b == 0.0 => format!("{left} is divided by zero"),
                    Operation::Power => format!("{left} to the power of {right}"),
                    _ => format!("an operation on {left} and {right}"),
                };
                (operation.of(a, b), *at, what)
            }
            Self::One(function, at, x) => {
                let x = x.value(variables)?;
                (function.of(x), *at, format!("{}({})", function.name(), significant(x, DIGITS)))
            }
        };
        if value.is_finite() {
            return Ok(value);
        }
        Err(Problem { character, text: format!("{what}: {value}") })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str) -> f64 {
        let formula = Formula::parse(text).unwrap();
        let of = |name: &str| match name {
            "x" => 3.0,
            "min_x" => 0.5,
            _ => 2.0,
        };
        formula.value(&formula.variables.iter().map(|(name, _)| of(name)).collect::<Vec<_>>()).unwrap()
    }

    #[test]
    fn formulas_have_the_values_that_a_reader_expects() {
        for (text, wanted) in [
            ("-x^2", -9.0),
            ("2^-x", 0.125),
            ("exp(-(x/3)^2)", (-1.0f64).exp()),
            ("1 - 2 - 3", -4.0),
            ("12 / 3 / 2 * 5", 10.0),
            ("2^3^2", 512.0),
            ("1.5e-1*x + .5", 0.95),
            ("max(min(x, y), min_x) * 2", 4.0),
            ("-(-x) - -x", 6.0),
            ("ln(exp(x)) + sqrt(abs(0 - 4)) + tanh(0) + sin(0) + cos(0)", 6.0),
        ] {
            assert!((value(text) - wanted).abs() < 1e-12, "{text}: {}", value(text));
        }
    }

    #[test]
    fn what_is_no_formula_is_refused_at_its_place() {
        for (text, character, word) in [
            ("", 1, "ends"),
            ("a * ", 5, "ends"),
            ("a ** 2", 4, "* 2"),
            ("2 x", 3, "x"),
            ("a + sinh(x)", 5, "sinh"),
            ("exp(x, 2)", 1, "one number"),
            ("1 + max(x)", 5, "two numbers"),
            ("°x", 1, "°x"),
            ("(a", 3, "ends"),
            ("system(\"ls\")", 8, "\"ls\""),
        ] {
            let problem = Formula::parse(text).unwrap_err();
            assert!(problem.character == character && problem.text.contains(word), "{text}: {problem:?}");
        }
        let deep = "(".repeat(900);
        assert!(Formula::parse(&deep).is_err());
        let problem = Formula::parse("1 / (x - 3)").unwrap().value(&[3.0]).unwrap_err();
        assert_eq!((problem.character, problem.text.as_str()), (3, "1 is divided by zero: inf"));
    }
}
