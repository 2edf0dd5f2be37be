//! Damages files at random and reads them: each must give a result, in bounded memory and time.
//!
//! `cargo run -p data-files --example damage -- SECONDS SEED FILE...`; run it under `ulimit -v`, as
//! what a library allocates in vain ends the program.

use std::time::{Duration, Instant};
use std::{env, fs};

use data_files::{Between, Kind, Wanted, read};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Numbers that lengths and offsets are replaced by.
const EXTREMES: [u64; 8] = [
    0,
    1,
    7,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    u64::MAX / 2,
    u64::MAX,
];
/// A file that takes longer is reported.
const LONG: Duration = Duration::from_secs(2);

fn main() {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [seconds, seed, files @ ..] = &arguments[..] else {
        panic!("SECONDS SEED FILE...");
    };
    let seconds: f64 = seconds.parse().expect("seconds");
    let mut random = ChaCha8Rng::seed_from_u64(seed.parse().expect("a seed"));
    for file in files {
        let whole = fs::read(file).expect("a file");
        let end = Instant::now() + Duration::from_secs_f64(seconds);
        let (mut tried, mut refused, mut longest) = (0_u64, 0_u64, Duration::ZERO);
        while Instant::now() < end {
            let damaged = damaged(&whole, &mut random);
            let copy = env::temp_dir().join("damaged");
            fs::write(copy, &damaged).expect("room");
            let begin = Instant::now();
            refused += u64::from(!is_read(&damaged));
            tried += 1;
            longest = longest.max(begin.elapsed());
        }
        let slow = if longest > LONG { " SLOW" } else { "" };
        println!("{file}: {tried} tried, {refused} refused, longest {longest:?}{slow}");
    }
}

fn damaged(whole: &[u8], random: &mut ChaCha8Rng) -> Vec<u8> {
    let mut bytes = whole.to_vec();
    let below =
        |random: &mut ChaCha8Rng, limit: usize| (random.next_u64() % limit.max(1) as u64) as usize;
    for _ in 0..=below(random, 4) {
        let place = below(random, bytes.len());
        match below(random, 4) {
            0 => bytes[place] ^= 1 << below(random, 8),
            1 => bytes[place] = random.next_u32() as u8,
            2 => bytes.truncate(place.max(32)),
            _ => {
                let extreme = EXTREMES[below(random, EXTREMES.len())].to_le_bytes();
                let width = [1, 2, 4, 8][below(random, 4)].min(bytes.len() - place);
                bytes[place..place + width].copy_from_slice(&extreme[..width]);
            }
        }
    }
    bytes
}

/// Whether a table comes out, all of it.
fn is_read(bytes: &[u8]) -> bool {
    let Some(kind) = Kind::of(bytes) else {
        return false;
    };
    let wanted = ["u_V", "p_a_Pa", "x_m"].map(|name| Wanted {
        name,
        between: Between::Line,
    });
    let text = read(kind, bytes).and_then(|all| all.into_text(Some("t_s"), &wanted));
    text.is_ok_and(|mut text| std::io::copy(&mut text.reader, &mut std::io::sink()).is_ok())
}
