//! The kinds of unit.

/// What a unit is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The axis behind its converters.
    Plant,
    /// The firmware's control task.
    Controller,
    /// What the firmware believes of an axis that something else drives.
    Observer,
}

impl Kind {
    /// All of them, by name.
    pub const ALL: [(&'static str, Self); 3] = [
        ("plant", Self::Plant),
        ("controller", Self::Controller),
        ("observer", Self::Observer),
    ];

    /// The kind of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|(own, _)| *own == name)
            .map(|(_, kind)| kind)
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        Self::ALL
            .into_iter()
            .find(|(_, kind)| *kind == self)
            .map_or("", |(name, _)| name)
    }
}
