//! How a figure of merit is shown.

use crate::report::number;

/// How a figure is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FigureUnit {
    /// Metres as mm.
    Millimetres,
    /// Volts as mV.
    Millivolts,
    /// Seconds.
    Seconds,
}

impl FigureUnit {
    /// The figure with its unit.
    pub fn shown(self, figure: f64) -> String {
        match self {
            Self::Millimetres => format!("{} mm", number::fixed(1e3 * figure, 3)),
            Self::Millivolts => format!("{} mV", number::fixed(1e3 * figure, 1)),
            Self::Seconds => format!("{} s", number::fixed(figure, 3)),
        }
    }
}
