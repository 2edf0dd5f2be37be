//! What the control task costs, counted on the chip, and how it is told.
//!
//! The counts are a board's own: processor cycles, or what stands for them in
//! QEMU. The report says how many of them make a second.

use crate::frame::LONGEST_PAYLOAD;
use crate::status::TickCost;
use heapless::Vec;

/// First byte of a report's payload.
pub const KIND: u8 = 0x41;

/// Counts of the control task since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Ticks counted.
    pub ticks: u32,
    /// Counts of all of them.
    pub total_counts: u64,
    /// Counts of the longest.
    pub worst_counts: u32,
}

impl Cost {
    /// Adds a tick.
    #[inline]
    pub fn add(&mut self, counts: u32) {
        self.ticks = self.ticks.saturating_add(1);
        self.total_counts = self.total_counts.saturating_add(u64::from(counts));
        self.worst_counts = self.worst_counts.max(counts);
    }

    /// Counts of a tick in the mean: of ten thousand counts a tick to a part in two hundred thousand.
    fn mean_counts(&self) -> u32 {
        let (mut total, mut ticks) = (self.total_counts, self.ticks);
        while total > u64::from(u32::MAX) {
            (total, ticks) = (total >> 1, ticks >> 1);
        }
        u32::try_from(total).unwrap_or(u32::MAX) / ticks.max(1)
    }
}

impl Report {
    /// What a tick costs, as the status says it; more than it can say is its most. In 32 bits: a
    /// division of 64 costs a kilobyte of flash.
    pub fn tick_cost(&self) -> TickCost {
        let per_10_us = (self.counts_per_s / 100_000).max(1);
        let tenths_of_us = |counts: u32| {
            let tenths = counts.saturating_mul(100) / per_10_us;
            u16::try_from(tenths).unwrap_or(u16::MAX)
        };
        TickCost {
            mean_100ns: tenths_of_us(self.cost.mean_counts()),
            worst_100ns: tenths_of_us(self.cost.worst_counts),
        }
    }
}

/// What the application tells of itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Report {
    /// The control task's cost.
    pub cost: Cost,
    /// Counts in a second.
    pub counts_per_s: u32,
    /// The most that the stack has held; 0 where the board does not watch it.
    pub stack_bytes: u32,
    /// Frames that did not arrive whole.
    pub dropped_frames: u32,
    /// Commands that found no place in the queue to the serial line.
    pub lost_commands: u32,
    /// Why the board last started, see [`crate::start::ResetCause`].
    pub reset_cause: u8,
    /// What was kept over that reset, see [`crate::start::Kept`]; 0 for nothing.
    pub kept_cause: u32,
}

/// Bytes of a report's payload.
pub const REPORT_BYTES: usize = 1 + 4 + 8 + 4 + 4 * 4 + 1 + 4;

impl Report {
    /// The report as it goes into a frame.
    pub fn payload(&self) -> Vec<u8, LONGEST_PAYLOAD> {
        let mut payload = Vec::new();
        for field in [
            &[KIND][..],
            &self.cost.ticks.to_le_bytes(),
            &self.cost.total_counts.to_le_bytes(),
            &self.cost.worst_counts.to_le_bytes(),
            &self.counts_per_s.to_le_bytes(),
            &self.stack_bytes.to_le_bytes(),
            &self.dropped_frames.to_le_bytes(),
            &self.lost_commands.to_le_bytes(),
            &[self.reset_cause],
            &self.kept_cause.to_le_bytes(),
        ] {
            let fits = payload.extend_from_slice(field).is_ok();
            debug_assert!(fits, "a report is shorter than the longest payload");
        }
        payload
    }

    /// Reads a report; `None` where the payload is none.
    pub fn read(payload: &[u8]) -> Option<Self> {
        let payload: &[u8; REPORT_BYTES] = payload.try_into().ok()?;
        let (kind, rest) = payload.split_first()?;
        let word = |at: usize| Some(u32::from_le_bytes(*rest.get(at..)?.first_chunk()?));
        let report = Self {
            cost: Cost {
                ticks: word(0)?,
                total_counts: u64::from_le_bytes(*rest.get(4..)?.first_chunk()?),
                worst_counts: word(12)?,
            },
            counts_per_s: word(16)?,
            stack_bytes: word(20)?,
            dropped_frames: word(24)?,
            lost_commands: word(28)?,
            reset_cause: *rest.get(32)?,
            kept_cause: word(33)?,
        };
        (*kind == KIND).then_some(report)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_a_report_comes_back() {
        let mut cost = Cost::default();
        for counts in [3, 9, 5] {
            cost.add(counts);
        }
        let original = Report {
            cost,
            counts_per_s: 25_000_000,
            stack_bytes: 1234,
            dropped_frames: 1,
            lost_commands: 2,
            reset_cause: 4,
            kept_cause: 0x1234_5678,
        };
        assert_eq!((cost.total_counts, cost.worst_counts), (17, 9));
        let told = Report {
            counts_per_s: 1_000_000,
            ..original
        };
        let TickCost {
            mean_100ns,
            worst_100ns,
        } = told.tick_cost();
        assert_eq!((mean_100ns, worst_100ns), (50, 90));
        let long = Cost {
            ticks: 4_000_000_000,
            total_counts: 4_000_000_000 * 13_041,
            worst_counts: 14_382,
        };
        assert!((13_040..=13_042).contains(&long.mean_counts()));
        let payload = original.payload();
        assert_eq!(payload.len(), REPORT_BYTES);
        assert_eq!(Report::read(&payload), Some(original));
        assert_eq!(Report::read(&payload[1..]), None);
    }
}
