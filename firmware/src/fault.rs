//! The fault list: what can go wrong, how it is seen, what to do.
//!
//! Every fault has one reaction: the command of the very tick that sees it is
//! the valve's null, the cause is latched and kept over a reset
//! ([`crate::start::cause_of`]), and only an acknowledgement leads back. One exception:
//! from a load that starts the wrong way round the valve takes the force first, for 20 ms at
//! the most (`supervisor::polarity`).
//! The codes are stable: they stand in recordings and in people's logs.

/// What went wrong. The number is the code in `Command::fault`; 0 is none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Fault {
    /// A converter says that its conversion failed.
    FailedConversion = 1,
    /// A reading that the sensor cannot give while it measures.
    OutOfRange = 2,
    /// A sensor stands still while the others say that it should not.
    FrozenSensor = 3,
    /// A reading went further in a tick than physics can.
    JumpingSensor = 4,
    /// The pressures' force and the motion do not belong together.
    PressureContradictsPosition = 5,
    /// The velocity and the change of position do not belong together.
    VelocityContradictsPosition = 6,
    /// More samples are missing than the valve may hold its command for.
    MissedTicks = 7,
    /// The tick number does not advance.
    TickStandsStill = 8,
    /// The control task did not end within its period.
    TaskOverrun = 9,
    /// The reference stands still although it says that it moves.
    StaleReference = 10,
    /// The reference asks for a place beyond the stroke.
    ReferenceOutOfStroke = 11,
    /// The supply is too low to move the load.
    SupplyLost = 12,
    /// The stored settings fail their CRC.
    SettingsDamaged = 13,
    /// The settings hold values that no axis has.
    SettingsImpossible = 14,
    /// The valve's converter does not give back what was written.
    DacMismatch = 15,
    /// The board reset itself, by its watchdog or knowingly.
    WatchdogReset = 16,
    /// The crystal or the PLL did not start.
    ClockFailed = 17,
    /// The board's own supply dipped.
    BrownOut = 18,
    /// The controller's result is no number.
    NotANumber = 19,
    /// The command goes to and fro at a hold without an end.
    LoopSwings = 20,
    /// The axis answers the wrong way round.
    WrongPolarity = 21,
}

/// A fault that was seen, and where.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Finding {
    /// What went wrong.
    pub fault: Fault,
    /// Where: the channel, or a number that the fault list explains.
    pub detail: u8,
}

/// The converter channels, in the order of the link; the detail of the faults
/// that concern a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Channel {
    /// Position.
    Position = 0,
    /// Pressure of chamber a.
    PressureA = 1,
    /// Pressure of chamber b.
    PressureB = 2,
    /// Supply pressure.
    SupplyPressure = 3,
    /// Velocity.
    Velocity = 4,
}

/// What people should know of a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Description {
    /// The fault.
    pub fault: Fault,
    /// Its name.
    pub name: &'static str,
    /// How it is seen.
    pub seen: &'static str,
    /// What the detail byte holds.
    pub detail: &'static str,
    /// What to do.
    pub remedy: &'static str,
}

const CHANNELS: &str = "channel: 0 position, 1 p_a, 2 p_b, 3 p_s, 4 velocity";

/// All faults, in the order of their codes.
pub const DESCRIPTIONS: [Description; 21] = [
    Description {
        fault: Fault::FailedConversion,
        name: "failed conversion",
        seen: "code 0xFFFF on a channel, one sample is enough: the converter itself says so, \
               and the controller has no reading to go by",
        detail: CHANNELS,
        remedy: "check the converter's wiring, its supply and its clock",
    },
    Description {
        fault: Fault::OutOfRange,
        name: "out of range",
        seen: "position beyond the stroke or a code at the end of its scale; a pressure below a \
               quarter of the ambient one or at the end of its scale; velocity at an end of its \
               scale",
        detail: CHANNELS,
        remedy: "look for a broken or shorted sensor wire; move a carriage that stands at its \
                 end stop away by hand",
    },
    Description {
        fault: Fault::FrozenSensor,
        name: "frozen sensor",
        seen: "a code that stays the same bit for bit while the velocity (for the position), the \
               position (for the velocity) or the valve's flow and the motion (for a chamber \
               pressure) say that it should have changed",
        detail: CHANNELS,
        remedy: "check the sensor and its converter; a frozen supply sensor cannot be seen, no \
                 other signal tells what it should say",
    },
    Description {
        fault: Fault::JumpingSensor,
        name: "jumping sensor",
        seen: "position or velocity changes faster than the largest force can accelerate the \
               load; a chamber pressure changes faster than the open valve and the piston can",
        detail: CHANNELS,
        remedy: "look for a loose contact, a failing shield, a slipping position sensor",
    },
    Description {
        fault: Fault::PressureContradictsPosition,
        name: "pressure and position contradict each other",
        seen: "the force of the measured pressures, less the load's inertia, exceeds friction, \
               doubled payload and 15 % of the axis' largest force in the mean over 50 ms",
        detail: "0",
        remedy: "check the pressure sensors and their tubes; look whether the load is blocked \
                 or stands against something",
    },
    Description {
        fault: Fault::VelocityContradictsPosition,
        name: "velocity contradicts position",
        seen: "the integral of the velocity and the change of position part by more than the \
               velocity sensor's error and 5 ms of time skew explain",
        detail: "0",
        remedy: "check gain, offset and sign of both sensors, and their mounting",
    },
    Description {
        fault: Fault::MissedTicks,
        name: "missed ticks",
        seen: "the tick number skips more samples than the valve may hold its last command for \
               (1 mm astray at full opening); fewer are bridged and counted",
        detail: "number of missed samples, at most 255",
        remedy: "look for the cause in the sampling chain: timer, DMA, link",
    },
    Description {
        fault: Fault::TickStandsStill,
        name: "tick stands still",
        seen: "the same or an older tick number, as many times in a row as samples may be missed",
        detail: "number of samples in a row, at most 255",
        remedy: "look for the cause in the sampling chain: timer, DMA, link",
    },
    Description {
        fault: Fault::TaskOverrun,
        name: "task overrun",
        seen: "the board: the next tick began before the control task had ended, or no tick \
               came for 10 ms; the valve's switch goes to the middle",
        detail: "0 too long, 1 no tick",
        remedy: "0: lower the tick rate; report it: the cost of a tick has a known bound; 1: the \
                 converters had stopped, look for interference",
    },
    Description {
        fault: Fault::StaleReference,
        name: "stale reference",
        seen: "the reference's position stays the same bit for bit for 20 ms while its velocity \
               and acceleration say that it went 1 mm or more; the board: streamed references \
               stop arriving",
        detail: "0",
        remedy: "look for the cause at the sender; send a reference of NaN to ask for nothing",
    },
    Description {
        fault: Fault::ReferenceOutOfStroke,
        name: "reference out of stroke",
        seen: "a reference position beyond the stroke, a velocity beyond the sensor's scale, an \
               acceleration beyond what 10 bar give the load",
        detail: "0 position, 1 velocity, 2 acceleration",
        remedy: "correct the motion or the rig's stroke",
    },
    Description {
        fault: Fault::SupplyLost,
        name: "supply lost",
        seen: "the supply's gauge pressure is below what makes half of it overcome twice the \
               static friction; while the wiring is unchecked, below half a bar",
        detail: "supply pressure in tenths of a bar, absolute",
        remedy: "open the shut-off valve, check compressor and regulator",
    },
    Description {
        fault: Fault::SettingsDamaged,
        name: "settings damaged",
        seen: "at start: no settings slot has a valid CRC, or the newest record has none and an \
               older one is in use; a board whose slots are both blank has no fault: it starts \
               with the built-in settings and its status says so",
        detail: "0 none, 1 older settings in use",
        remedy: "write the settings anew: `pneuma settings`",
    },
    Description {
        fault: Fault::SettingsImpossible,
        name: "settings impossible",
        seen: "at start, or when new settings are built: a value that no axis has",
        detail: "0",
        remedy: "correct the rig file, write the settings anew: `pneuma settings`",
    },
    Description {
        fault: Fault::DacMismatch,
        name: "DAC write-back mismatch",
        seen: "the board: the converter's output register does not hold what was written, or the \
               voltage behind the amplifier is another, also before the valve is switched on; \
               the valve's switch goes to the middle",
        detail: "0 register, 1 voltage",
        remedy: "check the amplifier's supply and the valve's wire for a short; replace the board \
                 if it comes again",
    },
    Description {
        fault: Fault::WatchdogReset,
        name: "watchdog reset",
        seen: "the board, at start: the independent watchdog caused the reset, or the program \
               itself, because of a defect or a crystal that had stopped",
        detail: "0 watchdog, 1 panic, 2 exception of the processor, 3 crystal",
        remedy: "3: check the crystal; else report it: the control task had stopped, or the \
                 program has a defect",
    },
    Description {
        fault: Fault::ClockFailed,
        name: "clock failed",
        seen: "the board, at start: crystal or PLL were not ready within their bounded wait; it \
               runs on its internal oscillator",
        detail: "0 crystal, 1 PLL",
        remedy: "check the crystal; reset",
    },
    Description {
        fault: Fault::BrownOut,
        name: "brown-out",
        seen: "the board, at start: the brown-out detector caused the reset",
        detail: "0",
        remedy: "check the board's supply under load",
    },
    Description {
        fault: Fault::NotANumber,
        name: "not a number",
        seen: "the controller's command or estimate is not finite; the valve's switch goes to \
               the middle",
        detail: "0",
        remedy: "report it with the recording; acknowledging begins with a new observer",
    },
    Description {
        fault: Fault::LoopSwings,
        name: "loop swings",
        seen: "while the reference stands still the command opens the valve by half of its full \
               opening, 40 times in a row one way and the other, although the loop was calmed \
               four times before, after 12 swings each",
        detail: "0",
        remedy: "the axis answers later than the settings say: record it, `pneuma diagnose` names a \
                 lagging gauge or tubes; or lower the gains in the rig's [controller]",
    },
    Description {
        fault: Fault::WrongPolarity,
        name: "wrong polarity",
        seen: "from a start until the axis has answered once: the valve opens and the other \
               chamber's pressure rises, or the load moves against the force of its gas",
        detail: "0 valve or tubes or gauges, 1 position, 2 velocity",
        remedy: "0: exchange the valve's tubes or reverse feeds_a_when of the rig, unless both \
                 gauges are exchanged; 1, 2: reverse the sign of the position, of the velocity; \
                 with tubes and gauges exchanged together, of both",
    },
];

/// The faults in the order of their codes: the chip needs no texts.
const CODES: [Fault; DESCRIPTIONS.len()] = {
    let mut codes = [Fault::FailedConversion; DESCRIPTIONS.len()];
    let mut place = 0;
    while place < codes.len() {
        codes[place] = DESCRIPTIONS[place].fault;
        place += 1;
    }
    codes
};

impl Fault {
    /// The stable code.
    pub fn code(self) -> u8 {
        self as u8
    }

    /// The fault of a code.
    pub fn from_code(code: u8) -> Option<Self> {
        CODES.get(usize::from(code.checked_sub(1)?)).copied()
    }

    /// Whether new settings end the cause.
    pub fn ends_with_settings(self) -> bool {
        matches!(self, Self::SettingsDamaged | Self::SettingsImpossible)
    }

    /// Whether the cause stays until the board starts anew or, where
    /// [they end it](Self::ends_with_settings), has new settings: until then there
    /// is nothing to acknowledge.
    pub fn is_standing(self) -> bool {
        matches!(
            self,
            Self::SettingsDamaged | Self::SettingsImpossible | Self::ClockFailed
        )
    }

    /// Whether the command itself, or what puts it out, cannot be trusted: a board with a switch
    /// before its valve then takes the valve from the converter.
    pub fn is_of_output(self) -> bool {
        matches!(
            self,
            Self::TaskOverrun | Self::DacMismatch | Self::NotANumber
        )
    }

    /// A finding of this fault.
    pub fn at(self, detail: u8) -> Finding {
        Finding {
            fault: self,
            detail,
        }
    }

    /// A finding of this fault at a sensor.
    pub fn of(self, channel: Channel) -> Finding {
        self.at(channel as u8)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_codes_count_up_and_lead_back() {
        for (place, description) in DESCRIPTIONS.iter().enumerate() {
            assert_eq!(usize::from(description.fault.code()), place + 1);
            let code = description.fault.code();
            assert_eq!(Fault::from_code(code), Some(description.fault));
        }
        assert_eq!(Fault::from_code(0), None);
        assert_eq!(Fault::from_code(DESCRIPTIONS.len() as u8 + 1), None);
    }
}
