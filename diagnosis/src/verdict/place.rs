//! Where something is missing, and when.

use super::Located;
use crate::finding::{Finding, said};
use crate::locate;
use crate::recording::Recording;

pub(super) fn located(
    laws: &[Finding],
    velocity: Option<&locate::Located>,
    train: &[Recording],
) -> Vec<Located> {
    let inputs = laws.iter().filter_map(|law| law.input.as_ref());
    let mut all: Vec<Located> = laws
        .iter()
        .flat_map(|law| law.located.iter())
        .chain(inputs)
        .chain(velocity)
        .map(|located| Located {
            place: located.place.into(),
            share: located.share,
            signals: vec![located.signal.into()],
            intervals_s: located.intervals.clone(),
            when: located.when.clone(),
        })
        .collect();
    // A sensor named as the culprit is a place of its own.
    for law in laws {
        let rivals = law.rivals.iter().map(|(_, rival)| rival);
        for &index in law.improved.set.iter().chain(rivals) {
            for place in &law.candidates[index].places {
                if !all.iter().any(|located| located.place == *place) {
                    all.push(implied(law, index, place, train));
                }
            }
        }
    }
    all.sort_by(|a, b| b.share.total_cmp(&a.share));
    // What two laws show of one sensor is said once.
    let mut said: Vec<Located> = Vec::new();
    for located in all {
        let is_said = |one: &Located| one.place == located.place && one.when == located.when;
        if !said.iter().any(is_said) {
            said.push(located);
        }
    }
    said
}

/// A place that shows only through an effect that was named there.
fn implied(law: &Finding, index: usize, place: &str, train: &[Recording]) -> Located {
    let (share, found_through) = match &law.term {
        Some(term) => (term.explained(), term.stand.phrase()),
        None => {
            let mut evidence = law.evidence.iter();
            let own = evidence.find(|evidence| evidence.candidate == index);
            let share = own.map_or(0.0, |evidence| evidence.share.clamp(0.0, 1.0));
            (share, law.candidates[index].effect.to_owned())
        }
    };
    let signal = place.strip_prefix("sensor.").unwrap_or("");
    Located {
        place: place.to_owned(),
        share,
        signals: if signal.is_empty() {
            Vec::new()
        } else {
            vec![signal.to_owned()]
        },
        intervals_s: spans(law, index, train),
        when: format!("inferred from {found_through}"),
    }
}

/// The spans in which it is there, by recording.
pub(super) fn spans(
    law: &Finding,
    candidate: usize,
    train: &[Recording],
) -> Vec<(String, f64, f64)> {
    let Some(presence) = said::presence(law, candidate) else {
        return Vec::new();
    };
    let recordings = presence.spans_s.iter().zip(train);
    let named = |(spans_s, recording): (&Vec<(f64, f64)>, &Recording)| {
        let end = recording.time_s.last().copied().unwrap_or(f64::INFINITY);
        let name = recording.name.clone();
        let span = move |&(from, to): &(f64, f64)| (name.clone(), from, to.min(end));
        spans_s.iter().map(span).collect::<Vec<_>>()
    };
    recordings.flat_map(named).collect()
}

/// The part of the recorded time in which it is there.
pub(super) fn share_of_time(spans: &[(String, f64, f64)], train: &[Recording]) -> f64 {
    let length = |recording: &Recording| {
        let time = &recording.time_s;
        time.last().unwrap_or(&0.0) - time.first().unwrap_or(&0.0)
    };
    let all: f64 = train.iter().map(length).sum();
    spans.iter().map(|(_, from, to)| to - from).sum::<f64>() / all.max(f64::MIN_POSITIVE)
}
