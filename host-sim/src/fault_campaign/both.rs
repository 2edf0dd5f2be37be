//! Two controllers that must answer alike, to the byte.

use super::run::Supervised;
use crate::closed_loop::{Drive, DriveError};
use firmware::link::{CommandRecord, Order};
use firmware::tick::Sample;

/// Two controllers under the same samples and orders; a difference between their
/// answers ends the run.
pub struct Both<A, B> {
    /// Whose answers are expected.
    pub expected: A,
    /// Whose answers go to the plant.
    pub driving: B,
}

impl<A: Drive, B: Drive> Drive for Both<A, B> {
    fn command(&mut self, sample: &Sample) -> Result<CommandRecord, DriveError> {
        let expected = self.expected.command(sample)?;
        let answer = self.driving.command(sample)?;
        if answer.payload() == expected.payload() {
            return Ok(answer);
        }
        Err(DriveError::Link(format!(
            "tick {}: the answer is {answer:?}, expected {expected:?}",
            sample.tick
        )))
    }
}

impl<A: Supervised, B: Supervised> Supervised for Both<A, B> {
    fn order(&mut self, order: Order) -> Result<(), DriveError> {
        self.expected.order(order)?;
        self.driving.order(order)
    }
}
