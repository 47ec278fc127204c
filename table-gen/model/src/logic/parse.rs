//! Text to formula, by recursive descent over a list of tokens with a bound on nesting.

use super::formula::{Comparison, Formula, Interval, Signal};

/// Deepest nesting of brackets and prefixes.
const DEPTH_MAX: u32 = 64;

/// Why a text is no formula.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("column {column}: found {found}, expected {expected}")]
pub struct ParseError {
    /// Column of the first character that does not fit, from 1.
    pub column: usize,
    /// What stands there.
    pub found: String,
    /// What could.
    pub expected: &'static str,
}

#[derive(Debug, Clone, PartialEq)]
enum Token {
    Word(String),
    Number(f64),
    Symbol(&'static str),
    End,
}

/// Symbols, the longer ones first.
const SYMBOLS: [&str; 14] = [
    "->", "<=", ">=", "&&", "||", "(", ")", "[", "]", ",", "!", "&", "|", "<",
];

/// Parses a formula.
///
/// # Errors
/// The first token that does not fit.
pub fn parse(text: &str) -> Result<Formula, ParseError> {
    let tokens = tokens(text)?;
    let mut parser = Parser {
        tokens,
        at: 0,
        depth: 0,
    };
    let formula = parser.implication()?;
    match parser.peek() {
        Token::End => Ok(formula),
        _ => Err(parser.unexpected("an operator or the end")),
    }
}

fn tokens(text: &str) -> Result<Vec<(usize, Token)>, ParseError> {
    let mut out = Vec::new();
    let mut rest = text;
    loop {
        rest = rest.trim_start();
        let column = text[..text.len() - rest.len()].chars().count() + 1;
        let Some(first) = rest.chars().next() else {
            out.push((column, Token::End));
            return Ok(out);
        };
        let (token, len) = if let Some(symbol) = SYMBOLS.iter().find(|s| rest.starts_with(**s)) {
            (Token::Symbol(symbol), symbol.len())
        } else if first == '>' {
            (Token::Symbol(">"), 1)
        } else if first.is_ascii_alphabetic() {
            let len = rest
                .find(|c: char| !c.is_ascii_alphanumeric() && c != '_')
                .unwrap_or(rest.len());
            (Token::Word(rest[..len].to_owned()), len)
        } else {
            number(rest).ok_or_else(|| ParseError {
                column,
                found: format!("`{first}`"),
                expected: "a formula",
            })?
        };
        out.push((column, token));
        rest = &rest[len..];
    }
}

/// A number at the start of a text. Infinities and NaN cannot be written.
fn number(text: &str) -> Option<(Token, usize)> {
    let mut len = 0;
    let mut before = ' ';
    for c in text.chars() {
        let sign = (c == '-' || c == '+') && (len == 0 || matches!(before, 'e' | 'E'));
        let exponent = matches!(c, 'e' | 'E') && before.is_ascii_digit();
        if !(c.is_ascii_digit() || c == '.' || sign || exponent) {
            break;
        }
        before = c;
        len += c.len_utf8();
    }
    let value: f64 = text[..len].parse().ok()?;
    value.is_finite().then_some((Token::Number(value), len))
}

struct Parser {
    tokens: Vec<(usize, Token)>,
    at: usize,
    depth: u32,
}

impl Parser {
    fn peek(&self) -> &Token {
        self.tokens
            .get(self.at)
            .map_or(&Token::End, |(_, token)| token)
    }

    fn next(&mut self) -> Token {
        let token = self.peek().clone();
        self.at += 1;
        token
    }

    fn unexpected(&self, expected: &'static str) -> ParseError {
        let column = self.tokens.get(self.at).map_or(1, |(column, _)| *column);
        let found = match self.peek() {
            Token::Word(word) => format!("`{word}`"),
            Token::Number(value) => format!("`{value}`"),
            Token::Symbol(symbol) => format!("`{symbol}`"),
            Token::End => "the end".to_owned(),
        };
        ParseError {
            column,
            found,
            expected,
        }
    }

    /// Takes one of some symbols or words.
    fn take(&mut self, names: &[&str]) -> bool {
        let found = match self.peek() {
            Token::Symbol(symbol) => names.contains(symbol),
            Token::Word(word) => names.contains(&word.as_str()),
            _ => false,
        };
        self.at += usize::from(found);
        found
    }

    fn need(&mut self, symbol: &str, expected: &'static str) -> Result<(), ParseError> {
        if self.take(&[symbol]) {
            Ok(())
        } else {
            Err(self.unexpected(expected))
        }
    }

    fn implication(&mut self) -> Result<Formula, ParseError> {
        let left = self.disjunction()?;
        if !self.take(&["->", "implies"]) {
            return Ok(left);
        }
        self.enter()?;
        let right = self.implication()?;
        self.depth -= 1;
        Ok(Formula::Implies(Box::new(left), Box::new(right)))
    }

    fn disjunction(&mut self) -> Result<Formula, ParseError> {
        let mut left = self.conjunction()?;
        while self.take(&["|", "||", "or"]) {
            let right = self.conjunction()?;
            left = Formula::Or(Box::new(left), Box::new(right));
        }
        Ok(left)
    }

    fn conjunction(&mut self) -> Result<Formula, ParseError> {
        let mut left = self.until()?;
        while self.take(&["&", "&&", "and"]) {
            let right = self.until()?;
            left = Formula::And(Box::new(left), Box::new(right));
        }
        Ok(left)
    }

    fn until(&mut self) -> Result<Formula, ParseError> {
        let left = self.prefixed()?;
        if !self.take(&["U", "until"]) {
            return Ok(left);
        }
        let within_s = self.bound()?;
        let right = self.prefixed()?;
        Ok(Formula::Until(within_s, Box::new(left), Box::new(right)))
    }

    fn enter(&mut self) -> Result<(), ParseError> {
        self.depth += 1;
        if self.depth > DEPTH_MAX {
            return Err(self.unexpected("at most 64 levels of nesting"));
        }
        Ok(())
    }

    fn prefixed(&mut self) -> Result<Formula, ParseError> {
        self.enter()?;
        let formula = if self.take(&["!", "not"]) {
            Formula::Not(Box::new(self.prefixed()?))
        } else if self.take(&["G", "always"]) {
            Formula::Always(self.bound()?, Box::new(self.prefixed()?))
        } else if self.take(&["F", "eventually"]) {
            Formula::Eventually(self.bound()?, Box::new(self.prefixed()?))
        } else if self.take(&["("]) {
            let inside = self.implication()?;
            self.need(")", "`)`")?;
            inside
        } else {
            self.atom()?
        };
        self.depth -= 1;
        Ok(formula)
    }

    /// `[<=60s]`, if it is there.
    fn bound(&mut self) -> Result<Option<f64>, ParseError> {
        if !self.take(&["["]) {
            return Ok(None);
        }
        self.need("<=", "`<=`")?;
        let Token::Number(value) = *self.peek() else {
            return Err(self.unexpected("a time"));
        };
        if value < 0.0 {
            return Err(self.unexpected("a time that is not negative"));
        }
        self.at += 1;
        self.need("s", "`s`, the unit of a time")?;
        self.need("]", "`]`")?;
        Ok(Some(value))
    }

    fn atom(&mut self) -> Result<Formula, ParseError> {
        const EXPECTED: &str = "`f`, `loss`, `true`, `!`, `G`, `F` or `(`";
        if self.take(&["true"]) {
            return Ok(Formula::True);
        }
        let signal = if self.take(&["f"]) {
            Signal::Frequency
        } else if self.take(&["loss"]) {
            Signal::Loss
        } else {
            return Err(self.unexpected(EXPECTED));
        };
        if self.take(&["in"]) {
            return Ok(Formula::In(signal, self.interval()?));
        }
        let comparison = if self.take(&["<=", "<"]) {
            Comparison::AtMost
        } else if self.take(&[">=", ">"]) {
            Comparison::AtLeast
        } else {
            return Err(self.unexpected("`in`, `<=` or `>=`"));
        };
        let value = self.number()?;
        Ok(Formula::Compare(signal, comparison, value))
    }

    fn number(&mut self) -> Result<f64, ParseError> {
        match *self.peek() {
            Token::Number(value) => {
                self.at += 1;
                Ok(value)
            }
            _ => Err(self.unexpected("a number")),
        }
    }

    fn interval(&mut self) -> Result<Interval, ParseError> {
        if let Token::Word(_) = self.peek()
            && let Token::Word(name) = self.next()
        {
            return Ok(Interval::Named(name));
        }
        self.need("[", "the name of an interval, or `[`")?;
        let low = self.number()?;
        self.need(",", "`,`")?;
        let high = self.number()?;
        if low > high {
            self.at -= 1;
            return Err(self.unexpected("an upper end that is not below the lower one"));
        }
        self.need("]", "`]`")?;
        Ok(Interval::Ends(low, high))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn atoms() -> impl Strategy<Value = Formula> {
        let signal = prop_oneof![Just(Signal::Frequency), Just(Signal::Loss)];
        let comparison = prop_oneof![Just(Comparison::AtMost), Just(Comparison::AtLeast)];
        let interval = prop_oneof![
            Just(Interval::Named("I1".to_owned())),
            (-2.0f64..0.0, 0.0f64..2.0).prop_map(|(low, high)| Interval::Ends(low, high)),
        ];
        prop_oneof![
            Just(Formula::True),
            (signal.clone(), comparison, -3.0f64..3.0)
                .prop_map(|(s, c, v)| Formula::Compare(s, c, v)),
            (signal, interval).prop_map(|(s, i)| Formula::In(s, i)),
        ]
    }

    fn formulas() -> impl Strategy<Value = Formula> {
        atoms().prop_recursive(5, 40, 2, |inner| {
            let bound = prop_oneof![Just(None), (0.0f64..100.0).prop_map(Some)];
            let one = inner.clone().prop_map(Box::new);
            let two = (one.clone(), one.clone());
            prop_oneof![
                one.clone().prop_map(Formula::Not),
                two.clone().prop_map(|(a, b)| Formula::And(a, b)),
                two.clone().prop_map(|(a, b)| Formula::Or(a, b)),
                two.clone().prop_map(|(a, b)| Formula::Implies(a, b)),
                (bound.clone(), one.clone()).prop_map(|(t, a)| Formula::Always(t, a)),
                (bound.clone(), one).prop_map(|(t, a)| Formula::Eventually(t, a)),
                (bound, two).prop_map(|(t, (a, b))| Formula::Until(t, a, b)),
            ]
        })
    }

    proptest! {
        #[test]
        fn what_is_printed_parses_to_itself(formula in formulas()) {
            let text = formula.to_string();
            prop_assert_eq!(parse(&text).unwrap(), formula, "{}", text);
        }

        #[test]
        fn no_text_makes_it_panic(text in "[ -~]{0,60}") {
            let _ = parse(&text);
        }
    }

    #[test]
    fn the_papers_formula_is_read() {
        let text = "G(f >= -0.8) & G(!(f in I1) -> F[<=60s] f in I1)";
        let formula = parse(text).unwrap();
        assert_eq!(
            formula.to_string(),
            "G(f >= -0.8) & G(!(f in I1) -> F[<=60s](f in I1))"
        );
        let words =
            "always (f >= -0.8) and always (not (f in I1) implies eventually[<=60s] f in I1)";
        assert_eq!(parse(words).unwrap(), formula);
    }

    #[test]
    fn operators_bind_as_documented() {
        let same = [
            ("f <= 1 & f >= 0 | true", "(f <= 1 & f >= 0) | true"),
            ("true -> true -> f <= 1", "true -> (true -> f <= 1)"),
            ("!f <= 1 & true", "(!(f <= 1)) & true"),
            ("true U f <= 1 & true", "(true U f <= 1) & true"),
        ];
        for (short, long) in same {
            assert_eq!(parse(short).unwrap(), parse(long).unwrap(), "{short}");
        }
    }

    #[test]
    fn errors_name_the_column_and_what_fits() {
        let error = |text: &str| parse(text).unwrap_err().to_string();
        assert_eq!(error("G(f >= )"), "column 8: found `)`, expected a number");
        assert_eq!(
            error("f in [1, 0]"),
            "column 10: found `0`, expected an upper end that is not below the lower one"
        );
        assert_eq!(
            error("F[<=60] f >= 0"),
            "column 7: found `]`, expected `s`, the unit of a time"
        );
        assert!(error("").starts_with("column 1: found the end"));
        assert!(error(&"!".repeat(100)).contains("nesting"));
        assert!(error("f >= 1 f").contains("an operator or the end"));
    }
}
