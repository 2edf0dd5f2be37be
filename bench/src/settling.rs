//! A pressure that settles at constant mass, while the gas takes the temperature of the wall.
//!
//! ```text
//! p(t) = P + k L(t) + a exp(-(t - t0)/tau)
//! ```
//!
//! P is what the gas has at the wall's temperature at the reference time, k L a leak, tau the heat capacity of the gas
//! over the conductance to the wall: at constant mass and heat transfer this is the exact answer
//! of the energy balance. L is the course of the leak, nought at the reference time: the time
//! itself, or what the shut paths of a valve let through at the recorded pressures
//! ([`Leak`]). Whether there is a leak is decided by Schwarz's criterion. A leak keeps
//! the gas off the wall's temperature: what flows in is compressed, `m' R T = h S (T - T_wall)`,
//! with `m' R T = V s`, s the drift once settled, and `h S = m cv/tau`
//!
//! ```text
//! (T - T_wall)/T = (gamma - 1) s tau/P
//! ```
//!
//! and the pressure at the wall's temperature is lower by this part. What leaks while the pressure is
//! still far off is known to a part of its size only: of `s tau` that part goes into the deviation
//! of a pressure that is extrapolated back there. Where heat transfer at rest
//! changes on the way, the first rows do not settle at one rate; so many of them are left out that
//! the rest does.

use grey_box::fit::Parameter;

use crate::least_squares::{Solved, correlation_length, fitted};

/// A fit whose mean square is beyond one by more than this many of its deviations, `sqrt(2/n)`, is
/// none ...
const MISFIT_DEVIATIONS: f64 = 5.0;
/// ... and this part of the rows is left out at the begin.
const LEFT_OUT: f64 = 0.2;
/// Time constants of an extrapolation, as parts of the rows' time.
const SHORTEST_SHARE: f64 = 0.08;
const LONGEST_SHARE: f64 = 20.0;
/// Fewest rows that a settling is read from.
const LEAST_ROWS: usize = 30;
/// So many rows say all that more of them say; the fit takes means of more.
const MOST_ROWS: usize = 400;

/// The course of a leak.
#[derive(Clone, Debug)]
pub struct Leak {
    /// What has leaked in until each row since the first one, as a pressure of the settled gas, up to
    /// a factor.
    pub course_pa: Vec<f64>,
    /// How far what has leaked may be off that course, as a part of it: one deviation.
    pub error: f64,
}

/// A leak that stays the same though the pressure changes: known to its own size.
const STEADY_ERROR: f64 = 1.0;

impl Leak {
    /// The same all the time.
    pub fn steady(time_s: &[f64]) -> Self {
        Self {
            course_pa: time_s.to_vec(),
            error: STEADY_ERROR,
        }
    }
}

/// A settled pressure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settled {
    /// The pressure of the gas at the wall's temperature, at the reference time, Pa.
    pub pressure_pa: f64,
    /// One standard deviation, Pa.
    pub deviation_pa: f64,
    /// Time in which it settles, s.
    pub time_constant_s: f64,
    /// Its deviation, s.
    pub time_constant_deviation_s: f64,
    /// What the pressure has above the settled one at the first row, Pa.
    pub above_pa: f64,
    /// Drift once settled, Pa/s.
    pub drift_pa_per_s: f64,
}

/// Reads a settling; `noise_pa` is that of a row, `heat_ratio` the gas' gamma. The reference time is
/// the first row or the last one.
///
/// # Errors
/// If the rows are too few or do not settle.
pub fn settled(
    time_s: &[f64],
    pressure_pa: &[f64],
    (leak, reference): (&Leak, Reference),
    (noise_pa, heat_ratio): (f64, f64),
) -> Result<Settled, String> {
    if time_s.len() < LEAST_ROWS {
        return Err(format!(
            "{} rows are too few for a pressure that settles: {LEAST_ROWS} at least",
            time_s.len()
        ));
    }
    let at = match reference {
        Reference::Begin => 0,
        Reference::End => time_s.len() - 1,
    };
    let leaked_pa: Vec<f64> = leak
        .course_pa
        .iter()
        .map(|one| one - leak.course_pa[at])
        .collect();
    let mut means = Means::of(time_s, pressure_pa, &leaked_pa, noise_pa);
    let (mut solved, mut left) = means.best()?;
    while left.iter().map(|one| one * one).sum::<f64>() > most_squares(left.len())
        && means.time_s.len() > LEAST_ROWS
    {
        means.leave_out_first();
        let Ok(next) = means.best() else {
            break;
        };
        (solved, left) = next;
    }
    let correlated = correlation_length(&left).sqrt();
    let time_constant_s = solved.values[2];
    let drift_pa_per_s = solved.values[3] * means.last_leak_pa_per_s();
    let shown_pa = solved.values[0];
    let not_settled = (-(time_s[at] - means.time_s[0]) / time_constant_s)
        .exp()
        .min(1.0);
    let leaked_pa = drift_pa_per_s * time_constant_s * not_settled;
    let warmer = (heat_ratio - 1.0) * drift_pa_per_s * time_constant_s / shown_pa;
    Ok(Settled {
        pressure_pa: shown_pa / (1.0 + warmer),
        deviation_pa: (solved.deviations[0] * correlated).hypot(leaked_pa),
        time_constant_s,
        time_constant_deviation_s: solved.deviations[2] * correlated,
        above_pa: solved.values[1],
        drift_pa_per_s,
    })
}

/// Of which row the settled pressure is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reference {
    /// The first.
    Begin,
    /// The last.
    End,
}

/// The pressure at a time shortly before the first row, and its deviation: for that an exponential
/// of any constants does.
///
/// # Errors
/// If the rows are too few.
pub fn extrapolated(
    time_s: &[f64],
    pressure_pa: &[f64],
    at_s: f64,
    noise_pa: f64,
) -> Result<(f64, f64), String> {
    let (Some(first), Some(last)) = (pressure_pa.first(), pressure_pa.last()) else {
        return Err("nothing was recorded after the stop".into());
    };
    let span_s = time_s[time_s.len() - 1] - time_s[0];
    let residuals = |numbers: &[f64]| -> Vec<f64> {
        let rows = time_s.iter().zip(pressure_pa);
        rows.map(|(time, pressure)| {
            let grown = (-(time - at_s) / numbers[2]).exp_m1();
            (pressure - numbers[0] - numbers[1] * grown) / noise_pa
        })
        .collect()
    };
    let parameters = [
        Parameter::new(*first),
        Parameter::new(first - last).with_scale(0.01 * first.abs()),
        Parameter::new(span_s).bounded(SHORTEST_SHARE * span_s, LONGEST_SHARE * span_s),
    ];
    Ok(fitted(&parameters, &residuals)?.at(0))
}

/// The largest sum of squares of so many residuals that a right law leaves.
fn most_squares(rows: usize) -> f64 {
    let rows = rows as f64;
    rows + MISFIT_DEVIATIONS * (2.0 * rows).sqrt()
}

/// Means of rows: short at the begin, where the pressure changes, long at the end.
struct Means {
    time_s: Vec<f64>,
    leaked_pa: Vec<f64>,
    pressure_pa: Vec<f64>,
    deviation_pa: Vec<f64>,
}

impl Means {
    fn of(time_s: &[f64], pressure_pa: &[f64], leaked_pa: &[f64], noise_pa: f64) -> Self {
        let size = time_s.len().div_ceil(MOST_ROWS);
        let means = |all: &[f64]| all.chunks(size).map(crate::steady::mean).collect();
        let deviation = |rows: &[f64]| noise_pa / (rows.len() as f64).sqrt();
        Self {
            time_s: means(time_s),
            leaked_pa: means(leaked_pa),
            pressure_pa: means(pressure_pa),
            deviation_pa: time_s.chunks(size).map(deviation).collect(),
        }
    }

    /// How fast the course of the leak goes on at the end.
    fn last_leak_pa_per_s(&self) -> f64 {
        let tail = self.time_s.len() / 2;
        crate::steady::slope(&self.time_s[tail..], &self.leaked_pa[tail..])
    }

    fn leave_out_first(&mut self) {
        let from = (LEFT_OUT * self.time_s.len() as f64).ceil() as usize;
        for column in [
            &mut self.time_s,
            &mut self.pressure_pa,
            &mut self.deviation_pa,
        ] {
            column.drain(..from);
        }
    }

    /// The better law of with and without a leak, and what it leaves.
    fn best(&self) -> Result<(Solved, Vec<f64>), String> {
        let tight = self.fit(false)?;
        let leaking = self.fit(true)?;
        let best = if leaking.bic() < tight.bic() {
            leaking
        } else {
            tight
        };
        let left = self.residuals(&best.values);
        Ok((best, left))
    }

    fn residuals(&self, numbers: &[f64]) -> Vec<f64> {
        let from_s = self.time_s[0];
        let law_pa = |row: usize| {
            let decay = (-(self.time_s[row] - from_s) / numbers[2]).exp();
            numbers[0] + numbers[1] * decay + numbers[3] * self.leaked_pa[row]
        };
        (0..self.time_s.len())
            .map(|row| (self.pressure_pa[row] - law_pa(row)) / self.deviation_pa[row])
            .collect()
    }

    fn fit(&self, leaks: bool) -> Result<Solved, String> {
        let (first, last) = (
            self.pressure_pa[0],
            self.pressure_pa[self.pressure_pa.len() - 1],
        );
        let span_s = self.time_s[self.time_s.len() - 1] - self.time_s[0];
        let most_pa = self
            .leaked_pa
            .iter()
            .map(|one| one.abs())
            .fold(f64::MIN_POSITIVE, f64::max);
        let slope = Parameter::new(0.0).with_scale(0.01 * first.abs() / most_pa);
        let slope = if leaks {
            slope
        } else {
            slope.bounded(0.0, 0.0)
        };
        let residuals = |numbers: &[f64]| self.residuals(numbers);
        let mut best: Option<Solved> = None;
        for part in [0.05, 0.2] {
            let parameters = [
                Parameter::new(last),
                Parameter::new(first - last).with_scale(0.01 * first.abs()),
                Parameter::new(part * span_s).bounded(2e-3 * span_s, span_s),
                slope,
            ];
            let solved = fitted(&parameters, &residuals)?;
            if best
                .as_ref()
                .is_none_or(|best| solved.squares < best.squares)
            {
                best = Some(solved);
            }
        }
        best.filter(|best| best.deviations[0].is_finite())
            .ok_or_else(|| "the pressure does not settle within the recording".into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_the_settled_pressure_of_a_leaking_vessel_is_found_within_its_deviation() {
        let mut within = 0;
        for seed in 0..40 {
            let mut noise = grey_box::random::Noise::new(seed, 0);
            let time_s: Vec<f64> = (0..6000).map(|row| f64::from(row) * 1e-3).collect();
            let pressure: Vec<f64> = time_s
                .iter()
                .map(|time| 4e5 + 3e4 * (-time / 0.7).exp() - 150.0 * time + 250.0 * noise.normal())
                .collect();
            let found = settled(
                &time_s,
                &pressure,
                (&Leak::steady(&time_s), Reference::Begin),
                (250.0, 1.4),
            )
            .expect("settles");
            // The leak cools the gas that stays.
            let true_pa = 4e5 / (1.0 - 0.4 * 150.0 * 0.7 / 4e5);
            assert!(
                (found.pressure_pa - true_pa).abs() < 4.0 * found.deviation_pa,
                "{found:?}"
            );
            within += usize::from((found.pressure_pa - true_pa).abs() < 2.0 * found.deviation_pa);
        }
        assert!(within >= 35, "{within} of 40 within two deviations");
    }
}
