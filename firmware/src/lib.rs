//! What a controller board does, without the board: the control task, its
//! supervision, the frames it speaks. The same code runs on the chip, in QEMU
//! and on the host; only the rooms of `board/`, which the chip's binary adds,
//! know registers.
//!
//! | room | responsibility |
//! |---|---|
//! | [`codes`] | converter codes to SI and back |
//! | [`control_task`] | one pure call a tick: sample in, command out |
//! | [`frame`] | COBS frames with a CRC over a byte stream |
//! | [`link`] | the lock-step link between controller and plant |
//! | [`parts`] | converters on a serial bus, one file per part |
#![no_std]

pub mod codes;
pub mod control_task;
pub mod frame;
pub mod link;
pub mod parts;
