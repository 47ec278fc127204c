//! What a run came to: the time of each step beside its budget, and the last line.
//!
//! A step over its budget is told loudly and does not fail: machines are noisy.

use std::fmt::Write as _;
use std::time::Duration;

use crate::process::Tests;
use crate::steps::{Step, TOTAL_MAX};

/// The steps so far.
#[derive(Debug, Default)]
pub(crate) struct Summary {
    steps: Vec<Row>,
    /// Tests in the steps that passed.
    tests: Tests,
    failed: usize,
    /// Steps after the one that failed.
    pub(crate) not_run: usize,
}

#[derive(Debug, Clone, Copy)]
struct Row {
    name: &'static str,
    time: Duration,
    budget: Duration,
}

impl Summary {
    /// Takes a step that ended, with its tests if it passed; the line that says so.
    pub(crate) fn note(&mut self, step: &Step, time: Duration, passed: Option<&Tests>) -> String {
        let row = Row {
            name: step.name,
            time,
            budget: step.budget(),
        };
        self.steps.push(row);
        let mut line = format!("{} ", step.name);
        match passed {
            Some(tests) => {
                self.tests.passed += tests.passed;
                self.tests.ignored += tests.ignored;
                line.push_str("passed");
                if *tests != Tests::default() {
                    let _ = write!(line, ", {} tests", tests.passed);
                }
                if tests.ignored > 0 {
                    let _ = write!(line, " and {} IGNORED", tests.ignored);
                }
            }
            None => {
                self.failed += 1;
                line.push_str("FAILED");
            }
        }
        let _ = write!(
            line,
            " in {} of {}",
            readable(time),
            readable(step.budget())
        );
        if let Some(mark) = mark(time, row.budget) {
            let _ = write!(line, "  {mark}");
        }
        line
    }

    /// A line for each step: time, budget, and how far it is over; the whole run's last.
    pub(crate) fn times(&self) -> String {
        let total = Row {
            name: "test-all",
            time: self.steps.iter().map(|row| row.time).sum(),
            budget: TOTAL_MAX,
        };
        let rows = self.steps.iter().chain([&total]);
        let width = rows.clone().map(|row| row.name.len()).max().unwrap_or(0);
        rows.fold(String::new(), |mut text, row| {
            let (time, budget) = (readable(row.time), readable(row.budget));
            let mark = mark(row.time, row.budget).unwrap_or_default();
            let line = format!("{:width$} {time:>12} of {budget:>12}  {mark}", row.name);
            let _ = writeln!(text, "{}", line.trim_end());
            text
        })
    }

    /// `N passed, N failed, N skipped`.
    pub(crate) fn last_line(&self) -> String {
        let passed = self.steps.len() - self.failed;
        let skipped = self.not_run + self.tests.ignored as usize;
        format!("{passed} passed, {} failed, {skipped} skipped", self.failed)
    }
}

/// What stands behind a time that is over its budget.
fn mark(time: Duration, budget: Duration) -> Option<String> {
    let over = time.checked_sub(budget).filter(|over| !over.is_zero())?;
    Some(format!("<== OVER BUDGET by {}", readable(over)))
}

/// A time as people read it.
fn readable(elapsed: Duration) -> String {
    let tenths = (elapsed.as_millis() + 50) / 100;
    if tenths < 600 {
        format!("{}.{} s", tenths / 10, tenths % 10)
    } else {
        format!("{} min {:02} s", tenths / 600, tenths % 600 / 10)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::steps::STEPS;

    #[test]
    fn elapsed_time_is_rounded_once() {
        let cases = [
            (49, "0.0 s"),
            (50, "0.1 s"),
            (59_949, "59.9 s"),
            (59_950, "1 min 00 s"),
            (125_000, "2 min 05 s"),
        ];
        for (millis, text) in cases {
            assert_eq!(readable(Duration::from_millis(millis)), text);
        }
    }

    #[test]
    fn what_did_not_run_is_skipped() {
        let mut summary = Summary::default();
        let tests = Tests {
            passed: 7,
            ignored: 2,
        };
        let told = summary.note(&STEPS[0], Duration::ZERO, Some(&tests));
        assert!(told.contains("passed, 7 tests and 2 IGNORED"), "{told}");
        assert_eq!(summary.last_line(), "1 passed, 0 failed, 2 skipped");
        summary.note(&STEPS[1], Duration::ZERO, None);
        summary.not_run = STEPS.len() - 2;
        let skipped = STEPS.len() - 2 + 2;
        let last = format!("1 passed, 1 failed, {skipped} skipped");
        assert_eq!(summary.last_line(), last);
    }

    #[test]
    fn only_a_step_over_its_budget_is_marked() {
        let mut summary = Summary::default();
        let budget = STEPS[0].budget();
        summary.note(&STEPS[0], budget, Some(&Tests::default()));
        let late = budget + Duration::from_secs(3);
        let told = summary.note(&STEPS[0], late, Some(&Tests::default()));
        assert!(told.ends_with("<== OVER BUDGET by 3.0 s"), "{told}");
        let text = summary.times();
        let marks: Vec<bool> = text.lines().map(|line| line.contains("OVER")).collect();
        assert_eq!(marks, [false, true, false], "{text}");
    }
}
