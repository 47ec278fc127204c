//! Numbers as options take them: one, or a band `LOW,HIGH`.

use std::str::FromStr;

/// A band of numbers; one number is a band of no width.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Band(pub(super) [f64; 2]);

impl Band {
    /// The number, if it is one.
    pub(super) fn single(self) -> Option<f64> {
        let [low, high] = self.0;
        (low == high).then_some(low)
    }
}

impl FromStr for Band {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = numbers(text)?;
        match numbers.as_slice() {
            [one] => Ok(Self([*one, *one])),
            [low, high] if low <= high => Ok(Self([*low, *high])),
            [_, _] => Err("the band is upside down; allowed: LOW,HIGH".to_owned()),
            _ => Err("allowed: a number, or LOW,HIGH".to_owned()),
        }
    }
}

/// One number for each state (f, g, l, p).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PerState(pub(super) [f64; 4]);

impl FromStr for PerState {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = numbers(text)?;
        <[f64; 4]>::try_from(numbers.as_slice())
            .map(Self)
            .map_err(|_| "allowed: four numbers F,G,L,P in Hz, GW, GW, GW".to_owned())
    }
}

/// One number or more.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Numbers(pub(super) Vec<f64>);

impl FromStr for Numbers {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        numbers(text).map(Self)
    }
}

fn numbers(text: &str) -> Result<Vec<f64>, String> {
    text.split(',')
        .map(|part| {
            let number: f64 = part
                .trim()
                .parse()
                .map_err(|_| format!("{part:?} is not a number"))?;
            if number.is_finite() {
                Ok(number)
            } else {
                Err(format!("{part:?} is not finite"))
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_number_or_a_band() {
        assert_eq!("2".parse(), Ok(Band([2.0, 2.0])));
        assert_eq!("1.8, 2.2".parse(), Ok(Band([1.8, 2.2])));
        for bad in ["", "2.2,1.8", "1,2,3", "a", "nan", "1,inf"] {
            assert!(bad.parse::<Band>().is_err(), "{bad}");
        }
        assert_eq!("1,2,3,4".parse(), Ok(PerState([1.0, 2.0, 3.0, 4.0])));
        assert!("1,2,3".parse::<PerState>().is_err());
        assert_eq!("1, 2,3".parse(), Ok(Numbers(vec![1.0, 2.0, 3.0])));
        assert!("1,,3".parse::<Numbers>().is_err());
    }
}
