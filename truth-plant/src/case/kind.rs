//! The kinds of cases, and what is planned for one.

use core::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::excitation::Reach;
use crate::effects::{
    self, Effect, FRICTION_ZONE, Form, GAS_TEMPERATURE, SUPPLY_RIPPLE, Strength, verdict_name,
};
use crate::plant::friction::Presliding;
use crate::random::Random;

/// What a case is meant to try.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// One effect.
    Single,
    /// Two effects.
    Pair,
    /// An effect that is present in a part of each recording.
    Onset,
    /// Nothing is missing.
    Nothing,
    /// Nothing is missing, but some values are typed wrong by two to three of
    /// their deviations.
    Parameters,
    /// Several effects, each too small to care about.
    Dirty,
    /// An effect on the list in a form that a library would not have.
    OtherForm,
    /// An effect on no list.
    OffList,
    /// An effect that the recordings cannot show.
    Unobservable,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 9] = [
        Self::Single,
        Self::Pair,
        Self::Onset,
        Self::Nothing,
        Self::Parameters,
        Self::Dirty,
        Self::OtherForm,
        Self::OffList,
        Self::Unobservable,
    ];

    /// Its name, as in `truth.json`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Single => "single",
            Self::Pair => "pair",
            Self::Onset => "onset",
            Self::Nothing => "nothing",
            Self::Parameters => "parameters",
            Self::Dirty => "dirty",
            Self::OtherForm => "other-form",
            Self::OffList => "off-list",
            Self::Unobservable => "unobservable",
        }
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}

/// There is no kind of this name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownKind(pub String);

impl fmt::Display for UnknownKind {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = Kind::ALL.map(Kind::name).join(", ");
        write!(
            formatter,
            "unknown kind `{}`: expected one of {names}",
            self.0
        )
    }
}

impl std::error::Error for UnknownKind {}

impl FromStr for Kind {
    type Err = UnknownKind;

    fn from_str(name: &str) -> Result<Self, UnknownKind> {
        Self::ALL
            .into_iter()
            .find(|kind| kind.name() == name)
            .ok_or_else(|| UnknownKind(name.to_owned()))
    }
}

/// What is prescribed instead of drawn.
#[derive(Clone, Debug, Default)]
pub(super) struct Wish {
    pub(super) effect: Option<&'static str>,
    pub(super) strength: Option<Strength>,
    pub(super) noise: Option<f64>,
}

/// One effect of a plan.
#[derive(Clone)]
pub(super) struct Planned {
    pub(super) effect: &'static Effect,
    pub(super) strength: Strength,
    pub(super) form: Form,
    /// Position in the plan as drawn, which its random numbers hang on.
    pub(super) position: usize,
}

impl fmt::Debug for Planned {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            formatter,
            "{} {:?} {:?}",
            self.effect.name, self.strength, self.form
        )
    }
}

/// All choices of a case.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    pub(super) kind: Kind,
    pub(super) effects: Vec<Planned>,
    pub(super) noise: f64,
    pub(super) supply_recorded: bool,
    pub(super) presliding: Presliding,
    pub(super) reach: Reach,
    /// Share of the time that the effects are present, if not all of it.
    pub(super) present_share: Option<f64>,
    /// Whether they stay once they have come.
    pub(super) stays: bool,
}

/// Effects that small and slow motion about the middle cannot show, if they are
/// not strong.
const HIDDEN_BY_GENTLENESS: [&str; 4] = [
    "end-cushion",
    "exhaust-back-pressure",
    "slew-limit",
    "supply-droop",
];

const STRENGTHS: [Strength; 3] = [Strength::Weak, Strength::Medium, Strength::Strong];

impl Plan {
    pub(super) fn draw(random: &mut Random, kind: Kind, wish: &Wish) -> Self {
        let names = choose(random, kind, wish);
        let effects: Vec<Planned> = names
            .into_iter()
            .enumerate()
            .map(|(position, effect)| {
                // Drawn in any case, so that a wish changes nothing else.
                let drawn = *random.one_of(&STRENGTHS);
                Planned {
                    effect,
                    strength: strength(kind, drawn, wish),
                    form: if kind == Kind::OtherForm && effect.has_other_form {
                        Form::Other
                    } else {
                        Form::Usual
                    },
                    position,
                }
            })
            .collect();
        let holds = |name: &str| effects.iter().any(|planned| planned.effect.name == name);
        let noise = *random.one_of(&[1.0, 1.0, 1.0, 1.0, 1.0, 3.0, 3.0, 10.0]);
        let supply_recorded = random.chance(0.5) && !holds(SUPPLY_RIPPLE);
        let other_contact = *random.one_of(&[Presliding::ElastoPlastic, Presliding::MaxwellSlip]);
        // Immaterial beside an effect of another form, or among small dirt.
        let contact_differs = random.chance(match kind {
            Kind::OtherForm => 0.3,
            Kind::Dirty => 0.5,
            _ => 0.0,
        });
        let presliding = if contact_differs {
            other_contact
        } else {
            Presliding::LuGre
        };
        let present_share = *random.one_of(&[0.5, 0.2, 0.05]);
        Self {
            kind,
            noise: wish.noise.unwrap_or(noise),
            supply_recorded,
            presliding,
            reach: match kind {
                Kind::Unobservable => Reach::Gentle,
                _ if holds("end-cushion") => Reach::ToTheEnds,
                _ => Reach::Usual,
            },
            present_share: (kind == Kind::Onset).then_some(present_share),
            stays: random.chance(0.5),
            effects,
        }
    }

    /// Whether the rig file declares the chambers polytropic.
    pub(super) fn declares_polytropic(&self) -> bool {
        self.effects
            .iter()
            .any(|planned| planned.effect.name == GAS_TEMPERATURE)
    }

    /// Takes an effect out; false if it is not there.
    pub(super) fn remove(&mut self, name: &str) -> bool {
        let before = self.effects.len();
        self.effects
            .retain(|planned| verdict_name(planned.effect.name) != name);
        self.effects.len() < before
    }
}

fn strength(kind: Kind, drawn: Strength, wish: &Wish) -> Strength {
    match (kind, wish.strength) {
        (Kind::Dirty, _) => Strength::Immaterial,
        (_, Some(wished)) => wished,
        (Kind::Unobservable, None) => drawn.min(Strength::Medium),
        _ => drawn,
    }
}

/// The effects of a kind, the wished one first.
fn choose(random: &mut Random, kind: Kind, wish: &Wish) -> Vec<&'static Effect> {
    let count = match kind {
        Kind::Nothing | Kind::Parameters => 0,
        Kind::Single | Kind::Onset | Kind::OffList | Kind::Unobservable => 1,
        Kind::OtherForm => 1,
        Kind::Pair => 2,
        Kind::Dirty => 3,
    };
    let candidates: Vec<&'static Effect> = effects::catalogue()
        .filter(|effect| suits(effect, kind))
        .collect();
    let mut chosen: Vec<&'static Effect> = Vec::new();
    if let Some(name) = wish.effect {
        chosen.extend(effects::named(name).filter(|_| count > 0));
    }
    while chosen.len() < count {
        let next = *random.one_of(&candidates);
        if chosen.iter().all(|other| may_go_together(other, next)) {
            chosen.push(next);
        }
    }
    chosen
}

/// Drawn only where they are asked for: the draws of a seed stay what they were.
const ON_REQUEST: [&str; 3] = ["gauge-gain", FRICTION_ZONE, "port-throttle"];

fn suits(effect: &Effect, kind: Kind) -> bool {
    if ON_REQUEST.contains(&effect.name) {
        return false;
    }
    match kind {
        Kind::OffList => !effect.on_list,
        Kind::Onset => effect.on_list && effect.may_begin,
        Kind::Dirty => effect.on_list && effect.may_be_immaterial,
        Kind::OtherForm => effect.on_list && effect.has_other_form,
        Kind::Unobservable => HIDDEN_BY_GENTLENESS.contains(&effect.name),
        _ => effect.on_list,
    }
}

/// Two effects that set the same part of the plant would undo each other.
fn may_go_together(first: &Effect, second: &Effect) -> bool {
    let load = |effect: &Effect| effect.name.starts_with("load-");
    first.name != second.name && !(load(first) && load(second))
}
