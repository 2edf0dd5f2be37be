//! What is said of each axis, and of each group: what changed in it, the most pressing first.

use super::change::{Change, Shape, change, level};
use super::plan::{Night, Plan, job_name};
use super::series::{self, Axis, Series};
use super::store::Store;
use super::watched::{MISFIT, Watched, watched};
use std::collections::HashMap;

/// All that is said of a fleet.
#[derive(Debug)]
pub struct Summary<'p> {
    /// Groups that changed as a whole.
    pub groups: Vec<Changed>,
    /// Axes that changed by what matters, or will before long: the most pressing first.
    pub changed: Vec<(Axis<'p>, Changed)>,
    /// Axes that changed by less.
    pub slightly: Vec<(Axis<'p>, Changed)>,
    /// Axes that did not.
    pub steady: Vec<Axis<'p>>,
}

/// An axis or a group that changed.
#[derive(Clone, Debug)]
pub struct Changed {
    /// Its name.
    pub name: String,
    /// What changed, the plainest first: that is what is said; what follows may come of it.
    pub found: Vec<Found>,
}

/// A quantity that changed.
#[derive(Clone, Debug)]
pub struct Found {
    /// Over the nights.
    pub series: Series,
    /// How.
    pub change: Change,
}

impl Found {
    /// How large it is, in units of the size from which it matters.
    pub fn share(&self) -> f64 {
        self.change.size.abs() / self.series.matters
    }

    /// Whether it is of a group, and so in units of the size that matters.
    pub fn is_of_group(&self) -> bool {
        self.series.of_group
    }

    /// What a person calls it.
    pub fn title(&self) -> String {
        title(&self.series.key)
    }

    /// What changes where it does.
    pub fn physics(&self) -> &'static str {
        watched(&self.series.key).map_or("none of the quantities that are followed", |one| {
            one.physics
        })
    }

    /// Days from the last night until it matters if it goes on so; none where it does already, or
    /// does not grow.
    pub fn days_until_it_matters(&self) -> Option<f64> {
        let last = self.series.points.last()?.day;
        let gone = last - self.change.onset_day;
        let grows = self.change.shape == Shape::Ramp && self.share() < 1.0 && gone > 0.0;
        grows.then(|| gone * (1.0 / self.share() - 1.0))
    }
}

impl Found {
    /// Whether it matters, or comes to within as many days as were recorded if it goes on so.
    fn is_pressing(&self) -> bool {
        let points = &self.series.points;
        let ends = points.first().zip(points.last());
        let recorded = ends.map_or(0.0, |(first, last)| last.day - first.day);
        self.share() >= 1.0
            || self
                .days_until_it_matters()
                .is_some_and(|days| days <= recorded)
    }
}

/// What a person calls a key.
pub fn title(key: &str) -> String {
    if let Some(signal) = key.strip_prefix(MISFIT) {
        return format!("misfit of the {}", crate::signals::titled(signal));
    }
    watched(key).map_or_else(|| key.to_owned(), |one: &Watched| one.title.to_owned())
}

/// Judges a fleet by the results that are there.
pub fn summary<'p>(plan: &'p Plan, store: &Store) -> Summary<'p> {
    let mut axes = series::axes(plan, store);
    let groups = series::apart(&mut axes);
    let mut levels = Levels {
        a_year: plan.false_alarms_per_axis_year,
        known: HashMap::new(),
    };
    let of_group = |(name, series): (String, Vec<Series>)| levels.changed(name, series);
    let groups = groups.into_iter().filter_map(of_group).collect();
    let (mut changed, mut steady) = (Vec::new(), Vec::new());
    for axis in axes {
        match levels.changed(axis.plan.name.clone(), axis.series.clone()) {
            Some(found) => changed.push((axis, found)),
            None => steady.push(axis),
        }
    }
    let pressing = |changed: &Changed| changed.found[0].share();
    changed.sort_by(|one, other| pressing(&other.1).total_cmp(&pressing(&one.1)));
    let (changed, slightly) = changed
        .into_iter()
        .partition(|(_, one): &(Axis<'_>, Changed)| one.found[0].is_pressing());
    Summary {
        groups,
        changed,
        slightly,
        steady,
    }
}

/// The night that a verdict on a changed axis reads, and its job: the latest sound one.
pub fn night_for_verdict<'p>(axis: &Axis<'p>) -> Option<(&'p Night, String)> {
    let faulty = |place: usize| axis.faults.iter().any(|fault| fault.0 == place);
    let nights = axis.plan.nights.iter().enumerate().rev();
    let (_, night) = nights.into_iter().find(|(place, _)| !faulty(*place))?;
    let works_on = [axis.plan.reference_job.as_str(), &night.recording.sha256];
    Some((night, job_name("verdict", &works_on)))
}

/// From which statistic on a change is one, by the days of a series: drawing that takes a while.
struct Levels {
    a_year: f64,
    known: HashMap<(Vec<u64>, usize), f64>,
}

const DAYS_A_YEAR: f64 = 365.25;

impl Levels {
    /// The level for one of so many series, for all of them together to alarm as often as stated.
    fn of(&mut self, series: &Series, among: usize) -> f64 {
        let days: Vec<f64> = series.points.iter().map(|one| one.day).collect();
        let years = (days[days.len() - 1] - days[0]) / DAYS_A_YEAR;
        let probability = self.a_year * years / among as f64;
        let key = (days.iter().map(|day| day.to_bits()).collect(), among);
        *self
            .known
            .entry(key)
            .or_insert_with(|| level(&days, probability))
    }

    fn changed(&mut self, name: String, all: Vec<Series>) -> Option<Changed> {
        let among = all.len();
        let told = all.into_iter().filter(|series| series.points.len() > 1);
        let mut found: Vec<Found> = told
            .filter_map(|series| {
                let level = self.of(&series, among);
                let change = change(&series.points, level)?;
                Some(Found { series, change })
            })
            .collect();
        found.sort_by(|one, other| other.change.statistic.total_cmp(&one.change.statistic));
        (!found.is_empty()).then_some(Changed { name, found })
    }
}

/// What `pneuma fleet report --json` writes of a change: sizes in the unit of the key.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Said {
    /// The axis, or the group.
    pub name: String,
    /// Whether it is a group's.
    pub of_group: bool,
    /// The key.
    pub quantity: String,
    /// What changes where it does.
    pub physics: &'static str,
    /// What it was; nought of a group.
    pub was: f64,
    /// By how much it is off now.
    pub size: f64,
    /// One standard deviation of that.
    pub standard_deviation: f64,
    /// From which change on it matters.
    pub matters_from: f64,
    /// The last day without it, since the first night.
    pub onset_day: f64,
    /// Between which days the onset lies, 95 %.
    pub onset_days: [f64; 2],
    /// The day on which it is seen.
    pub seen_day: f64,
    /// The statistic of the change.
    pub statistic: f64,
}

impl Summary<'_> {
    /// Every change, the plainest of an axis first.
    pub fn said(&self) -> Vec<Said> {
        let of_groups = self.groups.iter().map(|group| (group, true));
        let of_axes = self
            .changed
            .iter()
            .chain(&self.slightly)
            .map(|(_, changed)| (changed, false));
        let one = |(changed, of_group): (&Changed, bool)| {
            let said = |found: &Found| Said {
                name: changed.name.clone(),
                of_group,
                quantity: found.series.key.clone(),
                physics: found.physics(),
                was: found.change.was,
                size: found.change.size,
                standard_deviation: found.change.standard_deviation,
                matters_from: found.series.matters,
                onset_day: found.change.onset_day,
                onset_days: found.change.onset_days,
                seen_day: found.change.seen_day,
                statistic: found.change.statistic,
            };
            changed.found.iter().map(said).collect::<Vec<Said>>()
        };
        of_groups.chain(of_axes).flat_map(one).collect()
    }
}
