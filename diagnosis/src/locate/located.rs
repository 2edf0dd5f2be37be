//! Where a model parts from the recordings.

use serde::Serialize;

/// The variable that is the same in every recording.
pub(crate) const SINCE_START: &str = "time since start";

/// Where one predicted signal parts from the recorded one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Located {
    /// Place in the axis, as in a verdict.
    pub place: &'static str,
    /// The signal.
    pub signal: &'static str,
    /// Its SI unit.
    pub unit: &'static str,
    /// RMS residual, SI.
    pub rms: f64,
    /// Standard deviation of the recorded signal, SI.
    pub spread: f64,
    /// Part of the law's misfit, each output counted in its own spread.
    pub share: f64,
    /// Mean residual, SI.
    pub mean: f64,
    /// Stretches of misfit: recording, first and last instant.
    pub intervals: Vec<(String, f64, f64)>,
    /// Part of the sum of squares inside of the intervals.
    pub interval_share: f64,
    /// Part of the time inside of the intervals.
    pub interval_time: f64,
    /// What was looked at over the variables: the signal, or a force.
    pub quantity: &'static str,
    /// Its unit.
    pub quantity_unit: &'static str,
    /// Variables, the one that explains most first.
    pub variables: Vec<VariableShare>,
    /// The finding as a phrase.
    pub when: String,
}

/// What one variable explains of a residual.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VariableShare {
    /// The variable.
    pub name: &'static str,
    /// Its unit, SI.
    pub unit: &'static str,
    /// Part of the residual's energy that goes with it: the larger of the two below.
    pub eta_squared: f64,
    /// Part that the bins' means explain.
    pub of_value: f64,
    /// Part that the bins' mean sizes explain, sign left out.
    pub of_size: f64,
    /// Whether that is more than chance gives.
    pub significant: bool,
    /// The bins, by the variable.
    pub bins: Vec<Bin>,
}

/// The residual where a variable lies in one interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bin {
    /// Mean of the variable.
    pub x: f64,
    /// Mean of the residual.
    pub mean: f64,
    /// Standard deviation of the residual.
    pub sd: f64,
    /// Rows.
    pub count: usize,
}

impl Bin {
    fn mean_square(&self) -> f64 {
        self.mean * self.mean + self.sd * self.sd
    }

    fn energy(&self) -> f64 {
        self.mean_square() * self.count as f64
    }
}

impl Located {
    /// The variable that explains most, if it explains more than chance.
    pub fn leading(&self) -> Option<&VariableShare> {
        self.variables
            .first()
            .filter(|variable| variable.significant)
    }
}

impl VariableShare {
    /// Part of the energy in the bins up to each bin's end, with the part of the rows.
    pub(crate) fn cumulative(&self) -> Vec<(f64, f64)> {
        let energy: f64 = self.bins.iter().map(Bin::energy).sum();
        let rows: usize = self.bins.iter().map(|bin| bin.count).sum();
        let (mut sum, mut count) = (0.0, 0);
        self.bins
            .iter()
            .map(|bin| {
                sum += bin.energy();
                count += bin.count;
                (
                    sum / energy.max(f64::MIN_POSITIVE),
                    count as f64 / rows.max(1) as f64,
                )
            })
            .collect()
    }

    /// RMS of the residual in each bin.
    pub(crate) fn sizes(&self) -> Vec<f64> {
        self.bins
            .iter()
            .map(|bin| bin.mean_square().sqrt())
            .collect()
    }
}

/// What a residual is like where no variable explains it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sameness {
    /// Its mean is most of it.
    pub offset: bool,
    /// It changes over many rows.
    pub drifts: bool,
}
