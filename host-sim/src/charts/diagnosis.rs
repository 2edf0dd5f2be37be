//! The report of a diagnosis: the sentence first, then where, what, the proof,
//! what it could be confused with, what to record next, parameters, and how it
//! was made.

use super::{
    Curve, OPEN_DETAIL, located_misfit, missing_term, needed_input, prediction_stack,
    shade_intervals, worst_recording,
};
use crate::diagnose::proof::Run;
use crate::diagnose::unknown_term;
use crate::diagnose::verdict::{Effect, Estimate, FitFigures, Verdict, WouldShow};
use crate::diagnose::{BreakAway, Diagnosis, LawDiagnosis, Model, summary, words};
use crate::effects;
use crate::identify::Residuals;
use crate::laws::{Output, Track, balance};
use crate::recording::Recording;
use crate::report::{
    BarChart, Cell, Chart, ChartStack, Page, Provenance, Role, Section, Series, Table,
};
use crate::rig::Rig;
use crate::units::shown;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;
use std::collections::BTreeMap;

/// Bins of a histogram of residuals.
const HISTOGRAM_BINS: usize = 60;
/// From this many break-aways on they are drawn.
const LEAST_BREAK_AWAYS: usize = 3;
/// Height of their chart, CSS pixels.
const BREAK_AWAY_HEIGHT_PX: u32 = 190;
/// Rows of one segment of a spectrum.
const SEGMENT_ROWS: usize = 1024;

/// Makes the page.
pub fn diagnosis_page(title: &str, rig: &Rig, diagnosis: &Diagnosis, how: Provenance) -> Page {
    let verdict = &diagnosis.verdict;
    let mut page = Page::new(title);
    page.lead(lead(verdict));
    tiles(&mut page, diagnosis);
    page.section("In short", |section| section.table(in_short(diagnosis)));
    page.section("Where the misfit sits", |section| {
        where_it_sits(section, rig, diagnosis)
    });
    page.section("What is missing, and how much of it", |section| {
        what(section, verdict)
    });
    page.section("The proof", |section| proof(section, rig, diagnosis));
    page.section(
        "What it could be confused with, and what to record next",
        |section| {
            confusions(section, verdict);
        },
    );
    if !verdict.would_show.is_empty() {
        page.section("What these recordings would have shown", |section| {
            would_have_shown(section, verdict)
        });
    }
    page.section("Parameters", |section| parameters(section, verdict));
    let fits: usize = diagnosis.laws.iter().map(|law| law.fits).sum();
    page.provenance(how.fact("models fitted", fits));
    page
}

/// The five lines of the terminal.
fn in_short(diagnosis: &Diagnosis) -> Table {
    let lines = summary::five_lines(diagnosis).into_iter();
    lines.fold(
        Table::new(["question", "answer"]),
        |table, (label, line)| table.row([Cell::from(label), Cell::from(line)]),
    )
}

/// The sentence; where effects are named, without their sizes, which follow in
/// a table.
fn lead(verdict: &Verdict) -> String {
    if verdict.effects.is_empty() {
        return verdict.sentence.clone();
    }
    let named: Vec<String> = verdict
        .effects
        .iter()
        .map(|effect| {
            let places: Vec<&str> = effect.places.iter().map(String::as_str).collect();
            words::effect_at_places(&effect.effect, effect.form.as_deref(), &places)
        })
        .collect();
    format!("The model leaves out {}.", words::list(&named))
}

fn kind_word(verdict: &Verdict) -> String {
    serde_json::to_value(verdict.verdict)
        .ok()
        .and_then(|value| value.as_str().map(|word| word.replace('-', " ")))
        .unwrap_or_default()
}

/// Errors of the free run: held out where there are any.
fn shown_errors(figures: &FitFigures) -> &BTreeMap<String, f64> {
    if figures.free_run_held_out.is_empty() {
        &figures.free_run_train
    } else {
        &figures.free_run_held_out
    }
}

fn tiles(page: &mut Page, diagnosis: &Diagnosis) {
    let verdict = &diagnosis.verdict;
    page.tile("verdict", kind_word(verdict), "", "");
    for effect in &verdict.effects {
        let (what, number, unit) =
            main_size(effect).map_or_else(Default::default, |size| size.parts());
        let note = format!(
            "{what}; there with probability {:.2}, accounts for {}",
            effect.probability,
            accounted_for(effect)
        );
        let note = note.trim_start_matches("; ");
        page.tile(effect.effect.replace('-', " "), number, unit, note);
    }
    let which = if verdict.fit.improved.free_run_held_out.is_empty() {
        "error, training"
    } else {
        "error, held out"
    };
    for output in diagnosis.outputs() {
        let unit = shown(output.unit);
        let pick = |figures: &FitFigures| {
            shown_errors(figures)
                .get(output.signal)
                .map_or_else(String::new, |value| words::digits(value * unit.per_si))
        };
        page.tile(
            format!("{}: {which}", output.signal),
            pick(&verdict.fit.improved),
            unit.unit,
            format!(
                "was {} refitted, {} as given",
                pick(&verdict.fit.refitted),
                pick(&verdict.fit.as_given)
            ),
        );
    }
}

/// The part of its law's misfit that an effect accounts for. What it mends may be more than
/// was missed: without it the others are bent to hide it.
fn accounted_for(effect: &Effect) -> String {
    format!("{:.0} %", 100.0 * effect.share.min(1.0))
}

/// The sizes in the order of the catalogue: a tube's length before its diameter.
fn sizes_of(effect: &Effect) -> Vec<words::Size> {
    let size = |(parameter, estimate): (&String, &Estimate)| words::Size {
        parameter: parameter.clone(),
        value: estimate.value,
        std: estimate.std,
    };
    let known = effects::effect(&effect.effect).map_or(&[][..], |effect| effect.parameters);
    let place = |size: &words::Size| known.iter().position(|one| one.key == size.parameter);
    let mut sizes: Vec<words::Size> = effect.parameters.iter().map(size).collect();
    sizes.sort_by_key(|size| place(size).unwrap_or(known.len()));
    sizes
}

fn spoken(effect: &Effect) -> String {
    let sizes = sizes_of(effect);
    let sizes: Vec<String> = sizes.iter().map(words::Size::spoken).collect();
    sizes.join("; ")
}

/// The first of the sizes.
fn main_size(effect: &Effect) -> Option<words::Size> {
    sizes_of(effect).into_iter().next()
}

fn where_it_sits(section: &mut Section, rig: &Rig, diagnosis: &Diagnosis) {
    let verdict = &diagnosis.verdict;
    if !verdict.located.is_empty() {
        let mut table = Table::new(["place", "part of its law's misfit", "signals", "when"]);
        for located in &verdict.located {
            table = table.row([
                Cell::from(located.place.as_str()),
                Cell::from(format!("{:.0} %", 100.0 * located.share)),
                Cell::from(located.signals.join(", ")),
                Cell::from(located.when.as_str()),
            ]);
        }
        section.table(table);
    }
    for law in &diagnosis.laws {
        section.subheading(format!("Law: {}", law.law.title()));
        section.text(
            "Each law is driven by recorded signals in place of its neighbours, so that an error of one cannot hide in another. \
             Shaded: where the refitted model misses most.",
        );
        let train = &diagnosis.train;
        let residuals = all_residuals(rig, law, &law.train, train);
        let shown = worst_recording(&residuals[Model::Refitted as usize]);
        if let Some(stack) = comparison(rig, law, &residuals, train, shown) {
            section.chart(shade_intervals(stack, &law.located, &train[shown].name));
        }
        for located in &law.located {
            located_misfit(section, located, Role::Refitted);
        }
        if law.break_aways.len() >= LEAST_BREAK_AWAYS {
            section.chart(break_aways(&law.break_aways));
        }
        if let Some(input) = &law.input {
            needed_input(section, input, Role::Refitted);
        }
        if let Some(term) = &law.term {
            let table =
                unknown_term::table(term.shape, &law.candidates[term.candidate], &law.improved);
            missing_term(section, term.shape, &table, 1.0 - term.share);
        }
    }
    if let Some(velocity) = &diagnosis.velocity {
        section.subheading("Position and velocity");
        section.text(
            "No law needs the recorded velocity. It is the rate of the position, within the noise of both: here it is not.",
        );
        located_misfit(section, velocity, Role::Refitted);
    }
}

/// Each break-away of the training recordings, over the time that the carriage had stood.
fn break_aways(events: &[BreakAway]) -> Chart {
    let of = |name: &str, role: Role, missed_n: fn(&BreakAway) -> f64| {
        let points = events.iter().map(|event| (event.rest_s, missed_n(event)));
        Series::new(name, role, points).dots()
    };
    let longest_s = events.iter().map(|event| event.rest_s).fold(0.0, f64::max);
    let known = [0.0, longest_s].map(|rest_s| (rest_s, -balance::KNOWN_TO_N, balance::KNOWN_TO_N));
    Chart::new("Break-aways: the force at which the carriage left, recorded − predicted")
        .x_axis("time at rest before", "s")
        .y_axis("force", "N")
        .height(BREAK_AWAY_HEIGHT_PX)
        .band("what a force is known to", Role::Noise, known)
        .series(of("refitted", Role::Refitted, |event| event.refitted_n))
        .series(of("improved", Role::Improved, |event| event.improved_n))
        .level(0.0, "")
        .note("A point is one moment in which the carriage left its place. The faster the force rises, the less exactly it is known: such points are drawn nearer to nought, by as much.")
}

/// Recorded against predicted, with the misfits and what drove the law, for one recording.
fn comparison(
    rig: &Rig,
    law: &LawDiagnosis,
    residuals: &[Residuals],
    recordings: &[Recording],
    shown: usize,
) -> Option<ChartStack> {
    let recording = recordings.get(shown)?;
    let models = [
        (Model::Given, "as given", Role::Given),
        (Model::Refitted, "refitted", Role::Refitted),
        (Model::Improved, "improved", Role::Improved),
    ];
    let curves = models.map(|(model, name, role)| Curve {
        name,
        role,
        residuals: &residuals[model as usize],
        shows_misfit: model != Model::Given,
    });
    let track = Track::new(recording);
    let detail = OPEN_DETAIL;
    Some(prediction_stack(
        law.law, rig, &track, shown, &curves, &law.floor, detail,
    ))
}

/// The residuals of every model.
fn all_residuals(
    rig: &Rig,
    law: &LawDiagnosis,
    runs: &[Vec<Option<Run>>],
    recordings: &[Recording],
) -> [Residuals; 3] {
    Model::ALL.map(|model| residuals(rig, law, &runs[model as usize], recordings))
}

/// Predicted less recorded, by output, recording and row.
fn residuals(
    rig: &Rig,
    law: &LawDiagnosis,
    runs: &[Option<Run>],
    recordings: &[Recording],
) -> Residuals {
    let error = |output: usize, signal: &str, run: &Option<Run>, recording: &Recording| {
        let (Some(run), Some(seen)) = (run, recording.signal(signal)) else {
            return Vec::new();
        };
        let pairs = run.predicted[output].iter().zip(seen);
        pairs.map(|(predicted, seen)| predicted - seen).collect()
    };
    law.law
        .outputs(rig)
        .iter()
        .enumerate()
        .map(|(output, one)| {
            let pairs = runs.iter().zip(recordings);
            pairs
                .map(|(run, recording)| error(output, one.signal, run, recording))
                .collect()
        })
        .collect()
}

fn by_chance(effect: &Effect) -> String {
    match effect.by_chance {
        Some(by_chance) => format!("{:.0} % or less", 100.0 * by_chance),
        None => "not asked".into(),
    }
}

fn what(section: &mut Section, verdict: &Verdict) {
    if verdict.effects.is_empty() {
        section.text("No effect is named.");
    } else {
        let mut table = Table::new([
            "effect",
            "meaning",
            "size",
            "probability",
            "accounts for (of its law's misfit)",
            "a refit would hide",
            "chance does as well",
        ]);
        for effect in &verdict.effects {
            table = table.row([
                Cell::from(format!("{} at {}", effect.effect, effect.places.join(", "))),
                Cell::from(words::meaning(&effect.effect, effect.form.as_deref())),
                Cell::from(spoken(effect)),
                Cell::number(effect.probability, 2),
                Cell::from(accounted_for(effect)),
                Cell::from(format!("{:.0} %", 100.0 * effect.masked)),
                Cell::from(by_chance(effect)),
            ]);
        }
        section.table(table);
    }
    for note in &verdict.notes {
        section.callout(note.clone());
    }
    if verdict.ranking.is_empty() {
        return;
    }
    section.subheading("Everything that was tried");
    section.text(
        "The gain is that in log-likelihood on parts of the training data, each counted once: parts that were left out of the fit or, \
         where recordings are so long that rows in and out of a fit are missed alike, parts that were in it. \
         Of effects that promised too little to be fitted it is what they promised. \
         An effect is named when it accounts for a material part of what is missing and makes these parts plainly or everywhere better predicted.",
    );
    let mut table = Table::new([
        "effect",
        "places",
        "gain",
        "probability",
        "declined because",
    ]);
    for ranked in &verdict.ranking {
        let form = ranked
            .form
            .as_ref()
            .map(|form| format!(" ({form})"))
            .unwrap_or_default();
        table = table.row([
            Cell::from(format!("{}{form}", ranked.effect)),
            Cell::from(ranked.places.join(", ")),
            Cell::number(ranked.gain, 2),
            Cell::number(ranked.probability, 2),
            Cell::from(ranked.declined.as_deref().unwrap_or("accepted")),
        ]);
    }
    section.table(table);
}

fn proof(section: &mut Section, rig: &Rig, diagnosis: &Diagnosis) {
    section.text(
        "Every parameter was frozen before a held-out recording was read. What belongs to a recording (its initial states, the skew of its logger) is estimated from it for every model alike. \
         A carriage, whose position integrates every error of force twice, is begun anew every 0.25 s; all else runs free over the whole recording.",
    );
    section.table(error_table(diagnosis));
    section.bars(error_bars(diagnosis));
    let held = !diagnosis.held_out.is_empty();
    for law in &diagnosis.laws {
        let (runs, recordings) = if held {
            (&law.held_out, &diagnosis.held_out)
        } else {
            (&law.train, &diagnosis.train)
        };
        let residuals = all_residuals(rig, law, runs, recordings);
        let shown = worst_recording(&residuals[Model::Refitted as usize]);
        let stack = comparison(rig, law, &residuals, recordings, shown);
        if let Some(stack) = stack.filter(|_| held) {
            section.chart(stack);
        }
        for (index, output) in law.law.outputs(rig).iter().enumerate() {
            residual_charts(section, &residuals, recordings, (index, shown), output);
        }
    }
}

/// Free-run errors, and those over the horizon.
fn error_table(diagnosis: &Diagnosis) -> Table {
    let fit = &diagnosis.verdict.fit;
    let mut table = Table::new([
        "error, rms",
        "unit",
        "training",
        "held out",
        "horizon, training (normalised)",
        "horizon, held out (normalised)",
    ]);
    for output in diagnosis.outputs() {
        let unit = shown(output.unit);
        let models = [
            ("as given", &fit.as_given),
            ("refitted", &fit.refitted),
            ("improved", &fit.improved),
            ("noise floor", &fit.noise_floor),
        ];
        for (label, figures) in models {
            let free = |map: &BTreeMap<String, f64>| {
                map.get(output.signal)
                    .map_or_else(String::new, |v| words::digits(v * unit.per_si))
            };
            let normal = |map: &BTreeMap<String, f64>| {
                map.get(output.signal)
                    .map_or_else(String::new, |v| words::digits(*v))
            };
            let row = [
                Cell::from(format!("{}, {label}", output.signal)),
                Cell::from(unit.unit),
                Cell::from(free(&figures.free_run_train)),
                Cell::from(free(&figures.free_run_held_out)),
                Cell::from(normal(&figures.train)),
                Cell::from(normal(&figures.held_out)),
            ];
            if label == "improved" {
                table = table.emphasised_row(row);
            } else {
                table = table.row(row);
            }
        }
    }
    table
}

/// Each model's error against that of the refitted one: how far an effect brings it towards the
/// noise. The rig as given, whose numbers alone may be off, would dwarf both.
fn error_bars(diagnosis: &Diagnosis) -> BarChart {
    let fit = &diagnosis.verdict.fit;
    let outputs = diagnosis.outputs();
    let refitted = shown_errors(&fit.refitted);
    let relative = |figures: &FitFigures| -> Vec<f64> {
        let errors = shown_errors(figures);
        let ratio = |output: &Output| {
            let (error, by) = (errors.get(output.signal)?, refitted.get(output.signal)?);
            Some(error / by)
        };
        let ratios = outputs.iter().map(ratio);
        ratios.map(|ratio| ratio.unwrap_or(f64::NAN)).collect()
    };
    BarChart::new(
        "Error, relative to the refitted model",
        outputs.iter().map(|output| output.signal),
    )
    .axis("relative error", "")
    .digits(3)
    .bars("refitted", Role::Refitted, relative(&fit.refitted))
    .bars("improved", Role::Improved, relative(&fit.improved))
    .bars("noise floor", Role::Noise, relative(&fit.noise_floor))
}

/// Histogram and spectrum of what is left, before and after.
fn residual_charts(
    section: &mut Section,
    residuals: &[Residuals],
    recordings: &[Recording],
    (index, recording): (usize, usize),
    output: &Output,
) {
    let unit = shown(output.unit);
    let of = |model: Model| -> Vec<f64> {
        let of_output = &residuals[model as usize][index];
        let shown = of_output.get(recording).into_iter().flatten();
        let values = shown.map(|residual| residual * unit.per_si);
        values.filter(|residual| residual.is_finite()).collect()
    };
    let (before, after) = (of(Model::Refitted), of(Model::Improved));
    if before.is_empty() {
        return;
    }
    let histogram = Chart::new(format!("{}: errors", output.signal))
        .x_axis("error", unit.unit)
        .y_axis("density", format!("1/{}", unit.unit))
        .series(Series::histogram(
            "refitted",
            Role::Refitted,
            &before,
            HISTOGRAM_BINS,
        ))
        .series(Series::histogram(
            "improved",
            Role::Improved,
            &after,
            HISTOGRAM_BINS,
        ));
    let step_s = recordings.get(recording).map_or(1.0, |recording| {
        crate::laws::median_step_s(&recording.time_s)
    });
    let spectrum = Chart::new(format!("{}: spectrum of the errors", output.signal))
        .x_axis("frequency", "Hz")
        .y_axis("amplitude density", format!("{}/√Hz", unit.unit))
        .logarithmic_x()
        .logarithmic_y()
        .series(Series::new(
            "refitted",
            Role::Refitted,
            amplitude_density(&before, step_s),
        ))
        .series(Series::new(
            "improved",
            Role::Improved,
            amplitude_density(&after, step_s),
        ));
    section.row(|row| {
        row.chart(histogram);
        row.chart(spectrum);
    });
}

/// Welch's estimate: Hann windows, half overlapping; rows taken as even.
fn amplitude_density(values: &[f64], step_s: f64) -> Vec<(f64, f64)> {
    let length = SEGMENT_ROWS.min(values.len());
    if length < 16 {
        return Vec::new();
    }
    let transform = FftPlanner::new().plan_fft_forward(length);
    let window: Vec<f64> = (0..length)
        .map(|k| 0.5 - 0.5 * (std::f64::consts::TAU * k as f64 / length as f64).cos())
        .collect();
    let power: f64 = window.iter().map(|w| w * w).sum();
    let mut density = vec![0.0; length / 2];
    let mut segments = 0.0;
    for start in (0..=values.len() - length).step_by((length / 2).max(1)) {
        let piece = &values[start..start + length];
        let mean = piece.iter().sum::<f64>() / length as f64;
        let mut buffer: Vec<Complex<f64>> = piece
            .iter()
            .zip(&window)
            .map(|(value, w)| Complex::new((value - mean) * w, 0.0))
            .collect();
        transform.process(&mut buffer);
        for (slot, bin) in density.iter_mut().zip(&buffer) {
            *slot += 2.0 * bin.norm_sqr() * step_s / power;
        }
        segments += 1.0;
    }
    density
        .iter()
        .enumerate()
        .skip(1)
        .map(|(bin, sum)| {
            (
                bin as f64 / (length as f64 * step_s),
                (sum / segments).sqrt(),
            )
        })
        .collect()
}

fn confusions(section: &mut Section, verdict: &Verdict) {
    if verdict.alternatives.is_empty() {
        section.text(
            "No other effect of the list explains the recordings as well as those that are named.",
        );
    }
    for pair in &verdict.alternatives {
        section.callout(format!(
            "These recordings cannot tell {}.",
            pair.join(" from ")
        ));
    }
    if let Some(next) = &verdict.next_experiment {
        section.subheading("What to record next");
        section.text(next.clone());
    }
}

/// From which size on effects that are not there would have been looked into.
fn would_have_shown(section: &mut Section, verdict: &Verdict) {
    section.text(
        "Where a law is explained to the noise, from these sizes on an effect would have left a misfit that a refit cannot take up.",
    );
    let headings = [
        "effect",
        "would show from",
        "matters from",
        "could be there",
    ];
    let row = |table: Table, effect: &WouldShow| {
        let places: Vec<&str> = effect.places.iter().map(String::as_str).collect();
        let what = words::effect_at_places(&effect.effect, effect.form.as_deref(), &places);
        let from = effect.from.as_ref();
        table.row([
            Cell::from(what),
            Cell::from(from.map_or("no size".into(), words::sizes)),
            Cell::from(words::sizes(&effect.matters_from)),
            Cell::from(if effect.hides { "yes" } else { "" }),
        ])
    };
    let table = Table::new(headings);
    section.table(verdict.would_show.iter().fold(table, row));
}

fn parameters(section: &mut Section, verdict: &Verdict) {
    let mut table = Table::new([
        "parameter",
        "given",
        "refitted",
        "improved",
        "standard deviation",
    ]);
    let cell = |value: Option<f64>| Cell::from(value.map_or_else(|| "–".to_owned(), words::digits));
    for (key, parameter) in &verdict.parameters {
        table = table.row([
            Cell::from(key.as_str()),
            cell(parameter.given),
            cell(parameter.refitted),
            cell(parameter.improved),
            cell(parameter.std),
        ]);
    }
    section.table(table);
}
