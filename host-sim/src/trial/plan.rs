//! Which cases a trial holds: a plan that is balanced over what may be missing.
//!
//! Streams of cases (single effects, pairs, nothing, ...) are dealt by their
//! weights, so that every beginning of the plan is about as balanced as the
//! whole. The stream of single effects goes through every effect at every
//! strength before one comes again.

use super::digest;
use crate::effects;
use serde::{Deserialize, Serialize};
use std::fmt;
use truth_plant::{Kind, Nature, Request, Strength};

/// How the truth is concealed beyond its label.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Concealment {
    /// The label alone is hidden.
    Hidden,
    /// The rig file's numbers were fitted to the affected recordings first.
    Masked,
    /// The sensors' noise is this many times what it usually is.
    Noisy(f64),
    /// The effect is present in a part of the time only.
    Brief,
}

/// A row of the scorecard.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Class {
    /// One strong effect.
    Strong,
    /// One medium effect.
    Medium,
    /// One weak effect.
    Weak,
    /// Two effects.
    Pair,
    /// One effect, masked by a fit.
    Masked,
    /// One effect under more noise.
    Noisy,
    /// One effect for a part of the time.
    Brief,
    /// An effect of the list in another form.
    OtherForm,
    /// An effect of no list.
    OffList,
    /// Nothing.
    Nothing,
    /// Nothing but wrong numbers.
    Parameters,
    /// Several immaterial effects.
    Immaterial,
    /// An effect that the recordings cannot show.
    Unobservable,
}

impl Class {
    /// All rows, in the order in which they are shown.
    pub const ALL: [Self; 13] = [
        Self::Strong,
        Self::Medium,
        Self::Weak,
        Self::Pair,
        Self::Masked,
        Self::Noisy,
        Self::Brief,
        Self::OtherForm,
        Self::OffList,
        Self::Nothing,
        Self::Parameters,
        Self::Immaterial,
        Self::Unobservable,
    ];

    /// In words.
    pub fn title(self) -> &'static str {
        match self {
            Self::Strong => "one strong effect",
            Self::Medium => "one medium effect",
            Self::Weak => "one weak effect",
            Self::Pair => "two effects",
            Self::Masked => "one effect, masked by a fit",
            Self::Noisy => "one effect under noise",
            Self::Brief => "one effect, part of the time",
            Self::OtherForm => "another form of an effect",
            Self::OffList => "an effect of no list",
            Self::Nothing => "nothing missing",
            Self::Parameters => "only numbers wrong",
            Self::Immaterial => "only small dirt",
            Self::Unobservable => "an effect that cannot show",
        }
    }
}

/// One case of the plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Planned {
    /// Position in the plan, from 0.
    pub number: usize,
    /// What the generator draws from.
    pub seed: u64,
    /// Its kind.
    pub kind: Kind,
    /// The effect that it must hold, if that is prescribed.
    pub effect: Option<String>,
    /// The strength that its effects must have, if that is prescribed.
    pub strength: Option<Strength>,
    /// Multiplier of the sensors' noise.
    pub noise: f64,
    /// How its truth is concealed.
    pub concealment: Concealment,
    /// Where its rig stands.
    #[serde(default)]
    pub nature: Nature,
}

impl Planned {
    /// The case as the generator is asked for it. `None` if the generator has
    /// no such effect.
    pub fn request(&self) -> Option<Request> {
        let request = Request::new(self.seed, self.kind).with_nature(self.nature);
        let mut request = request.with_noise(self.noise);
        if let Some(effect) = &self.effect {
            request = request.with_effect(effect).ok()?;
        }
        if let Some(strength) = self.strength {
            request = request.with_strength(strength);
        }
        Some(request)
    }

    /// Its row of the scorecard.
    pub fn class(&self) -> Class {
        match (self.concealment, self.kind) {
            (Concealment::Masked, _) => Class::Masked,
            (Concealment::Noisy(_), _) => Class::Noisy,
            (_, Kind::Onset) => Class::Brief,
            (_, Kind::Pair) => Class::Pair,
            (_, Kind::OtherForm) => Class::OtherForm,
            (_, Kind::OffList) => Class::OffList,
            (_, Kind::Nothing) => Class::Nothing,
            (_, Kind::Parameters) => Class::Parameters,
            (_, Kind::Dirty) => Class::Immaterial,
            (_, Kind::Unobservable) => Class::Unobservable,
            (_, Kind::Single) => match self.strength {
                Some(Strength::Weak) => Class::Weak,
                Some(Strength::Medium) => Class::Medium,
                _ => Class::Strong,
            },
        }
    }

    /// The name of its folder, which tells nothing of what is in it.
    pub fn folder(&self) -> String {
        format!("case-{:04}", self.number)
    }
}

impl fmt::Display for Planned {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} ({})", self.folder(), self.class().title())
    }
}

/// What a trial is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Setting {
    /// The seed that everything follows from.
    pub seed: u64,
    /// Cases of this kind only.
    pub kind: Option<Kind>,
    /// Where the rigs stand.
    #[serde(default)]
    pub nature: Nature,
}

/// A stream of cases of one sort.
struct Stream {
    kind: Kind,
    concealment: Concealment,
    /// Cases out of a hundred: in the laboratory, and on the shop floor, where false alarms are
    /// what matters.
    weights: [usize; 2],
    choice: Choice,
}

/// What a stream prescribes.
#[derive(Clone, Copy)]
enum Choice {
    /// Every effect of the list at every strength, in turn.
    Listed,
    /// Every effect of no list at every strength, in turn.
    OffList,
    /// Every strength in turn.
    Strengths,
    /// Nothing.
    Drawn,
}

const STRENGTHS: [Strength; 3] = [Strength::Weak, Strength::Medium, Strength::Strong];

const STREAMS: [Stream; 12] = [
    stream(Kind::Single, Concealment::Hidden, [34, 36], Choice::Listed),
    stream(Kind::Single, Concealment::Masked, [8, 6], Choice::Listed),
    stream(
        Kind::Single,
        Concealment::Noisy(3.0),
        [5, 3],
        Choice::Listed,
    ),
    stream(
        Kind::Single,
        Concealment::Noisy(10.0),
        [5, 0],
        Choice::Listed,
    ),
    stream(Kind::Onset, Concealment::Brief, [9, 7], Choice::Strengths),
    stream(Kind::Pair, Concealment::Hidden, [9, 7], Choice::Strengths),
    stream(
        Kind::OtherForm,
        Concealment::Hidden,
        [5, 3],
        Choice::Strengths,
    ),
    stream(Kind::OffList, Concealment::Hidden, [8, 8], Choice::OffList),
    stream(Kind::Nothing, Concealment::Hidden, [5, 14], Choice::Drawn),
    stream(
        Kind::Parameters,
        Concealment::Hidden,
        [5, 12],
        Choice::Drawn,
    ),
    stream(Kind::Dirty, Concealment::Hidden, [4, 4], Choice::Drawn),
    stream(
        Kind::Unobservable,
        Concealment::Hidden,
        [3, 0],
        Choice::Drawn,
    ),
];

const fn stream(
    kind: Kind,
    concealment: Concealment,
    weights: [usize; 2],
    choice: Choice,
) -> Stream {
    Stream {
        kind,
        concealment,
        weights,
        choice,
    }
}

/// The plan of the first cases of a trial; a longer plan begins with the same.
pub fn plan(setting: Setting, cases: usize) -> Vec<Planned> {
    let streams: Vec<&Stream> = STREAMS
        .iter()
        .filter(|stream| setting.kind.is_none_or(|kind| stream.kind == kind))
        .filter(|stream| stream.weight(setting.nature) > 0)
        .collect();
    let mut dealt = vec![0; streams.len()];
    (0..cases)
        .filter_map(|number| {
            let next = most_owed(&streams, setting.nature, &dealt)?;
            let planned = streams[next].case(setting, number, dealt[next]);
            dealt[next] += 1;
            Some(planned)
        })
        .collect()
}

/// The stream that has had the least of its weight (Webster's method); of
/// equals the first.
fn most_owed(streams: &[&Stream], nature: Nature, dealt: &[usize]) -> Option<usize> {
    (0..streams.len()).min_by(|&a, &b| {
        let load =
            |index: usize| (2 * dealt[index] + 1) as f64 / streams[index].weight(nature) as f64;
        load(a).total_cmp(&load(b))
    })
}

impl Stream {
    fn weight(&self, nature: Nature) -> usize {
        let [laboratory, shop_floor] = self.weights;
        match nature {
            Nature::Laboratory => laboratory,
            Nature::ShopFloor => shop_floor,
        }
    }

    fn case(&self, setting: Setting, number: usize, turn: usize) -> Planned {
        let (effect, strength) = match self.choice {
            Choice::Listed => in_turn(&effects_of(true), self.offset() + turn),
            Choice::OffList => in_turn(&effects_of(false), turn),
            Choice::Strengths => (None, Some(STRENGTHS[turn % STRENGTHS.len()])),
            Choice::Drawn => (None, None),
        };
        Planned {
            number,
            seed: digest::case_seed(setting.seed, number),
            kind: self.kind,
            effect,
            strength,
            noise: match self.concealment {
                Concealment::Noisy(multiplier) => multiplier,
                _ => 1.0,
            },
            concealment: self.concealment,
            nature: setting.nature,
        }
    }

    /// Streams of the same effects begin at different ones.
    fn offset(&self) -> usize {
        match self.concealment {
            Concealment::Hidden | Concealment::Brief => 0,
            Concealment::Masked => 7,
            Concealment::Noisy(multiplier) if multiplier < 5.0 => 11,
            Concealment::Noisy(_) => 16,
        }
    }
}

/// The generator's effects that a verdict has a name for, or those that none has.
fn effects_of(on_list: bool) -> Vec<&'static str> {
    let mut names = truth_plant::effects::names();
    let is_named =
        |name: &&str| effects::effect(truth_plant::effects::verdict_name(name)).is_some();
    names.retain(|name| is_named(name) == on_list);
    names
}

/// Each round goes through all effects, with strengths that differ from one
/// effect to the next and from round to round: three rounds hold every pair once.
fn in_turn(names: &[&'static str], turn: usize) -> (Option<String>, Option<Strength>) {
    // Five steps at a time mix effects of gas, valve, force and sensors.
    const STRIDE: usize = 5;
    let count = names.len();
    if count == 0 {
        return (None, None);
    }
    let stride = if count.is_multiple_of(STRIDE) {
        1
    } else {
        STRIDE
    };
    let (round, place) = (turn / count, turn % count);
    let effect = names[place * stride % count];
    let strength = STRENGTHS[(place + round) % STRENGTHS.len()];
    (Some(effect.to_owned()), Some(strength))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::{BTreeMap, BTreeSet};

    fn whole(cases: usize) -> Vec<Planned> {
        let setting = Setting {
            seed: 7,
            kind: None,
            nature: Nature::Laboratory,
        };
        plan(setting, cases)
    }

    #[test]
    fn prop_every_effect_comes_once_at_every_strength() {
        let setting = Setting {
            seed: 1,
            kind: Some(Kind::OffList),
            nature: Nature::Laboratory,
        };
        for (names, singles) in [
            (effects_of(true), None),
            (
                effects_of(false),
                Some(plan(setting, 3 * effects_of(false).len())),
            ),
        ] {
            let pairs: Vec<(Option<String>, Option<Strength>)> = match singles {
                Some(planned) => planned
                    .into_iter()
                    .map(|p| (p.effect, p.strength))
                    .collect(),
                None => (0..3 * names.len())
                    .map(|turn| in_turn(&names, turn))
                    .collect(),
            };
            let distinct: BTreeSet<(Option<String>, Option<Strength>)> =
                pairs.iter().cloned().collect();
            assert_eq!(distinct.len(), 3 * names.len());
        }
        assert!(effects_of(true).len() > 15 && effects_of(false).len() > 4);
    }

    #[test]
    fn prop_every_beginning_is_balanced() {
        let planned = whole(300);
        for length in [25, 50, 100, 300] {
            let mut counts: BTreeMap<String, usize> = BTreeMap::new();
            for case in &planned[..length] {
                *counts
                    .entry(format!("{:?} {:?}", case.kind, case.concealment))
                    .or_default() += 1;
            }
            for stream in &STREAMS {
                let expected = stream.weight(Nature::Laboratory) as f64 * length as f64 / 100.0;
                let key = format!("{:?} {:?}", stream.kind, stream.concealment);
                let count = counts.get(&key).copied().unwrap_or(0) as f64;
                assert!(
                    (count - expected).abs() <= 1.0,
                    "{key}: {count} of {length}"
                );
            }
        }
        assert_eq!(whole(40), planned[..40]);
    }

    #[test]
    fn prop_streams_are_weighted_to_a_hundred() {
        for nature in Nature::ALL {
            let weights = STREAMS.iter().map(|stream| stream.weight(nature));
            assert_eq!(weights.sum::<usize>(), 100, "{nature}");
        }
        let single = Setting {
            seed: 7,
            kind: Some(Kind::Nothing),
            nature: Nature::Laboratory,
        };
        assert!(
            plan(single, 9)
                .iter()
                .all(|case| case.kind == Kind::Nothing)
        );
        let seeds: BTreeSet<u64> = whole(300).iter().map(|case| case.seed).collect();
        assert_eq!(seeds.len(), 300);
    }

    #[test]
    fn prop_every_planned_case_can_be_asked_for() {
        assert!(whole(200).iter().all(|case| case.request().is_some()));
    }

    #[test]
    fn prop_rigs_of_the_shop_floor_are_drawn_as_such() {
        let setting = Setting {
            seed: 7,
            kind: None,
            nature: Nature::ShopFloor,
        };
        let planned = plan(setting, 50);
        let natures = planned.iter().filter_map(Planned::request);
        assert!(
            natures
                .map(|one| one.truth().nature)
                .all(|nature| nature == Nature::ShopFloor)
        );
        let healthy = [Kind::Nothing, Kind::Parameters, Kind::Dirty];
        let healthy = planned.iter().filter(|case| healthy.contains(&case.kind));
        assert_eq!(healthy.count(), 15);
    }
}
