//! Where the program crashed: kept over the reset that follows, and told to who asks.
//!
//! | frame | direction | payload, little-endian |
//! |---|---|---|
//! | 0x14 | host to board | u8 kind: asks for the last crash |
//! | 0x41 | board to host | u8 kind, u8 1 if there was one since power came, u8 x24 end of the source file's name (0 where there is none), u32 line, u32 PC, u32 LR, u32 CFSR |

use crate::link::{Fields, Payload, put};

/// First byte of the question.
pub const ASK: u8 = 0x14;
/// First byte of the answer.
pub const KIND: u8 = 0x41;
/// So much of a source file's name.
pub const NAME_BYTES: usize = 24;

/// A crash.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Crash {
    /// End of the source file's name, 0 behind it; all 0 for an exception of the processor.
    pub file: [u8; NAME_BYTES],
    /// Line in it.
    pub line: u32,
    /// Where the program was when the processor raised an exception, and who had called.
    pub pc: u32,
    /// Link register.
    pub lr: u32,
    /// Configurable fault status register of the processor: what it says was wrong.
    pub cfsr: u32,
}

impl Crash {
    /// A panic at a place in the source.
    pub fn at(file: &str, line: u32) -> Self {
        let mut crash = Self {
            line,
            ..Self::default()
        };
        let skipped = file.len().saturating_sub(NAME_BYTES);
        let end = file.bytes().skip(skipped);
        crash
            .file
            .iter_mut()
            .zip(end)
            .for_each(|(to, from)| *to = from);
        crash
    }

    /// The name's end, as far as it is text.
    pub fn file(&self) -> &str {
        let length = self.file.iter().take_while(|byte| **byte != 0).count();
        let name = self.file.get(..length).unwrap_or_default();
        core::str::from_utf8(name).unwrap_or("?")
    }

    /// A sum over everything, which memory after power-up does not have by chance.
    pub fn check(&self) -> u32 {
        let (words, _) = self.file.as_chunks::<4>();
        let name = words.iter().map(|word| u32::from_le_bytes(*word));
        let numbers = [self.line, self.pc, self.lr, self.cfsr];
        let sum = name.chain(numbers).fold(0x7C0A_51E5_u32, |sum, word| {
            sum.rotate_left(5) ^ word.wrapping_mul(0x9E37_79B9)
        });
        !sum
    }
}

/// The question.
pub fn ask() -> Payload {
    let mut payload = Payload::new();
    put(&mut payload, &[ASK]);
    payload
}

/// Whether a payload is the question.
pub fn is_asked(payload: &[u8]) -> bool {
    payload == [ASK]
}

/// The answer.
pub fn told(crash: Option<&Crash>) -> Payload {
    let mut payload = Payload::new();
    let known = crash.copied().unwrap_or_default();
    put(&mut payload, &[KIND, u8::from(crash.is_some())]);
    put(&mut payload, &known.file);
    for number in [known.line, known.pc, known.lr, known.cfsr] {
        put(&mut payload, &number.to_le_bytes());
    }
    payload
}

/// Reads the answer: `None` where it is none, `Some(None)` where there was no crash.
pub fn read(payload: &[u8]) -> Option<Option<Crash>> {
    let mut fields = Fields(payload);
    if fields.u8()? != KIND {
        return None;
    }
    let has_crashed = fields.u8()? == 1;
    let mut crash = Crash::default();
    for byte in &mut crash.file {
        *byte = fields.u8()?;
    }
    crash.line = fields.u32()?;
    crash.pc = fields.u32()?;
    crash.lr = fields.u32()?;
    crash.cfsr = fields.u32()?;
    fields.end(has_crashed.then_some(crash))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_a_crash_comes_back() {
        let crash = Crash {
            pc: 0x0801_2345,
            lr: 0x0800_0001,
            cfsr: 0x8200,
            ..Crash::at("firmware/src/board/stm32f405/flash.rs", 77)
        };
        assert_eq!(crash.file(), "board/stm32f405/flash.rs");
        assert_eq!(read(&told(Some(&crash))), Some(Some(crash)));
        assert_eq!(read(&told(None)), Some(None));
        assert_eq!(read(&ask()), None);
        assert!(is_asked(&ask()) && !is_asked(&told(None)));
    }

    #[test]
    fn prop_a_short_name_stays_whole_and_a_changed_word_is_seen() {
        let crash = Crash::at("a.rs", 1);
        assert_eq!((crash.file(), crash.line), ("a.rs", 1));
        let other = Crash { line: 2, ..crash };
        assert_ne!(crash.check(), other.check());
        let zeroes = Crash::default();
        assert_ne!(zeroes.check(), 0);
    }
}
