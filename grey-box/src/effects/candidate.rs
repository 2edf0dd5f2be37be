//! An effect as something to try: numbers to set and parameters to free.

use super::mark::Mark;
use crate::fit::free_parameter::{FreeParameter, Scope};
use crate::fit::levenberg_marquardt::{Parameter, Prior};
use crate::rig::Rig;

/// One effect in one form at one place.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// Name of the effect, as in the verdict.
    pub effect: &'static str,
    /// Which form of it, where there are several.
    pub form: Option<&'static str>,
    /// Where it acts.
    pub places: Vec<&'static str>,
    /// Numbers that are set while it is in the model.
    pub switches: Vec<(String, f64)>,
    /// Parameters that are free while it is in the model.
    pub free: Vec<FreeParameter>,
    /// Starting points: one value per free parameter each.
    pub starts: Vec<Vec<f64>>,
    /// Its parameters, by key, and from which sizes on it matters: none where it always does.
    pub marks: Vec<(String, Mark)>,
    /// Whether the residuals jump with its parameters: derivatives mislead there,
    /// and a search by values goes on where they end.
    pub is_rough: bool,
    /// Whether it is nothing while the carriage moves: break-aways alone show it.
    pub is_of_rests: bool,
    /// Where something begins or ends in it.
    pub edge: Option<Edge>,
    /// The uncertain numbers that take it up, each as much as it is large, where it is there all
    /// the time: then it is tried for a part of the time, and where the first of these numbers
    /// comes out far from what the rig states.
    pub taken_up_by: Vec<String>,
    /// The numbers that mean something else while it is in the model, so that what the rig states
    /// of them binds them no longer.
    pub voids: Vec<String>,
}

/// A parameter that says where something begins or ends: derivatives see it in the few rows at
/// that edge alone.
#[derive(Clone, Debug, PartialEq)]
pub struct Edge {
    /// Its key.
    pub key: String,
    /// A step that the rows at the edge can tell, SI.
    pub step: f64,
}

impl Candidate {
    /// An effect at its places, with nothing free yet.
    pub fn new(effect: &'static str, places: &[&'static str]) -> Self {
        Self {
            effect,
            form: None,
            places: places.to_vec(),
            switches: Vec::new(),
            free: Vec::new(),
            starts: vec![Vec::new()],
            marks: Vec::new(),
            is_rough: false,
            is_of_rests: false,
            edge: None,
            taken_up_by: Vec::new(),
            voids: Vec::new(),
        }
    }

    /// What a person calls it: effect, form and place.
    pub fn title(&self) -> String {
        let form = self
            .form
            .map(|form| format!(" ({form})"))
            .unwrap_or_default();
        format!("{}{form} at {}", self.effect, self.places.join(" and "))
    }

    /// Whether it is the same effect, in the same form, at another place.
    pub fn is_twin_of(&self, other: &Self) -> bool {
        (self.effect, self.form) == (other.effect, other.form) && self.places != other.places
    }

    /// Whether it is in what the sensors say and not in the axis.
    pub fn is_of_sensors(&self) -> bool {
        self.places.iter().all(|place| place.starts_with("sensor."))
    }

    /// Beside numbers that the rig states.
    #[must_use]
    pub fn beside(mut self, rig: &Rig, keys: &[&str]) -> Self {
        let is_uncertain = |key: &str| rig.uncertainty_sd(key).is_some();
        if keys.first().is_some_and(|key| is_uncertain(key)) {
            let uncertain = keys.iter().filter(|key| is_uncertain(key));
            self.taken_up_by = uncertain.map(|key| (*key).to_owned()).collect();
        }
        self
    }

    /// In the place of what the rig states of these numbers.
    #[must_use]
    pub fn voiding(mut self, keys: &[&str]) -> Self {
        self.voids = keys.iter().map(|key| (*key).to_owned()).collect();
        self
    }

    /// Its residuals jump.
    #[must_use]
    pub fn rough(mut self) -> Self {
        self.is_rough = true;
        self
    }

    /// Break-aways alone show it.
    #[must_use]
    pub fn of_rests(mut self) -> Self {
        self.is_of_rests = true;
        self
    }

    /// In this form.
    #[must_use]
    pub fn form(mut self, form: &'static str) -> Self {
        self.form = Some(form);
        self
    }

    /// With a number set.
    #[must_use]
    pub fn switch(mut self, parameter: &str, value: f64) -> Self {
        self.switches
            .push((format!("effects.{}.{parameter}", self.effect), value));
        self
    }

    /// A table: its ends, which stay, and its values, which begin at nought and are held
    /// to within `size` where nothing was recorded.
    pub fn table(
        effect: &'static str,
        place: &'static str,
        ends: &[(&str, f64)],
        values: &[String],
        size: f64,
    ) -> Self {
        let prior = Prior {
            mean: 0.0,
            standard_deviation: size,
        };
        let bounds = (-100.0 * size, 100.0 * size);
        let begun = ends
            .iter()
            .fold(Self::new(effect, &[place]), |table, (key, end)| {
                table.switch(key, *end)
            });
        values.iter().fold(begun, |table, key| {
            table.free_as(key, Scope::Shared, bounds, Some(prior), &[0.0])
        })
    }

    /// The parameter that came last is an edge.
    #[must_use]
    pub fn edge(mut self, step: f64) -> Self {
        self.edge = self.free.last().map(|free| Edge {
            key: free.key.clone(),
            step,
        });
        self
    }

    /// The parameter that came last matters from here on; `None`: of any size.
    #[must_use]
    pub fn matters(mut self, mark: Option<Mark>) -> Self {
        let last = self.free.last().map(|free| free.key.clone());
        self.marks.extend(last.zip(mark));
        self
    }

    /// A parameter with its box and its starts. Starts of several parameters
    /// go together: the first with the first, and so on (the last is repeated).
    #[must_use]
    pub fn free(self, parameter: &str, bounds: (f64, f64), starts: &[f64]) -> Self {
        self.free_as(parameter, Scope::Shared, bounds, None, starts)
    }

    /// The same with a scope and a prior.
    #[must_use]
    pub fn free_as(
        mut self,
        parameter: &str,
        scope: Scope,
        (lower, upper): (f64, f64),
        prior: Option<Prior>,
        starts: &[f64],
    ) -> Self {
        let scale = starts
            .iter()
            .fold(0.0_f64, |most, start| most.max(start.abs()));
        let first = starts.first().copied().unwrap_or(0.0);
        self.free.push(FreeParameter {
            key: format!("effects.{}.{parameter}", self.effect),
            scope,
            parameter: Parameter {
                start: first,
                lower,
                upper,
                prior,
                scale: if scale > 0.0 { scale } else { 1.0 },
            },
        });
        let count = self.starts.len().max(starts.len());
        let at = |index: usize| starts.get(index).or(starts.last()).copied();
        self.starts = (0..count)
            .map(|index| {
                let mut point = self.starts[index.min(self.starts.len() - 1)].clone();
                point.push(at(index).unwrap_or(first));
                point
            })
            .collect();
        self
    }
}
