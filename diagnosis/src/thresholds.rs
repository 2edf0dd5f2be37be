//! Every number that decides what a verdict names, with what it was taken from. Numbers that only save
//! time, or that are the resolution of a computation, stand where they are used.

/// Where a number comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// From statistics, or from another number.
    Derived,
    /// Between what axes of either kind were seen to do.
    Calibrated,
    /// By judgement.
    Chosen,
}

/// A number that decides.
#[derive(Clone, Copy, Debug)]
pub struct Threshold {
    /// Its name here.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// What it decides, and why it is so large.
    pub what: &'static str,
    /// Where it comes from.
    pub origin: Origin,
}

macro_rules! thresholds {
    ($($(#[doc = $doc:literal])+ $name:ident = $value:expr, $origin:ident;)+) => {
        $($(#[doc = $doc])+ pub(crate) const $name: f64 = $value;)+

        /// All of them.
        pub const THRESHOLDS: &[Threshold] = &[$(Threshold {
            name: stringify!($name),
            value: $name,
            what: concat!($($doc),+),
            origin: Origin::$origin,
        }),+];
    };
}

thresholds! {
    /// Part of the amplitude of what is missing that an effect takes at the least: of the energy 2 %, in the gap between
    /// effects that are there (4 %) and effects that imitate a model's error (1.8 %) in the training parts of real
    /// recordings.
    MATERIAL = 0.15, Calibrated;
    /// The same as a part of the energy.
    MATERIAL_SHARE = MATERIAL * MATERIAL, Derived;
    /// An effect is plain where it takes the cross-validated error down to this.
    PLAIN_RATIO = 1.0 - MATERIAL, Derived;
    /// The same beside other effects on long recordings.
    PLAIN_RATIO_AMONG_MANY = 0.6, Chosen;
    /// The larger part: the probability from which what comes and goes is named; the part of what is left that
    /// a further term takes; the part of the energy that an unknown input explains where it is the place.
    LARGER_PART = 0.5, Derived;
    /// Energy above the noise's that is taken for noise where effects are judged, and down to which forces are told
    /// apart below their floor: what the noise itself is known to.
    TO_THE_NOISE = 0.05, Derived;
    /// Energy above the noise's that shows that something is missing: a sensor's noise is known to 5 % of its size.
    MISSED = 2.0 * TO_THE_NOISE, Derived;
    /// The same of few draws, in deviations of the energy of white noise, the root of two over their number: one in
    /// 30,000 by chance.
    NOISE_DEVIATIONS = 4.0, Derived;
    /// Deviations beyond which noise, or a window predicted worse, is plainly no chance: one in 44.
    PLAIN_DEVIATIONS = 2.0, Derived;
    /// Energy above a floor of forces that was set and not declared: healthy rigs were seen up to 0.6 above it.
    MISSED_OF_FORCES = 1.0, Calibrated;
    /// Part of a chamber's pressure that a sound model leaves beside the noise: 0.05 to 0.25 % on twelve drawn healthy
    /// shop-floor axes (seeds 301 to 312), and no gauge of class 0.5 is straight to better than a fifth of its class.
    DISCREPANCY = 3e-3, Calibrated;
    /// Energy above the noise's, in units of it, that an effect of not quite the right form leaves of an output: on practice
    /// axes and in trials a tube alone left more.
    ERROR_OF_FORM = 8.0, Calibrated;
    /// An effect that takes what is left down to this part of its energy is material, however much larger another one
    /// is: a wrong one nibbles at what a form leaves.
    NEXT_TO_NOTHING = 0.1, Chosen;
    /// Energy missed at break-aways that an effect leaves at the most: on 75 rigs without dwell stiction it
    /// left 0.54 and more, on ten with a weak one 0.14 and less.
    MOST_IS_TAKEN = 0.25, Calibrated;
    /// What chance does as well in one of so many trials at break-aways is no effect: a hundredth, and a dozen
    /// candidates are tried.
    CHANCE_OF_BREAK_AWAYS = 1e-3, Derived;
    /// What chance does as well more often than this is not named: the usual level of one test.
    CHANCE_ALONE = 0.05, Derived;
    /// Part of its energy that an effect keeps when the one that it hides behind is projected out: two speeds a
    /// factor of 2.2 apart give it, a sine gives 0.19.
    LEAST_OWN_ENERGY = 0.125, Derived;
    /// Stated deviations from which a number contradicts the rig file: of twelve practice rigs one has a number 3.2 off.
    STRAYED = 4.0, Calibrated;
    /// Stated deviations within which a number has come back.
    BACK = 2.5, Chosen;
    /// Part of a well stated number by which no rig file is off that was fitted to the same axis before: effects
    /// bend numbers by tenths. A cable that drags, called a friction that grows with the pressure difference, took all
    /// forces down to a third.
    BENT = 0.5, Calibrated;
    /// Difference of the logarithms of the posterior below which effects cannot be told apart: twenty to one.
    ALIKE = 3.0, Derived;
    /// A stated deviation is a guess as if taken from so many numbers and one more: errors far out are likelier than of a normal
    /// distribution.
    FREEDOM_OF_STATED = 10.0, Chosen;
    /// How many times likelier some number of a rig file is wrong than a given effect is there: there are some 25.
    WRONG_NUMBER = 25.0, Derived;
    /// The certainty beyond which no recording chooses between an effect and a wrong number: the other side of the
    /// usual level.
    MOST_CERTAIN = 1.0 - CHANCE_ALONE, Derived;
    /// Deviations by which a load's mass is known from nought, and its spring from a rigid one.
    TOLD_FROM_NOUGHT = 3.0, Derived;
    /// Least part of the carriage's mass that a load is: that much more or less does not matter.
    LEAST_LOAD = 0.02, Chosen;
    /// Part of the rows from which an effect is there always.
    ALWAYS = 0.9, Chosen;
    /// Part of the rows below which it is an event and no effect: 10 ms of a force that were one break-away stood
    /// in the place of a dry friction.
    AN_EVENT = 0.005, Calibrated;
    /// Held-out error over the refitted model's from which an effect is refuted: 2 % is within what estimating the
    /// initial states moves.
    REFUTED = 1.02, Calibrated;
    /// Held-out error of a free run over the noise that training recordings do not explain.
    SURPRISING = 2.0, Chosen;
    /// Part of the energy of what is missing that named effects explain at the least: effects that are there 73 % (play,
    /// whose blows fall at random) and more, others in the place of effects of no list 55 % and less.
    EXPLAINED = 0.65, Calibrated;
    /// Inputs and equations that explain this much less than the best are not told from it; a table has nine numbers to bend.
    AS_WELL = 0.05, Chosen;
    /// Difference of the criterion within which forms of an equation do as well: odds of about 150.
    FORMS_AS_WELL = 10.0, Derived;
    /// Part of the energy above the noise that the first term of an equation takes away: half of the amplitude.
    WORTH_A_FIRST_TERM = LARGER_PART * LARGER_PART, Derived;
    /// Part of the amplitude that a form explains by which it may be off itself: real springs and seals are of no form
    /// exactly.
    ERROR_OF_EQUATION = 0.1, Chosen;
}
