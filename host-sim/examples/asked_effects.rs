//! Effects that are asked for by name, on axes of `truth-plant` as they stand in a hall: what the
//! diagnosis says of them, from files, with the truth sealed before.
//!
//!     cargo run --release -p host-sim --example asked_effects -- 2101 8 port-throttle friction-zone
//!
//! prints a row a case, for so many seeds from the first on, and how many were named;
//! `docs/evidence.md` publishes announced runs.

#![allow(clippy::unwrap_used, reason = "a failure ends the show")]

use host_sim::trial::plan::{Concealment, Planned};
use host_sim::trial::{CaseResult, Setting, run, seal};
use truth_plant::{Kind, Nature, Strength};

fn main() {
    let mut words = std::env::args().skip(1);
    let mut number = || words.next().unwrap().parse::<u64>().unwrap();
    let (seed, count) = (number(), number());
    println!("| effect | seed | strength | built in | verdict | named first | within the set |");
    println!("|---|---:|---|---|---|---|---|");
    for effect in words {
        let (mut named, mut within) = (0, 0);
        for number in 0..count {
            let case = judged(&effect, seed + number);
            named += u64::from(case.judgement.named_first);
            within += u64::from(case.judgement.within_set);
            print_row(&effect, seed + number, &case);
        }
        println!("| **{effect}** | | | | | **{named} of {count}** | **{within} of {count}** |");
    }
}

fn judged(effect: &str, seed: u64) -> CaseResult {
    let nature = Nature::ShopFloor;
    let setting = Setting {
        seed,
        kind: Some(Kind::Single),
        nature,
    };
    let planned = Planned {
        number: 0,
        seed,
        kind: Kind::Single,
        effect: Some(effect.to_owned()),
        strength: Some(Strength::Medium),
        noise: 1.0,
        concealment: Concealment::Hidden,
        nature,
    };
    let folder =
        std::env::temp_dir().join(format!("pneuma-{effect}-{seed}-{}", std::process::id()));
    let seal = seal(setting, &planned).unwrap();
    let case = run(setting, &planned, &seal, &folder, &|_| ()).unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
    case
}

fn print_row(effect: &str, seed: u64, case: &CaseResult) {
    let truth = &case.opened.truth.effects[0];
    let sizes = truth.parameters.iter();
    let sizes: Vec<String> = sizes
        .map(|(key, size)| format!("{key} {size:.3e}"))
        .collect();
    let said = case.said.as_ref().map_or("none", |said| &said.sentence);
    let is = |yes: bool| if yes { "yes" } else { "no" };
    println!(
        "| {effect} | {seed} | {:?} | {} | {} | {} | {} |",
        truth.strength,
        sizes.join(", "),
        said.replace('|', "/"),
        is(case.judgement.named_first),
        is(case.judgement.within_set)
    );
}
