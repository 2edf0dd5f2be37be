//! A sensor's first-order lag between two samples.

use model_core::real::Real;

/// What a sensor shows at the end of a step: the solution of
/// `lag dy/dt = u - y` for a signal that is linear from `from` to `to`. A signal
/// held at its end over the step would make every lag look half a step longer.
pub fn followed<R: Real>(shown: R, (from, to): (R, R), lag_s: R, step_s: R) -> R {
    if lag_s <= R::ZERO {
        return to;
    }
    let behind = (to - from) * lag_s / step_s;
    to - behind + (shown - from + behind) * (-(step_s / lag_s)).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Known answers: a ramp is followed `lag` behind, a step approached by `1/e`.
    #[test]
    fn val_ramp_and_step_are_followed_as_the_solution_says() {
        let (lag_s, step_s) = (5e-3_f64, 1e-3);
        let mut ramp = 0.0;
        for row in 0..100 {
            let from = f64::from(row);
            ramp = followed(ramp, (from, from + 1.0), lag_s, step_s);
        }
        assert!((ramp - (100.0 - lag_s / step_s)).abs() < 1e-6, "{ramp}");
        let step = (0..5).fold(0.0, |shown, _| followed(shown, (1.0, 1.0), lag_s, step_s));
        assert!((step - (1.0 - (-1.0_f64).exp())).abs() < 1e-12, "{step}");
    }

    /// The same however finely it is divided.
    #[test]
    fn prop_ten_steps_are_one() {
        let whole = followed(0.3, (1.0, 2.0), 2e-3, 1e-3);
        let tenths = (0..10).fold(0.3, |shown, part| {
            let at = |part: i32| 1.0 + 0.1 * f64::from(part);
            followed(shown, (at(part), at(part + 1)), 2e-3, 1e-4)
        });
        assert!((whole - tenths).abs() < 1e-12, "{whole} and {tenths}");
        assert!((followed(0.3, (1.0, 2.0), 0.0, 1e-3) - 2.0).abs() < 1e-15);
    }
}
