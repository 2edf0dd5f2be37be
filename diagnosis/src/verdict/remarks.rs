//! What is to be said of the rig file beside the verdict.

use crate::estimate::candidates::voids;
use crate::estimate::sheet::Sheet;
use crate::finding::Finding;
use crate::imprecise;
use crate::inspect::Doubt;
use crate::laws::Law;
use crate::rig::Rig;
use crate::search::strayed::deviations;
use crate::thresholds::STRAYED;
use crate::verdict::Parameter;
use crate::words;
use std::collections::BTreeMap;

/// Of rig files that state their deviations rightly one in twenty or fewer appears too sure by as
/// much (of 400 drawn with fourteen numbers each: `sheet::tests`).
pub(crate) const TOO_SURE: f64 = 1.5;

/// Numbers that explain the recordings and are far from what the rig states. Beside a friction that
/// grows with the pressure, dry friction is another number than the one stated.
pub(crate) fn strayed(
    rig: &Rig,
    laws: &[Finding],
    parameters: &BTreeMap<String, Parameter>,
) -> Vec<String> {
    let is_void = |key: &String| {
        let of_law =
            |law: &Finding| voids(&law.candidates, &law.improved.set).any(|void| void == key);
        laws.iter().any(of_law)
    };
    let bound = parameters.iter().filter(|(key, _)| !is_void(key));
    let scale = sheet(rig, laws).scale();
    let note = |(key, parameter): (&String, &Parameter)| {
        let found = parameter.improved?;
        let is_strayed = deviations(rig, key, found, parameter.std)? > STRAYED * scale;
        is_strayed.then(|| {
            let stated = stated(rig, key, found);
            format!(
                "the recordings require {stated}: more than an error of the rig file; unmodelled physics with the same effect cannot be distinguished"
            )
        })
    };
    bound.filter_map(note).collect()
}

/// How well the rig file kept its word, by all laws.
fn sheet(rig: &Rig, laws: &[Finding]) -> Sheet {
    let of_laws = laws.iter().map(|law| law.sheet(rig));
    of_laws.fold(Sheet::default(), |all, law| all.and(&law))
}

/// That the numbers of a rig file are further off than it states, as a rule.
pub(crate) fn too_sure(rig: &Rig, laws: &[Finding]) -> Option<String> {
    let scale = sheet(rig, laws).scale();
    (scale > TOO_SURE).then(|| {
        format!(
            "the numbers of the rig file are typically off by {} times their [uncertainty]: the uncertainties were taken that much larger",
            words::digits(scale)
        )
    })
}

/// Numbers that the training recordings leave open, where held-out ones need them.
pub(crate) fn open_numbers(laws: &[Finding]) -> Vec<String> {
    let open = laws.iter().filter(|law| law.leaves_numbers_open);
    let note = |law: &Finding| {
        format!(
            "{}: the training recordings leave numbers of the rig open that the held-out ones need; fitted to all recordings the same model explains these, so train on more of them",
            law.law.title()
        )
    };
    open.map(note).collect()
}

/// Numbers that ended at the bound of what they may be.
pub(crate) fn at_bounds(parameters: &BTreeMap<String, Parameter>) -> Vec<Doubt> {
    let at_bound = parameters.iter().filter(|(key, parameter)| {
        parameter.at_bound && !imprecise::MAY_END_AT_A_BOUND.contains(&key.as_str())
    });
    let doubt = |(key, parameter): (&String, &Parameter)| Doubt {
        about: key.clone(),
        says: format!(
            "{key}: the fit ended at the bound of what this number may be, {}; the model may lack something that it stands in for",
            words::digits(parameter.improved.unwrap_or(f64::NAN))
        ),
        p_value: None,
    };
    at_bound.map(doubt).collect()
}

/// Numbers that stood in for an effect that was named.
pub(crate) fn stood_in(rig: &Rig, laws: &[Finding]) -> Vec<String> {
    let scale = sheet(rig, laws).scale();
    let of_law = |law: &Finding| {
        let mut named = law.evidence.iter().filter(|evidence| evidence.accepted);
        let evidence = named.find(|evidence| evidence.is_of_strayed)?;
        let effect = law.candidates[evidence.candidate].effect;
        let refit = &law.baseline;
        let numbers = refit.names.iter().zip(&refit.values).take(refit.shared);
        let known = numbers.zip(&refit.standard_deviations);
        let note = |((key, &found), &known_to): ((&String, &f64), &Option<f64>)| {
            let is_strayed = deviations(rig, key, found, known_to)? > STRAYED * scale;
            let stated = is_strayed.then(|| stated(rig, key, found))?;
            Some(format!(
                "without {effect} the model explains the recordings equally well, with {stated}"
            ))
        };
        Some(known.filter_map(note).collect::<Vec<String>>())
    };
    laws.iter().filter_map(of_law).flatten().collect()
}

/// What a number comes out as, and what was stated.
fn stated(rig: &Rig, key: &str, found: f64) -> String {
    let numbers = [
        found,
        rig.value(key).unwrap_or(f64::NAN),
        rig.uncertainty_sd(key).unwrap_or(0.0),
    ];
    let [found, given, stated] = numbers.map(words::digits);
    format!("{key} = {found} instead of {given} ± {stated} in the rig file")
}

/// What is to be said of a rig that holds no number to be uncertain.
pub(crate) fn unrefitted(rig: &Rig) -> Option<String> {
    let note = "the rig file has no [uncertainty]: no parameter was refitted, so a wrong nameplate value appears as missing physics";
    rig.uncertainty.is_empty().then(|| note.to_owned())
}

/// Where a data sheet states one flow, the areas over the opening are assumed, and no misfit of the
/// chambers is beyond them.
pub(crate) fn assumed_curve(rig: &Rig, laws: &[Finding]) -> Option<String> {
    let mut chambers = laws.iter().filter(|law| law.law == Law::Chambers);
    let is_missed = chambers.any(Finding::is_unexplained);
    (rig.states_flow() && is_missed).then(|| {
        "the areas of the valve over its opening are assumed, from one flow of the data sheet: the misfit of the chambers may be that of the assumed curve; measure the flow at 8 or more openings and give [valve] a table".to_owned()
    })
}

/// Of what the rig describes, what these signals say nothing of.
pub(crate) fn unjudged(rig: &Rig, laws: &[Finding]) -> Vec<String> {
    let judged = |law: Law| laws.iter().any(|one| one.law == law);
    let moves = judged(Law::Carriage) || judged(Law::Force);
    let described = [
        (
            rig.chambers.is_some() && !judged(Law::Chambers),
            "valve, chambers and supply were not tested: this needs position, a chamber pressure and, with a valve, the command",
        ),
        (
            rig.carriage.is_some() && !moves,
            "carriage and friction were not tested: this needs position with both chamber pressures, or with a force",
        ),
    ];
    let silent = described.iter().filter(|(is_silent, _)| *is_silent);
    silent.map(|(_, note)| (*note).to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const RIG: &str = "\
        format = \"rig/1\"\n\
        [signals]\n\
        t = { column = 0, unit = \"s\" }\n\
        [friction]\n\
        coulomb_N = 20.0\n\
        viscous_Ns_m = 60.0\n\
        [uncertainty]\n\
        \"friction.coulomb_N\" = 0.1\n\
        \"friction.viscous_Ns_m\" = 0.2\n";

    /// 60 +- 12 that comes out as 12 is four deviations of the one number and sixteen of the
    /// other; as 400, 28 and 4.25.
    #[test]
    fn prop_a_number_far_from_both_beliefs_is_told() {
        let rig = Rig::parse(RIG, "rig.toml").unwrap();
        let told = |key: &str, found: f64| {
            let parameter = Parameter {
                given: rig.value(key),
                refitted: Some(found),
                improved: Some(found),
                std: Some(0.1),
                at_bound: false,
            };
            strayed(&rig, &[], &BTreeMap::from([(key.to_owned(), parameter)]))
        };
        assert!(told("friction.viscous_Ns_m", 12.1).is_empty());
        assert!(told("friction.viscous_Ns_m", 200.0).is_empty());
        assert!(told("friction.coulomb_N", 25.0).is_empty());
        let notes = told("friction.viscous_Ns_m", 400.0);
        assert_eq!(notes.len(), 1);
        assert!(notes[0].contains("friction.viscous_Ns_m = 400 instead of 60"));
    }
}
