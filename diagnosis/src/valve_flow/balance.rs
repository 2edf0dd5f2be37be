//! The energy balance of a chamber over short windows of time.
//!
//! With a weight `w(t)` that is nought at both ends of a window, integration by parts takes the
//! derivative off the recorded pressure:
//!
//! ```text
//! int w (pV)' dt = -int w' p V dt
//! ```
//!
//! The noise of the pressure is averaged, and nothing is smeared: the areas are averaged over the
//! same window.

use super::{Alignment, Way};
use crate::gauge::Gauge;
use crate::laws::{Motion, Track, median_step_s, white_noise};
use crate::model::{Side, Values};
use model_core::chamber::Chamber;
use model_core::valve::{FlowLaw, GasState};
use std::borrow::Cow;

/// Half the width of a window, s: long against the noise (0.3 kPa at 1 kHz leaves 15 kPa/s of some
/// 2000 kPa/s), short against a stroke.
const HALF_WINDOW_S: f64 = 0.01;
/// No lag that is searched is longer: so much of both ends of a recording is left out, s.
pub(super) const MARGIN_S: f64 = 0.06;
/// Damping ratio of a spool: 0.6 to 0.9 by data sheets.
const SPOOL_DAMPING: f64 = 0.7;
/// Part of a window's flow by which the balance itself is off: heat, volume, motion.
const BALANCE_ERROR: f64 = 0.05;
/// Temperatures that the gas of a chamber keeps to, K.
const TEMPERATURES_K: (f64, f64) = (150.0, 500.0);
/// By no larger part does the temperature change over a row.
const MOST_GROWTH: f64 = 0.1;
/// Half the width of the parabola that a rate of pressure is read from, rows.
const RATE_HALF_WIDTH: usize = 8;

/// What does not change with the recording.
#[derive(Clone)]
pub(super) struct Axis {
    chambers: [Chamber<f64>; 2],
    law: FlowLaw<f64>,
    ambient: GasState<f64>,
    supply_pa: f64,
    feeds_a_above_null: bool,
}

/// What drives one chamber in one recording, whatever the axis is taken for.
pub(super) struct Recorded<'a> {
    side: Side,
    time_s: &'a [f64],
    command_v: &'a [f64],
    own_pa: Vec<f64>,
    other_pa: Vec<f64>,
    supply_pa: Vec<f64>,
    motion: &'a Motion,
    /// The own pressure, smoothed, with its rate.
    rate: Motion,
}

/// A chamber at one row.
struct Instant {
    volume_m3: f64,
    /// What the volume's change and the heat take, of the balance over gamma R, kg K/s.
    work_and_heat: f64,
    /// T'/T, 1/s.
    growth_per_s: f64,
}

/// gamma R, J/(kg K).
fn scale(chamber: &Chamber<f64>) -> f64 {
    chamber.gas.heat_capacity_ratio * chamber.gas.gas_constant_j_per_kg_k
}

/// One chamber in one recording, row by row.
pub(super) struct ChamberRows {
    pub(super) side: Side,
    time_s: Vec<f64>,
    command_v: Vec<f64>,
    pressure_pa: Vec<f64>,
    /// Volume without the dead volume, m3.
    stroke_m3: Vec<f64>,
    /// What the volume's change and the heat take, of the balance over gamma R, kg K/s.
    work_and_heat: Vec<f64>,
    /// T m' into the chamber per area, kg K/(s m2): from the supply, to the exhaust, past the piston.
    per_area: [Vec<f64>; 3],
    /// gamma R, J/(kg K).
    scale: f64,
    noise_pa: f64,
    dead_volume_m3: f64,
    feeds_above_null: bool,
}

/// A window: what flows in, and what it is made of.
pub(super) struct Window {
    /// What flows in, without the dead volume's part, kg K.
    pub(super) wanted: f64,
    /// What 1 m3 of dead volume takes off it, kg K/m3.
    pub(super) per_dead_volume: f64,
    /// What 1 m2 of leak past the piston brings, kg K/m2.
    pub(super) per_leak: f64,
    /// Opening towards the supply, V, and what 1 m2 of supply and of exhaust path brings there, kg K/m2.
    pub(super) paths: Vec<(f64, f64, f64)>,
    /// Standard deviation, kg K.
    pub(super) deviation: f64,
    /// Noise of what 1 m3 takes off it, one standard deviation, kg K/m3, and the volume without the
    /// dead volume, m3, by which `wanted` has the same noise.
    pub(super) noise: f64,
    pub(super) stroke_m3: f64,
}

impl Axis {
    /// Of a rig.
    pub(super) fn of(values: &Values<'_, f64>) -> Result<Self, String> {
        let missing = |what: &str| format!("the rig file says nothing of {what}");
        let chamber = |side| {
            values
                .chamber(side)
                .ok_or_else(|| missing("the [cylinder]"))
        };
        let valve = values.valve().and_then(Result::ok);
        let valve = valve.ok_or_else(|| missing("the [valve]"))?;
        let supply_pa = values.get("supply.pressure_Pa");
        Ok(Self {
            chambers: [chamber(Side::A)?, chamber(Side::B)?],
            law: valve.law,
            ambient: values.ambient(),
            supply_pa: supply_pa.ok_or_else(|| missing("supply.pressure_Pa"))?,
            feeds_a_above_null: valve.feeds_a_above_null,
        })
    }

    /// Critical pressure ratio of the paths.
    pub(super) fn critical_pressure_ratio(&self) -> f64 {
        self.law.critical_pressure_ratio
    }

    /// The same axis with another critical pressure ratio.
    pub(super) fn with_critical_pressure_ratio(mut self, ratio: f64) -> Self {
        self.law.critical_pressure_ratio = ratio;
        self
    }

    /// Dead volumes of both chambers, m3.
    pub(super) fn dead_volumes_m3(&self) -> [f64; 2] {
        self.chambers
            .each_ref()
            .map(|one| one.geometry.dead_volume_m3)
    }

    /// The same axis with other dead volumes.
    pub(super) fn with_dead_volumes(mut self, dead_volume_m3: [f64; 2]) -> Self {
        for (chamber, volume_m3) in self.chambers.iter_mut().zip(dead_volume_m3) {
            chamber.geometry.dead_volume_m3 = volume_m3;
        }
        self
    }

    /// What drives both chambers in a recording.
    pub(super) fn recorded<'t>(
        &self,
        values: &Values<'_, f64>,
        track: &'t Track<'_>,
    ) -> Result<[Recorded<'t>; 2], String> {
        let recording = track.recording;
        let lacks = |signal: &str| format!("{}: signal {signal} is missing", recording.name);
        let signal = |name: &str| recording.signal(name).ok_or_else(|| lacks(name));
        let motion = track.motion.as_ref().ok_or_else(|| lacks("x"))?;
        let command_v = signal("u")?;
        let read = |side: Side| -> Result<Vec<f64>, String> {
            let gauge = Gauge::of(values, side);
            let shown = signal(side.pressure_signal())?.iter();
            Ok(shown.map(|shown_pa| gauge.reads_pa(*shown_pa)).collect())
        };
        let [pressure_a_pa, pressure_b_pa] = [read(Side::A)?, read(Side::B)?];
        let constant = || vec![self.supply_pa; recording.len()];
        let supply_pa = recording
            .signal("p_s")
            .map_or_else(constant, <[f64]>::to_vec);
        Ok(Side::BOTH.map(|side| {
            let (own_pa, other_pa) = match side {
                Side::A => (&pressure_a_pa, &pressure_b_pa),
                Side::B => (&pressure_b_pa, &pressure_a_pa),
            };
            Recorded {
                side,
                time_s: &recording.time_s,
                command_v,
                own_pa: own_pa.clone(),
                other_pa: other_pa.clone(),
                supply_pa: supply_pa.clone(),
                motion,
                rate: Motion::with_half_width(&recording.time_s, own_pa, RATE_HALF_WIDTH),
            }
        }))
    }

    /// One chamber in a recording whose position is late by so much.
    pub(super) fn rows(&self, recorded: &Recorded<'_>, position_late_s: f64) -> ChamberRows {
        let side = recorded.side;
        let chamber = &self.chambers[usize::from(side == Side::B)];
        let dead_volume_m3 = chamber.geometry.dead_volume_m3;
        let rows = recorded.time_s.len();
        let later = position_late_s / median_step_s(recorded.time_s);
        let mut one = ChamberRows {
            side,
            time_s: recorded.time_s.to_vec(),
            command_v: recorded.command_v.to_vec(),
            pressure_pa: recorded.own_pa.clone(),
            stroke_m3: Vec::with_capacity(rows),
            work_and_heat: Vec::with_capacity(rows),
            per_area: std::array::from_fn(|_| Vec::with_capacity(rows)),
            scale: scale(chamber),
            noise_pa: white_noise(&recorded.own_pa),
            dead_volume_m3,
            feeds_above_null: self.feeds_a_above_null == (side == Side::A),
        };
        let mut temperature_k = self.ambient.temperature_k;
        for row in 0..rows {
            let motion = recorded.motion_at(row as f64 + later);
            let instant = self.instant(chamber, recorded, (row, motion), temperature_k);
            let per_area = self.per_area(recorded, row, temperature_k);
            for (column, value) in one.per_area.iter_mut().zip(per_area) {
                column.push(value);
            }
            one.stroke_m3.push(instant.volume_m3 - dead_volume_m3);
            one.work_and_heat.push(instant.work_and_heat);
            let next = recorded.time_s.get(row + 1);
            let step_s = next.map_or(0.0, |next| next - recorded.time_s[row]);
            let grown = (step_s * instant.growth_per_s).clamp(-MOST_GROWTH, MOST_GROWTH);
            temperature_k =
                (temperature_k * (1.0 + grown)).clamp(TEMPERATURES_K.0, TEMPERATURES_K.1);
        }
        one
    }

    /// The balance (3) at one row, solved for the flow: the rate of the pressure is that of a
    /// parabola through its neighbours, which is enough for a temperature.
    fn instant(
        &self,
        chamber: &Chamber<f64>,
        recorded: &Recorded<'_>,
        (row, (position_m, velocity_m_s)): (usize, (f64, f64)),
        temperature_k: f64,
    ) -> Instant {
        let (geometry, gas) = (&chamber.geometry, &chamber.gas);
        let (gamma, constant) = (gas.heat_capacity_ratio, gas.gas_constant_j_per_kg_k);
        let scale = scale(chamber);
        let room_k = self.ambient.temperature_k;
        let volume_m3 = geometry.volume_m3(position_m);
        let outwards_m_s = geometry.length_per_position * velocity_m_s;
        let swept_m3_s = geometry.area_m2 * outwards_m_s;
        let pressure_pa = recorded.rate.position_m[row];
        let rate_pa_s = recorded.rate.velocity_m_per_s[row];
        let stored = (volume_m3 * rate_pa_s + gamma * pressure_pa * swept_m3_s) / scale;
        let heat_transfer = if stored >= 0.0 {
            chamber.heat_transfer_charging_w_per_m2_k
        } else {
            chamber.heat_transfer_discharging_w_per_m2_k
        };
        let heat_w = heat_transfer * geometry.surface_m2(position_m) * (room_k - temperature_k);
        let heat = (gamma - 1.0) * heat_w / scale;
        let inflow = stored - heat;
        let upstream_k = if inflow >= 0.0 { room_k } else { temperature_k };
        let mass_kg = pressure_pa * volume_m3 / (constant * temperature_k);
        Instant {
            volume_m3,
            work_and_heat: (gamma - 1.0) * recorded.own_pa[row] * swept_m3_s / scale - heat,
            growth_per_s: rate_pa_s / pressure_pa + swept_m3_s / volume_m3
                - inflow / upstream_k / mass_kg,
        }
    }

    /// T m' into the chamber through 1 m2, kg K/s: from the supply, from the surroundings, past the
    /// piston.
    fn per_area(&self, recorded: &Recorded<'_>, row: usize, temperature_k: f64) -> [f64; 3] {
        let room_k = self.ambient.temperature_k;
        let state = |pressure_pa: f64, temperature_k| GasState {
            pressure_pa,
            temperature_k,
        };
        let inside = state(recorded.own_pa[row], temperature_k);
        [
            self.carried(state(recorded.supply_pa[row], room_k), inside),
            self.carried(self.ambient, inside),
            self.carried(state(recorded.other_pa[row], room_k), inside),
        ]
    }

    /// T m' from one side to the inside through 1 m2, kg K/(s m2).
    fn carried(&self, outside: GasState<f64>, inside: GasState<f64>) -> f64 {
        let flow = self.law.flow(1.0, outside, inside).mass_flow_kg_per_s;
        let upstream = if flow >= 0.0 { outside } else { inside };
        flow * upstream.temperature_k
    }
}

/// A signal at a row that may lie between two; beyond its ends it stays.
pub(crate) fn at_row(signal: &[f64], row: f64) -> f64 {
    let last = signal.len().saturating_sub(1);
    let row = row.clamp(0.0, last as f64);
    let below = row.floor() as usize;
    let (above, along) = ((below + 1).min(last), row - row.floor());
    signal[below] + along * (signal[above] - signal[below])
}

impl Recorded<'_> {
    /// Whether it is this chamber.
    pub(super) fn is_of(&self, side: Side) -> bool {
        self.side == side
    }

    /// Position, m, and velocity, m/s, at a row that may lie between two.
    fn motion_at(&self, row: f64) -> (f64, f64) {
        (
            at_row(&self.motion.position_m, row),
            at_row(&self.motion.velocity_m_per_s, row),
        )
    }
}

impl ChamberRows {
    /// The largest distance of the command from a null, V.
    pub(super) fn widest_v(&self, null_v: f64) -> f64 {
        self.command_v
            .iter()
            .map(|command_v| (command_v - null_v).abs())
            .fold(0.0, f64::max)
    }

    /// The windows, half of one apart.
    pub(super) fn windows(&self, at: Alignment) -> Vec<Window> {
        let rows = self.time_s.len();
        let step_s = median_step_s(&self.time_s);
        let half = ((HALF_WINDOW_S / step_s).round() as usize).max(2);
        let command_v = self.felt_command_v(at, step_s);
        let earlier = match at.way {
            Way::Delayed => at.lag_s / step_s,
            Way::Followed => 0.0,
        };
        // The same windows whatever the lag, so that what they are off by can be compared.
        let margin = (MARGIN_S / step_s).ceil() as usize + half + 1;
        (margin..rows.saturating_sub(margin))
            .step_by(half)
            .filter_map(|centre| {
                let first = centre - half;
                let is_even =
                    self.time_s[centre + half] - self.time_s[first] < 2.5 * half as f64 * step_s;
                let command = (command_v.as_ref(), at.null_v, earlier);
                is_even.then(|| self.window(centre, half, step_s, command))
            })
            .collect()
    }

    fn window(
        &self,
        centre: usize,
        half: usize,
        step_s: f64,
        (command_v, null_v, earlier): (&[f64], f64, f64),
    ) -> Window {
        let mut window = Window {
            wanted: 0.0,
            per_dead_volume: 0.0,
            per_leak: 0.0,
            paths: Vec::with_capacity(2 * half),
            deviation: 0.0,
            noise: 0.0,
            stroke_m3: self.stroke_m3[centre],
        };
        let mut slope_squares = 0.0;
        for row in centre - half..=centre + half {
            let tau = (row as f64 - centre as f64) / half as f64;
            let bump = 1.0 - tau * tau;
            // The weight and its derivative, times the step.
            let weight = bump * bump * step_s;
            let slope = -4.0 * tau * bump / half as f64;
            let stored = -slope * self.pressure_pa[row] / self.scale;
            window.wanted += stored * self.stroke_m3[row] + weight * self.work_and_heat[row];
            window.per_dead_volume += stored;
            window.per_leak += weight * self.per_area[2][row];
            let opening_v = self.opening_v(at_row(command_v, row as f64 - earlier), null_v);
            window.paths.push((
                opening_v,
                weight * self.per_area[0][row],
                weight * self.per_area[1][row],
            ));
            slope_squares += slope * slope;
        }
        window.noise = self.noise_pa / self.scale * slope_squares.sqrt();
        let noise = window.noise * (window.stroke_m3 + self.dead_volume_m3);
        let flow = window.wanted + self.dead_volume_m3 * window.per_dead_volume;
        window.deviation = noise.hypot(BALANCE_ERROR * flow);
        window
    }

    /// The command as a spool that lags by so much has followed it, V.
    fn felt_command_v(&self, at: Alignment, step_s: f64) -> Cow<'_, [f64]> {
        let rate_per_s = 2.0 * SPOOL_DAMPING / at.lag_s;
        let per_step = rate_per_s * step_s;
        // A spool that follows within a row or two is one that follows at once.
        if at.way == Way::Delayed || per_step.is_nan() || per_step > 1.0 {
            return Cow::Borrowed(&self.command_v);
        }
        let mut place_v = self.command_v.first().copied().unwrap_or_default();
        let mut change_v = 0.0;
        let followed = self.command_v.iter().map(|command_v| {
            let here_v = place_v;
            // Semi-implicit steps, in units of a row.
            change_v +=
                per_step * (per_step * (command_v - place_v) - 2.0 * SPOOL_DAMPING * change_v);
            place_v += change_v;
            here_v
        });
        Cow::Owned(followed.collect())
    }

    /// Opening towards the supply at a command, V.
    fn opening_v(&self, command_v: f64, null_v: f64) -> f64 {
        if self.feeds_above_null {
            command_v - null_v
        } else {
            null_v - command_v
        }
    }
}
