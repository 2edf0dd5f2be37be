//! The report of a diagnosis: the verdict's sentence, sizes, proof and one plot on the first
//! screen; then, folded, where, what, the proof, what it could be confused with, what to
//! record next, parameters, and how it was made.
//!
//! The page says nothing of an effect that the verdict does not say: sizes stand on the first
//! screen, and an effect is called omitted, only where the verdict names it.

use super::equation::{Standing, equation};
use super::locate::{located_misfit, missing_term, needed_input, shade_intervals};
use super::parameters::{self, Moved};
use super::prediction::{
    Curve, OPEN_DETAIL, Prediction, floor_to_draw, signal_panel, worst_recording,
};
use super::residuals::{fit_percent, spread};
use super::test_residuals;
use crate::effects;
use crate::laws::{Output, Track, balance};
use crate::recording::Recording;
use crate::report::{
    BarChart, Cell, Chart, ChartStack, Page, Provenance, Role, Section, Series, Table, number,
};
use crate::rig::Rig;
use crate::signals::{self, Reading};
use diagnosis::diagnose::Diagnosis;
use diagnosis::diagnose::summary;
use diagnosis::finding::proof::Run;
use diagnosis::finding::{BreakAway, Finding, Model};
use diagnosis::identify::{Residuals, rms};
use diagnosis::unlisted::unknown_term::{self, Stand};
use diagnosis::verdict::{Effect, Estimate, Fit, FitFigures, Kind, Verdict, WouldShow};
use diagnosis::welch::Windows;
use diagnosis::words;
use std::collections::BTreeMap;

/// Bins of a histogram of residuals.
const HISTOGRAM_BINS: usize = 60;
/// From this many break-aways on they are drawn.
const LEAST_BREAK_AWAYS: usize = 3;
/// Height of their chart, CSS pixels.
const BREAK_AWAY_HEIGHT_PX: u32 = 190;
/// Height of a panel of what was recorded.
const RECORDED_HEIGHT_PX: u32 = 90;
/// Rows of one segment of a spectrum.
const SEGMENT_ROWS: usize = 1024;

/// Signals whose proof stands on the first screen.
const OPEN_PROOFS: usize = 2;
/// A second signal is shown there if its error falls by more than this factor.
const LEAST_GAIN: f64 = 1.05;

/// Makes the page.
pub fn diagnosis_page(title: &str, rig: &Rig, diagnosis: &Diagnosis, how: Provenance) -> Page {
    let verdict = &diagnosis.verdict;
    let kind = summary::kind(verdict.verdict);
    let mut page = Page::new(format!("{title}, verdict: {kind}"));
    page.lead(verdict.sentence.clone());
    tiles(&mut page, rig, diagnosis);
    page.opening(|section| first_plot(section, rig, diagnosis));
    page.folded_section("Summary", |section| section.table(in_short(diagnosis)));
    page.folded_section("Location of the misfit", |section| {
        where_it_sits(section, rig, diagnosis)
    });
    page.folded_section(what_heading(verdict), |section| what(section, verdict));
    page.folded_section(proof_heading(diagnosis), |section| {
        proof(section, rig, diagnosis)
    });
    page.folded_section("Alternatives and the next experiment", |section| {
        confusions(section, verdict);
    });
    if !verdict.would_show.is_empty() {
        page.folded_section("Detection limits of these recordings", |section| {
            would_have_shown(section, verdict)
        });
    }
    page.folded_section("Parameters", |section| parameters(section, rig, verdict));
    let fits: usize = diagnosis.laws.iter().map(|law| law.fits).sum();
    page.provenance(how.fact("models fitted", fits));
    page
}

/// Whether the verdict stands for its effects; else they are candidates.
fn is_named(verdict: &Verdict) -> bool {
    verdict.verdict == Kind::Named
}

fn what_heading(verdict: &Verdict) -> &'static str {
    if is_named(verdict) && !verdict.effects.is_empty() {
        "Omitted physics and its size"
    } else {
        "Effects considered"
    }
}

fn proof_heading(diagnosis: &Diagnosis) -> &'static str {
    if diagnosis.held_out.is_empty() {
        "Errors on the training recordings (no held-out recording given)"
    } else {
        "Proof on held-out recordings"
    }
}

/// The five lines of the terminal.
fn in_short(diagnosis: &Diagnosis) -> Table {
    let lines = summary::five_lines(diagnosis).into_iter();
    lines.fold(Table::new(["", ""]), |table, (label, line)| {
        table.row([Cell::from(label), Cell::from(line)])
    })
}

/// Errors of the free run of one of the models: held out where there is a held-out recording.
fn shown_errors<'f>(fit: &Fit, figures: &'f FitFigures) -> &'f BTreeMap<String, f64> {
    if fit.refitted.free_run_held_out.is_empty() {
        &figures.free_run_train
    } else {
        &figures.free_run_held_out
    }
}

/// The recordings that the shown errors are of.
fn judged_by(diagnosis: &Diagnosis) -> &[Recording] {
    if diagnosis.held_out.is_empty() {
        &diagnosis.train
    } else {
        &diagnosis.held_out
    }
}

fn tiles(page: &mut Page, rig: &Rig, diagnosis: &Diagnosis) {
    let verdict = &diagnosis.verdict;
    if is_named(verdict) {
        for effect in &verdict.effects {
            effect_tile(page, effect);
        }
    }
    let mut outputs = diagnosis.outputs();
    outputs.sort_by(|a, b| gain(verdict, b).total_cmp(&gain(verdict, a)));
    let tells = |place: usize, output: &Output| place == 0 || gain(verdict, output) > LEAST_GAIN;
    for (place, output) in outputs.iter().enumerate().take(OPEN_PROOFS) {
        if tells(place, output) {
            proof_tile(page, rig, diagnosis, output);
        }
    }
}

fn effect_tile(page: &mut Page, effect: &Effect) {
    let sizes = sizes_of(effect);
    let (what, number, unit) = sizes
        .first()
        .map_or_else(Default::default, words::Size::parts);
    let others: Vec<String> = sizes.iter().skip(1).map(words::Size::spoken).collect();
    let facts = [
        what,
        format!("probability {}", words::percent(effect.probability)),
        format!("explains {} of the misfit", accounted_for(effect)),
        others.join("; "),
    ];
    let facts: Vec<String> = facts.into_iter().filter(|fact| !fact.is_empty()).collect();
    let number = number.replace('-', "−");
    page.tile(
        effect.effect.replace('-', " "),
        number,
        unit,
        facts.join("; "),
    );
}

/// How much smaller the error of an output is with what was found.
fn gain(verdict: &Verdict, output: &Output) -> f64 {
    let fit = &verdict.fit;
    let of = |figures: &FitFigures| shown_errors(fit, figures).get(output.signal).copied();
    let (refitted, improved) = (of(&fit.refitted), of(&fit.improved));
    let gain = refitted
        .zip(improved)
        .map(|(refitted, improved)| refitted / improved);
    gain.filter(|gain| gain.is_finite()).unwrap_or(0.0)
}

fn proof_tile(page: &mut Page, rig: &Rig, diagnosis: &Diagnosis, output: &Output) {
    let fit = &diagnosis.verdict.fit;
    let reading = Reading::of_signal(rig, output.signal);
    let error = |figures: &FitFigures| shown_errors(fit, figures).get(output.signal).copied();
    let digits = |figures: &FitFigures| {
        error(figures).map_or_else(
            || "–".into(),
            |value| words::digits(reading.difference(value)),
        )
    };
    let which = if diagnosis.held_out.is_empty() {
        "training error"
    } else {
        "held-out error"
    };
    let refitted = format!("{} refitted", digits(&fit.refitted));
    let given = format!("{} as given", digits(&fit.as_given));
    let percent = fit_of(diagnosis, output, error(&fit.improved));
    let percent = percent.map(|fit| format!("fit {} %", number::fixed(fit, 1)));
    let notes: Vec<String> = [Some(refitted), Some(given), percent]
        .into_iter()
        .flatten()
        .collect();
    page.tile(
        format!("{}, rms {which}", signals::titled(output.signal)),
        digits(&fit.improved),
        reading.unit.clone(),
        notes.join("; "),
    );
}

/// The fit of an output with this error.
fn fit_of(diagnosis: &Diagnosis, output: &Output, error: Option<f64>) -> Option<f64> {
    let spread = spread(judged_by(diagnosis), output.signal);
    let fit = &diagnosis.verdict.fit;
    let floors = shown_errors(fit, &fit.noise_floor);
    let noise = floors.get(output.signal).copied().unwrap_or(0.0);
    fit_percent(error?, spread, noise)
}

/// Where an effect is named, the signal that it brings nearest; else the one that the refitted
/// model misses most beside its noise, where that is; of recordings that drive no law, what was
/// recorded.
fn first_plot(section: &mut Section, rig: &Rig, diagnosis: &Diagnosis) {
    let recordings = judged_by(diagnosis);
    let verdict = &diagnosis.verdict;
    let outputs = diagnosis.outputs();
    let gains = outputs.iter().map(|output| gain(verdict, output));
    let shows_gain = is_named(verdict) && gains.fold(0.0, f64::max) > LEAST_GAIN;
    let worst = diagnosis.laws.iter().flat_map(|law| {
        let residuals = residuals(
            rig,
            law,
            &law_runs(diagnosis, law)[Model::Refitted as usize],
            recordings,
        );
        let places = residuals.iter().zip(&law.floor).enumerate();
        let outputs = law.law.outputs(rig);
        let telling = |(place, (columns, floor)): (usize, (&Vec<Vec<f64>>, &f64))| {
            let telling = if shows_gain {
                gain(verdict, &outputs[place])
            } else {
                rms(columns) / floor.max(f64::MIN_POSITIVE)
            };
            (law, place, telling)
        };
        places.map(telling).collect::<Vec<_>>()
    });
    let finite = worst.filter(|(_, _, over)| over.is_finite());
    let Some((law, place, _)) = finite.max_by(|a, b| a.2.total_cmp(&b.2)) else {
        return recorded_signals(section, rig, diagnosis);
    };
    let residuals = all_residuals(rig, law, law_runs(diagnosis, law), recordings);
    let shown = worst_recording(&residuals[Model::Refitted as usize]);
    if let Some(stack) = comparison(rig, law, &residuals, recordings, shown, Some(place)) {
        section.chart(stack);
    }
}

/// The runs on the recordings that prove, or else on the training ones.
fn law_runs<'a>(diagnosis: &Diagnosis, law: &'a Finding) -> &'a [Vec<Option<Run>>] {
    if diagnosis.held_out.is_empty() {
        &law.train
    } else {
        &law.held_out
    }
}

/// What was recorded, of the recording that the verdict speaks of.
fn recorded_signals(section: &mut Section, rig: &Rig, diagnosis: &Diagnosis) {
    let sentence = &diagnosis.verdict.sentence;
    let mut recordings = diagnosis.train.iter();
    let spoken_of = recordings.find(|one| !one.name.is_empty() && sentence.contains(&one.name));
    let Some(recording) = spoken_of.or(diagnosis.train.first()) else {
        return;
    };
    let track = Track::still(recording);
    let panels = recording.signals.keys();
    let panels = panels.filter_map(|signal| signal_panel(rig, &track, signal));
    let stack = panels.fold(ChartStack::new(recording.name.clone()), |stack, panel| {
        stack.panel(panel.height(RECORDED_HEIGHT_PX).detail(OPEN_DETAIL))
    });
    section.chart(stack);
}

/// The share of its law's misfit that an effect explains. It may exceed the whole misfit:
/// without the effect the other parameters are bent to hide it.
fn accounted_for(effect: &Effect) -> String {
    format!("{:.0} %", 100.0 * effect.share.min(1.0))
}

/// The sizes in the order of the catalogue: a tube's length before its diameter.
fn sizes_of(effect: &Effect) -> Vec<words::Size> {
    let size = |(parameter, estimate): (&String, &Estimate)| words::Size {
        effect: effect.effect.clone(),
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

fn where_it_sits(section: &mut Section, rig: &Rig, diagnosis: &Diagnosis) {
    let verdict = &diagnosis.verdict;
    if !verdict.located.is_empty() {
        let mut table = Table::new(["place", "share of its law's misfit", "signals", "pattern"]);
        for located in &verdict.located {
            table = table.row([
                Cell::from(words::place(&located.place)),
                Cell::from(format!("{:.0} %", 100.0 * located.share)),
                Cell::from(signal_names(&located.signals)),
                Cell::from(located.when.as_str()),
            ]);
        }
        section.table(table);
    }
    for law in &diagnosis.laws {
        section.subheading(format!("Law: {}", law.law.title()));
        let shaded = if law.located.iter().any(|one| !one.intervals.is_empty()) {
            " Shaded: intervals with the largest misfit of the refitted model."
        } else {
            ""
        };
        section.text(format!(
            "Recorded signals drive each law in place of its neighbours, so an error of one law cannot hide in another.{shaded}"
        ));
        let train = &diagnosis.train;
        let residuals = all_residuals(rig, law, &law.train, train);
        let shown = worst_recording(&residuals[Model::Refitted as usize]);
        if let Some(stack) = comparison(rig, law, &residuals, train, shown, None) {
            section.chart(shade_intervals(stack, &law.located, &train[shown].name));
        }
        for located in &law.located {
            located_misfit(section, rig, located, Role::Refitted);
        }
        if law.break_aways.len() >= LEAST_BREAK_AWAYS {
            section.chart(break_aways(&law.break_aways));
        }
        if let Some(input) = &law.input {
            needed_input(section, rig, input, Role::Refitted);
        }
        unnamed_terms(section, rig, law);
    }
    if let Some(velocity) = &diagnosis.velocity {
        section.subheading("Position and velocity");
        section.text(
            "No law uses the recorded velocity. It differs from the rate of the recorded position by more than the noise of both sensors.",
        );
        located_misfit(section, rig, velocity, Role::Refitted);
    }
}

/// What stands for a law that nobody has named.
fn unnamed_terms(section: &mut Section, rig: &Rig, law: &Finding) {
    if let Some(said) = &law.equation {
        equation(section, rig, said, Standing::Said);
    }
    if let Some(term) = &law.term {
        let left = 1.0 - term.share;
        match &term.stand {
            Stand::Table(shape) => {
                let candidate = &law.candidates[term.candidate];
                let table = unknown_term::table(*shape, candidate, &law.improved);
                missing_term(section, rig, *shape, &table, left);
            }
            Stand::Equation(fitted) => {
                equation(section, rig, fitted, Standing::InTheRig(left));
            }
        }
    }
}

/// Each break-away of the training recordings, over the time that the carriage had stood.
fn break_aways(events: &[BreakAway]) -> Chart {
    let of = |name: &str, role: Role, misfit_n: fn(&BreakAway) -> f64| {
        let points = events.iter().map(|event| (event.rest_s, misfit_n(event)));
        Series::new(name, role, points).dots()
    };
    let longest_s = events.iter().map(|event| event.rest_s).fold(0.0, f64::max);
    let known = [0.0, longest_s].map(|rest_s| (rest_s, -balance::KNOWN_TO_N, balance::KNOWN_TO_N));
    Chart::new("Break-away force, recorded − predicted")
        .x_axis("time at rest before break-away", "s")
        .y_axis("force", "N")
        .height(BREAK_AWAY_HEIGHT_PX)
        .band("uncertainty of the force", Role::Noise, known)
        .series(of("refitted", Role::Refitted, |event| event.refitted_n))
        .series(of("improved", Role::Improved, |event| event.improved_n))
        .level(0.0, "")
        .note("Each point is one break-away. The faster the force rises, the larger its uncertainty: such points are shrunk towards zero accordingly.")
}

/// Recorded against predicted with the misfits for one recording: one output, or all with
/// what drove the law.
fn comparison(
    rig: &Rig,
    law: &Finding,
    residuals: &[Residuals],
    recordings: &[Recording],
    shown: usize,
    output: Option<usize>,
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
    let prediction = Prediction {
        law: law.law,
        rig,
        track: &Track::new(recording),
        recording: shown,
        curves: &curves,
        floor: &law.floor,
        detail: OPEN_DETAIL,
    };
    Some(output.map_or_else(|| prediction.stack(), |place| prediction.stack_of(place)))
}

/// The residuals of every model.
fn all_residuals(
    rig: &Rig,
    law: &Finding,
    runs: &[Vec<Option<Run>>],
    recordings: &[Recording],
) -> [Residuals; 3] {
    Model::ALL.map(|model| residuals(rig, law, &runs[model as usize], recordings))
}

/// Predicted less recorded, by output, recording and row.
fn residuals(
    rig: &Rig,
    law: &Finding,
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
        Some(by_chance) => format!("at most {:.0} %", 100.0 * by_chance),
        None => "not tested".into(),
    }
}

fn what(section: &mut Section, verdict: &Verdict) {
    if verdict.effects.is_empty() {
        section.text("The verdict names no effect.");
    } else {
        if !is_named(verdict) {
            section.text("The verdict does not name these effects: they are candidates.");
        }
        section.table(effects(verdict));
    }
    for note in &verdict.notes {
        section.callout(note.clone());
    }
    if !verdict.ranking.is_empty() {
        ranking(section, verdict);
    }
}

fn effects(verdict: &Verdict) -> Table {
    let mut table = Table::new([
        "effect",
        "meaning",
        "size",
        "probability",
        "share of its law's misfit",
        "hidden by a refit of the other parameters",
        "probability of the same gain by chance",
    ]);
    for effect in &verdict.effects {
        let form = effect.form.as_deref();
        table = table.row([
            Cell::from(effect_in_words(&effect.effect, form, &effect.places)),
            Cell::from(words::meaning(&effect.effect, form)),
            Cell::from(spoken(effect)),
            Cell::number(effect.probability, 2),
            Cell::from(accounted_for(effect)),
            Cell::from(format!("{:.0} %", 100.0 * effect.masked)),
            Cell::from(by_chance(effect)),
        ]);
    }
    table
}

fn ranking(section: &mut Section, verdict: &Verdict) {
    section.subheading("All candidates");
    section.text(
        "Gain: increase in log-likelihood on parts of the training data that were not fitted; for long recordings, on the fitted rows. \
         For candidates that were not fitted, the gain of a linearised fit. \
         An effect is accepted if it explains a material share of the misfit and improves the prediction of these parts clearly, or of all of them.",
    );
    let mut table = Table::new(["effect", "places", "gain", "probability", "result"]);
    for ranked in &verdict.ranking {
        let form = ranked
            .form
            .as_ref()
            .map(|form| format!(" ({form})"))
            .unwrap_or_default();
        table = table.row([
            Cell::from(format!("{}{form}", ranked.effect.replace('-', " "))),
            Cell::from(places_in_words(&ranked.places)),
            Cell::number(ranked.gain, 2),
            Cell::number(ranked.probability, 2),
            Cell::from(ranked.declined.as_deref().unwrap_or("accepted")),
        ]);
    }
    section.table(table);
}

fn proof(section: &mut Section, rig: &Rig, diagnosis: &Diagnosis) {
    section.text(
        "All shared parameters were frozen before the held-out recordings were read. The initial states of a recording, and the time skew of its logger, are estimated from that recording for every model. \
         The carriage position is predicted in windows of 0.25 s, as it integrates every force error twice; all other signals are predicted over the whole recording.",
    );
    section.table(error_table(rig, diagnosis));
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
        let stack = comparison(rig, law, &residuals, recordings, shown, None);
        if let Some(stack) = stack.filter(|_| held) {
            section.chart(stack);
        }
        section.subheading(format!("Residual tests: {}", law.law.title()));
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        let [_, refitted, improved] = &residuals;
        let models = [
            ("refitted", Role::Refitted, refitted),
            ("improved", Role::Improved, improved),
        ];
        test_residuals(section, law.law, rig, &tracks, &models);
        for (index, output) in law.law.outputs(rig).iter().enumerate() {
            residual_charts(section, rig, &residuals, recordings, (index, shown), output);
        }
    }
}

/// Free-run errors, those over the horizon, and the fit.
fn error_table(rig: &Rig, diagnosis: &Diagnosis) -> Table {
    let fit = &diagnosis.verdict.fit;
    let mut table = Table::new([
        "rms error",
        "unit",
        "training",
        "held-out",
        "fit, %",
        "horizon / spread, training",
        "horizon / spread, held-out",
    ]);
    for output in diagnosis.outputs() {
        let reading = Reading::of_signal(rig, output.signal);
        let models = [
            ("as given", &fit.as_given),
            ("refitted", &fit.refitted),
            ("improved", &fit.improved),
            ("noise floor", &floor_below(fit, output.signal)),
        ];
        for (label, figures) in models {
            let of = |map: &BTreeMap<String, f64>| map.get(output.signal).copied();
            let free =
                |map| of(map).map_or_else(|| "–".into(), |v| words::digits(reading.difference(v)));
            let normal = |map| of(map).map_or_else(|| "–".into(), words::digits);
            let percent = fit_of(diagnosis, &output, of(shown_errors(fit, figures)));
            let row = [
                Cell::from(format!("{}, {label}", signals::titled(output.signal))),
                Cell::from(reading.unit.clone()),
                Cell::from(free(&figures.free_run_train)),
                Cell::from(free(&figures.free_run_held_out)),
                percent.map(|percent| Cell::number(percent, 1)).into(),
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

/// The noise floor of the shown errors, if it is not above them.
fn drawn_floor(fit: &Fit, signal: &str) -> Option<f64> {
    let floor = floor_below(fit, signal);
    shown_errors(fit, &floor).get(signal).copied()
}

/// The noise floor of a signal where no model is below it.
fn floor_below(fit: &Fit, signal: &str) -> FitFigures {
    let of = |pick: fn(&FitFigures) -> &BTreeMap<String, f64>| {
        let error = |figures| pick(figures).get(signal).copied();
        let errors = [&fit.refitted, &fit.improved].into_iter().filter_map(error);
        let least = errors.fold(f64::NAN, f64::min);
        let floor = error(&fit.noise_floor).and_then(|floor| floor_to_draw(floor, least));
        floor
            .map(|floor| (signal.to_owned(), floor))
            .into_iter()
            .collect()
    };
    FitFigures {
        train: of(|figures| &figures.train),
        held_out: of(|figures| &figures.held_out),
        free_run_train: of(|figures| &figures.free_run_train),
        free_run_held_out: of(|figures| &figures.free_run_held_out),
    }
}

/// Each model's error against that of the refitted one: how far an effect brings it towards the
/// noise. The rig as given, whose numbers alone may be off, would dwarf both.
fn error_bars(diagnosis: &Diagnosis) -> BarChart {
    let fit = &diagnosis.verdict.fit;
    let outputs = diagnosis.outputs();
    let refitted = shown_errors(fit, &fit.refitted);
    let relative = |figures: &FitFigures| -> Vec<f64> {
        let errors = shown_errors(fit, figures);
        let ratio = |output: &Output| {
            let (error, by) = (errors.get(output.signal)?, refitted.get(output.signal)?);
            Some(error / by)
        };
        let ratios = outputs.iter().map(ratio);
        ratios.map(|ratio| ratio.unwrap_or(f64::NAN)).collect()
    };
    let floors = outputs.iter().map(|output| {
        let floor = drawn_floor(fit, output.signal);
        let ratio = floor.zip(refitted.get(output.signal));
        ratio.map_or(f64::NAN, |(floor, by)| floor / by)
    });
    let floors: Vec<f64> = floors.collect();
    BarChart::new(
        "Error relative to the refitted model",
        outputs.iter().map(|output| signals::titled(output.signal)),
    )
    .axis("relative rms error", "")
    .digits(3)
    .bars("refitted", Role::Refitted, relative(&fit.refitted))
    .bars("improved", Role::Improved, relative(&fit.improved))
    .bars("noise floor", Role::Noise, floors)
    .note("A dash: the estimated noise floor is not below the error.")
}

/// Histogram and spectrum of the residual, before and after.
fn residual_charts(
    section: &mut Section,
    rig: &Rig,
    residuals: &[Residuals],
    recordings: &[Recording],
    (index, recording): (usize, usize),
    output: &Output,
) {
    let reading = Reading::of_signal(rig, output.signal);
    let unit = &reading.unit;
    let name = signals::titled(output.signal);
    let of = |model: Model| -> Vec<f64> {
        let of_output = &residuals[model as usize][index];
        let shown = of_output.get(recording).into_iter().flatten();
        let values = shown.map(|residual| reading.difference(*residual));
        values.filter(|residual| residual.is_finite()).collect()
    };
    let (before, after) = (of(Model::Refitted), of(Model::Improved));
    if before.is_empty() {
        return;
    }
    let histogram = Chart::new(format!("{name}: distribution of the residual"))
        .x_axis("residual", unit.clone())
        .y_axis("density", format!("1/{unit}"))
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
    let spectrum = Chart::new(format!("{name}: spectrum of the residual"))
        .x_axis("frequency", "Hz")
        .y_axis("amplitude density", format!("{unit}/√Hz"))
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
    let windows = Windows::new(length);
    let power = windows.power();
    let mut density = vec![0.0; length / 2];
    let mut segments = 0.0;
    for start in windows.starts(values.len()) {
        let spectrum = windows.spectrum(&values[start..start + length]);
        for (slot, bin) in density.iter_mut().zip(&spectrum) {
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
        section.text("No other effect of the list explains the recordings equally well.");
    }
    for pair in &verdict.alternatives {
        let pair: Vec<String> = pair.iter().map(|name| name.replace('-', " ")).collect();
        section.callout(format!(
            "These recordings cannot distinguish {}.",
            words::list(&pair)
        ));
    }
    if let Some(next) = &verdict.next_experiment {
        section.subheading("Next experiment");
        section.text(next.clone());
    }
}

/// From which size on effects that are not there would have been looked into.
fn would_have_shown(section: &mut Section, verdict: &Verdict) {
    section.text(
        "For laws whose misfit is at the noise floor: from the detection limit on, an effect would have left a misfit that a refit cannot absorb.",
    );
    let headings = [
        "effect",
        "detection limit",
        "relevant from",
        "may be present undetected",
    ];
    let row = |table: Table, effect: &WouldShow| {
        let what = effect_in_words(&effect.effect, effect.form.as_deref(), &effect.places);
        let from = effect.from.as_ref();
        table.row([
            Cell::from(what),
            Cell::from(from.map_or("not detectable".into(), |from| {
                words::sizes(&effect.effect, from)
            })),
            Cell::from(words::sizes(&effect.effect, &effect.matters_from)),
            Cell::from(if effect.hides { "yes" } else { "" }),
        ])
    };
    let table = Table::new(headings);
    section.table(verdict.would_show.iter().fold(table, row));
}

fn parameters(section: &mut Section, rig: &Rig, verdict: &Verdict) {
    if let Some(chart) = parameters::prior_to_posterior(&moved(rig, verdict)) {
        section.bars(chart);
    }
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
            Cell::from(parameters::label(key)),
            cell(parameter.given),
            cell(parameter.refitted),
            cell(parameter.improved),
            cell(parameter.std),
        ]);
    }
    section.table(table);
}

/// The parameters that the rig file states with an uncertainty.
fn moved(rig: &Rig, verdict: &Verdict) -> Vec<Moved> {
    let moved = |(key, parameter): (&String, &diagnosis::verdict::Parameter)| {
        Some(Moved {
            key: key.clone(),
            given: rig.value(key)?,
            prior_sd: rig.uncertainty_sd(key)?,
            fitted: parameter.improved?,
            fitted_sd: parameter.std,
        })
    };
    verdict.parameters.iter().filter_map(moved).collect()
}

fn effect_in_words(effect: &str, form: Option<&str>, places: &[String]) -> String {
    let places: Vec<&str> = places.iter().map(String::as_str).collect();
    words::effect_at_places(effect, form, &places)
}

fn places_in_words(places: &[String]) -> String {
    let places: Vec<String> = places.iter().map(|place| words::place(place)).collect();
    places.join(", ")
}

fn signal_names(names: &[String]) -> String {
    let names: Vec<&str> = names.iter().map(|one| signals::spoken(one)).collect();
    names.join(", ")
}

#[cfg(test)]
mod tests;
