//! Which law: the names by which recordings, effects and verdicts speak of one.

/// The laws that can be driven by recordings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Law {
    /// Pressures from position and command.
    Chambers,
    /// Force of a bench from motion and pressures.
    Force,
    /// Position of a free carriage from pressures.
    Carriage,
    /// Stem of a positioner from its command.
    Actuator,
    /// Flow into the valve's ports from command and pressures.
    ValveFlow,
    /// The valve's spool from its command.
    Spool,
    /// Forces on a free carriage in weak form: what a carriage is searched by.
    Balance,
}
