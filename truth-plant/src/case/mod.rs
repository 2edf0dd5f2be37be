//! A case: what a rig truly is, what its engineer believes, and recordings.

pub(crate) mod belief;
mod excitation;
mod kind;
pub(crate) mod nameplate;
mod nature;
mod truth;

use std::fmt::Write as _;

use belief::{Belief, Declared};
use excitation::{Excitation, FILES, Reach, TRAINING};
pub use kind::{Kind, UnknownKind};
use kind::{Plan, Wish};
use nameplate::Nameplate;
use nature::Departure;
pub use nature::Nature;
pub use truth::{Onset, TrueEffect, Truth};

use crate::effects::{self, Draw, Strength};
use crate::plant::sensors::{Sample, quantised_command_v};
use crate::plant::{Physics, Plant, STEPS_PER_TICK, Start, TICK_S, Window};
use crate::random::{Purpose, Random};

/// A rig file, recordings and the truth about them.
#[derive(Clone, Debug)]
pub struct Case {
    /// A name that does not tell what is in it.
    pub name: String,
    /// The seed that all of it follows from.
    pub seed: u64,
    /// What the engineer believes.
    pub rig_toml: String,
    /// Training recordings: file name and text.
    pub train: Vec<(String, String)>,
    /// Held-out recordings.
    pub held_out: Vec<(String, String)>,
    /// What is true.
    pub truth: Truth,
    design: Design,
}

/// What a case is made from; equal designs make equal cases.
#[derive(Clone, Debug)]
struct Design {
    seed: u64,
    nature: Nature,
    plan: Plan,
}

/// Draws a case of a kind.
pub fn draw(seed: u64, kind: Kind) -> Case {
    Request::new(seed, kind).draw()
}

/// A case with some of what is usually drawn prescribed.
#[derive(Clone, Debug)]
pub struct Request {
    seed: u64,
    kind: Kind,
    nature: Nature,
    wish: Wish,
}

impl Request {
    /// Everything drawn.
    pub fn new(seed: u64, kind: Kind) -> Self {
        Self {
            seed,
            kind,
            nature: Nature::default(),
            wish: Wish::default(),
        }
    }

    /// Of a rig of this nature.
    #[must_use]
    pub fn with_nature(mut self, nature: Nature) -> Self {
        self.nature = nature;
        self
    }

    /// With this effect first among those of the kind.
    ///
    /// # Errors
    /// If there is no effect of this name.
    pub fn with_effect(mut self, name: &str) -> Result<Self, UnknownEffect> {
        let effect = effects::named(name).ok_or_else(|| UnknownEffect(name.to_owned()))?;
        self.wish.effect = Some(effect.name);
        Ok(self)
    }

    /// With effects of this strength.
    pub fn with_strength(mut self, strength: Strength) -> Self {
        self.wish.strength = Some(strength);
        self
    }

    /// With this multiplier of the sensors' noise.
    pub fn with_noise(mut self, multiplier: f64) -> Self {
        self.wish.noise = Some(multiplier);
        self
    }

    /// The case.
    pub fn draw(&self) -> Case {
        self.design().build()
    }

    /// The truth of the case, without making its recordings.
    pub fn truth(&self) -> Truth {
        let design = self.design();
        let world = design.world();
        design.truth(world)
    }

    /// [`Case::plant`] of the case, without making its recordings.
    pub fn plant(&self) -> Plant {
        self.design().plant()
    }

    /// Five seconds of a night at 500 Hz: the motion of the first recording, from rest, with noise of
    /// its own, of a plant that `change` has been at.
    pub(crate) fn night(&self, night: u32, change: impl FnOnce(&mut Physics)) -> String {
        const SECONDS: f64 = 5.0;
        let design = self.design();
        let mut world = design.world();
        change(&mut world.changed);
        let nameplate = &world.nameplate;
        let null_v = design.belief().null_v(nameplate);
        let excitation = design.excitation(0, null_v);
        let start = Start {
            position_m: excitation.start_m(),
            pressure_pa: [0.58 * nameplate.supply_pa; 2],
            seed: self.seed,
            // Beyond the recordings of the case.
            recording: FILES.len() + 1 + night as usize,
        };
        let mut plant = Plant::new(world.changed, start);
        let mut text = design.header();
        for tick in 0..libm::round(SECONDS / TICK_S) as usize {
            let sample = plant.sample();
            let command_v = quantised_command_v(excitation.command_v(&sample));
            if tick.is_multiple_of(2) {
                design.row(&mut text, &sample, command_v);
            }
            plant.advance(command_v);
        }
        text
    }

    fn design(&self) -> Design {
        let mut random = Random::new(self.seed, Purpose::Choice);
        Design {
            seed: self.seed,
            nature: self.nature,
            plan: Plan::draw(&mut random, self.kind, &self.wish),
        }
    }
}

/// There is no effect of this name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownEffect(pub String);

impl core::fmt::Display for UnknownEffect {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(
            formatter,
            "unknown effect `{}`: expected one of {}",
            self.0,
            effects::names().join(", ")
        )
    }
}

impl std::error::Error for UnknownEffect {}

impl Case {
    /// The same case with one effect taken out: the same rig, belief,
    /// references and noise. `None` if it does not hold the effect.
    pub fn without(&self, effect: &str) -> Option<Self> {
        let mut design = self.design.clone();
        design.plan.remove(effect).then(|| design.build())
    }

    /// The plant of this case, at rest in mid-stroke, with its effects present
    /// from the start: what a controller can be tried on.
    pub fn plant(&self) -> Plant {
        self.design.plant()
    }
}

/// The rig, its plant without and with the effects, and what the effects are.
struct World {
    nameplate: Nameplate,
    departure: Departure,
    usual: Physics,
    changed: Physics,
    effects: Vec<TrueEffect>,
}

impl Design {
    fn build(self) -> Case {
        let world = self.world();
        let belief = self.belief();
        let null_v = belief.null_v(&world.nameplate);
        let mut recordings: Vec<(String, String)> = (0..FILES.len())
            .map(|recording| self.record(&world, recording, null_v))
            .collect();
        let held_out = recordings.split_off(TRAINING);
        Case {
            name: format!("case-{:06}", self.seed),
            seed: self.seed,
            rig_toml: belief.rig_toml(&world.nameplate, &world.departure),
            train: recordings,
            held_out,
            truth: self.truth(world),
            design: self,
        }
    }

    fn belief(&self) -> Belief {
        let plan = &self.plan;
        let declared = Declared {
            supply_recorded: plan.supply_recorded,
            polytropic: plan.declares_polytropic(),
            noise: plan.noise,
            careless: plan.kind == Kind::Parameters,
        };
        Belief::draw(&mut Random::new(self.seed, Purpose::Belief), declared)
    }

    fn plant(&self) -> Plant {
        let world = self.world();
        let start = Start {
            position_m: 0.0,
            pressure_pa: [0.6 * world.nameplate.supply_pa; 2],
            seed: self.seed,
            // A noise of its own, beyond those of the recordings.
            recording: FILES.len(),
        };
        Plant::new(world.changed, start)
    }

    fn world(&self) -> World {
        let nameplate = Nameplate::draw(&mut Random::new(self.seed, Purpose::Plant));
        let departure = match self.nature {
            Nature::Laboratory => Departure::none(),
            Nature::ShopFloor => Departure::draw(&mut Random::new(self.seed, Purpose::Nature)),
        };
        let mut usual = nameplate.physics(self.plan.noise);
        departure.apply(&nameplate.curve, &mut usual);
        usual.mechanics.friction.presliding = self.plan.presliding;
        let mut changed = usual.clone();
        let mut effects = Vec::new();
        for planned in &self.plan.effects {
            let mut random = Random::new(self.seed, Purpose::Effect(planned.position));
            let applied = (planned.effect.apply)(&mut Draw {
                physics: &mut changed,
                random: &mut random,
                strength: planned.strength,
                form: planned.form,
            });
            effects.push(TrueEffect::new(planned, applied, self.onset()));
        }
        World {
            nameplate,
            departure,
            usual,
            changed,
            effects,
        }
    }

    fn window(&self, recording: usize, duration_s: f64) -> Option<Window> {
        let share = self.plan.present_share?;
        let mut random = Random::new(self.seed, Purpose::Onset(recording));
        let length_s = share * duration_s;
        let free_s = duration_s - length_s;
        // Half the effects stay once they have come.
        let from_s = if self.plan.stays {
            free_s
        } else {
            random.between(0.1 * free_s, free_s)
        };
        Some(Window {
            from_s: on_tick_s(from_s),
            to_s: on_tick_s(from_s + length_s),
        })
    }

    fn onset(&self) -> Option<Onset> {
        let windows = FILES.iter().enumerate().map(|(recording, file)| {
            let duration_s = self.excitation(recording, 0.0).duration_s;
            let window = self.window(recording, duration_s)?;
            Some(((*file).to_owned(), window))
        });
        Some(Onset {
            present_share: self.plan.present_share?,
            windows: windows.collect::<Option<_>>()?,
        })
    }

    fn excitation(&self, recording: usize, null_v: f64) -> Excitation {
        let mut random = Random::new(self.seed, Purpose::Excitation(recording));
        Excitation::draw(&mut random, recording, self.plan.reach, null_v)
    }

    fn record(&self, world: &World, recording: usize, null_v: f64) -> (String, String) {
        let excitation = self.excitation(recording, null_v);
        let mut random = Random::new(self.seed, Purpose::Excitation(FILES.len() + recording));
        let anywhere_m = random.between(-0.05, 0.05);
        let start = Start {
            position_m: if self.plan.reach == Reach::Gentle {
                excitation.start_m()
            } else {
                anywhere_m
            },
            pressure_pa: [random.between(0.48, 0.68) * world.nameplate.supply_pa; 2],
            seed: self.seed,
            recording,
        };
        let mut plant = match self.window(recording, excitation.duration_s) {
            Some(window) => Plant::with_steps(
                world.usual.clone(),
                Some((world.changed.clone(), window)),
                start,
                STEPS_PER_TICK,
            ),
            None => Plant::new(world.changed.clone(), start),
        };
        let rows = libm::round(excitation.duration_s / TICK_S) as usize;
        let mut text = self.header();
        for _ in 0..rows {
            let sample = plant.sample();
            let command_v = quantised_command_v(excitation.command_v(&sample));
            self.row(&mut text, &sample, command_v);
            plant.advance(command_v);
        }
        (excitation.file.to_owned(), text)
    }

    fn header(&self) -> String {
        let supply = if self.plan.supply_recorded {
            "p_s_Pa,"
        } else {
            ""
        };
        format!("t_s,u_V,p_a_Pa,p_b_Pa,{supply}x_m,v_m_s\n")
    }

    fn row(&self, text: &mut String, sample: &Sample, command_v: f64) {
        let [a_pa, b_pa] = sample.pressure_pa;
        // Writing into a String cannot fail.
        let _ = write!(
            text,
            "{:.4},{command_v:.4},{a_pa:.1},{b_pa:.1},",
            sample.time_s
        );
        if self.plan.supply_recorded {
            let _ = write!(text, "{:.1},", sample.supply_pa);
        }
        let _ = writeln!(text, "{:.8},{:.6}", sample.position_m, sample.speed_m_per_s);
    }

    fn truth(&self, world: World) -> Truth {
        let off_list = self
            .plan
            .effects
            .iter()
            .any(|planned| !planned.effect.on_list);
        Truth {
            plant: world.nameplate.named_values(&world.changed),
            effects: world.effects,
            kind: self.plan.kind,
            nature: self.nature,
            off_list,
            observable: self.plan.kind != Kind::Unobservable,
            noise: self.plan.noise,
            presliding: self.plan.presliding,
        }
    }
}

/// The nearest tick, as the decimal number that it is written as.
fn on_tick_s(time_s: f64) -> f64 {
    libm::round(time_s * 1e3) / 1e3
}
