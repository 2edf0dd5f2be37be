//! Frames on a byte stream: payload and CRC, COBS-encoded, a zero byte as the end.
//!
//! The CRC is CRC-16/CCITT-FALSE over the payload, little-endian, last. A frame
//! that does not decode, is too long, or fails its CRC is dropped and counted;
//! the next zero byte begins anew.

use crc::{CRC_16_IBM_3740, Crc};
use heapless::Vec;

/// The longest payload of any frame.
pub const LONGEST_PAYLOAD: usize = 250;
const CRC_BYTES: usize = 2;
/// COBS adds a byte to each 254, and the end mark is one more.
const LONGEST_FRAME: usize = LONGEST_PAYLOAD + CRC_BYTES + 2;

/// CRC-16/CCITT-FALSE: polynomial 0x1021, initial value 0xFFFF. The catalogue
/// lists it under its other name.
const CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_IBM_3740);

/// The CRC of frames, for records that are kept elsewhere.
pub fn crc(bytes: &[u8]) -> u16 {
    CRC.checksum(bytes)
}

/// A frame as it goes onto the wire.
pub type Frame = Vec<u8, LONGEST_FRAME>;

/// Encodes a payload; `None` where it is longer than [`LONGEST_PAYLOAD`].
pub fn encode(payload: &[u8]) -> Option<Frame> {
    if payload.len() > LONGEST_PAYLOAD {
        return None;
    }
    let mut checked: Vec<u8, { LONGEST_PAYLOAD + CRC_BYTES }> = Vec::new();
    checked.extend_from_slice(payload).ok()?;
    let crc = CRC.checksum(payload).to_le_bytes();
    checked.extend_from_slice(&crc).ok()?;
    let mut frame = Frame::new();
    frame
        .resize(cobs::max_encoding_length(checked.len()), 0)
        .ok()?;
    let length = cobs::try_encode(&checked, &mut frame).ok()?;
    frame.truncate(length);
    frame.push(0).ok()?;
    Some(frame)
}

/// What a byte completed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Received<'a> {
    /// Nothing yet.
    Nothing,
    /// A frame with this payload.
    Payload(&'a [u8]),
    /// Bytes that were no frame; they are counted.
    Dropped,
}

/// Puts frames together from bytes as they come.
#[derive(Clone, Debug, Default)]
pub struct Decoder {
    bytes: Vec<u8, LONGEST_FRAME>,
    too_long: bool,
    /// The bytes are a payload that was handed out: the next byte begins anew.
    is_handed_out: bool,
    dropped: u32,
}

impl Decoder {
    /// A decoder before its first byte.
    pub const fn new() -> Self {
        Self {
            bytes: Vec::new(),
            too_long: false,
            is_handed_out: false,
            dropped: 0,
        }
    }

    /// Frames dropped so far.
    pub fn dropped(&self) -> u32 {
        self.dropped
    }

    /// Takes one byte.
    pub fn feed(&mut self, byte: u8) -> Received<'_> {
        if self.is_handed_out {
            self.begin();
        }
        if byte != 0 {
            self.too_long |= self.bytes.push(byte).is_err();
            return Received::Nothing;
        }
        if self.bytes.is_empty() {
            return Received::Nothing;
        }
        self.is_handed_out = true;
        match self.payload_length() {
            Some(length) => Received::Payload(self.bytes.get(..length).unwrap_or(&[])),
            None => {
                self.dropped = self.dropped.saturating_add(1);
                Received::Dropped
            }
        }
    }

    fn begin(&mut self) {
        self.bytes.clear();
        self.too_long = false;
        self.is_handed_out = false;
    }

    /// Decodes in place; the payload's length if the frame is sound.
    fn payload_length(&mut self) -> Option<usize> {
        if self.too_long {
            return None;
        }
        let decoded = cobs::decode_in_place(&mut self.bytes).ok()?;
        let length = decoded.checked_sub(CRC_BYTES)?;
        let (payload, crc) = self.bytes.get(..decoded)?.split_at_checked(length)?;
        let crc = u16::from_le_bytes(crc.try_into().ok()?);
        (CRC.checksum(payload) == crc).then_some(length)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decode(decoder: &mut Decoder, bytes: &[u8]) -> (Option<Vec<u8, 256>>, u32) {
        let mut found = None;
        for byte in bytes {
            if let Received::Payload(payload) = decoder.feed(*byte) {
                found = Vec::from_slice(payload).ok();
            }
        }
        (found, decoder.dropped())
    }

    #[test]
    fn val_crc_of_the_catalogue_s_check_string() {
        // CRC-16/CCITT-FALSE of "123456789", RevEng catalogue.
        assert_eq!(CRC.checksum(b"123456789"), 0x29B1);
    }

    #[test]
    fn prop_what_is_encoded_comes_back() {
        let mut decoder = Decoder::new();
        for length in 0..=LONGEST_PAYLOAD {
            let payload: Vec<u8, 256> = (0..length).map(|place| (place * 7 % 5) as u8).collect();
            let frame = encode(&payload).expect("it fits");
            assert!(!frame[..frame.len() - 1].contains(&0));
            let (found, dropped) = decode(&mut decoder, &frame);
            assert_eq!((found.as_deref(), dropped), (Some(&payload[..]), 0));
        }
        assert!(encode(&[0; LONGEST_PAYLOAD + 1]).is_none());
    }

    #[test]
    fn prop_every_flipped_bit_is_noticed_and_the_next_frame_is_read() {
        let frame = encode(&[2, 0, 255, 1, 0, 0, 9]).expect("it fits");
        for place in 0..frame.len() - 1 {
            for bit in 0..8 {
                let mut decoder = Decoder::new();
                let mut damaged = frame.clone();
                damaged[place] ^= 1 << bit;
                let (found, _) = decode(&mut decoder, &damaged);
                assert_eq!(found, None, "byte {place} bit {bit}");
                let (found, dropped) = decode(&mut decoder, &frame);
                assert!(found.is_some() && dropped >= 1);
            }
        }
    }

    #[test]
    fn prop_an_endless_frame_is_dropped() {
        let mut decoder = Decoder::new();
        let (found, _) = decode(&mut decoder, &[7; 3000]);
        assert_eq!(found, None);
        let (found, dropped) = decode(&mut decoder, &[0]);
        assert_eq!((found, dropped), (None, 1));
    }
}
