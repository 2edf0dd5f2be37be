//! Talking to a board over its serial wire, or over TCP to one in QEMU.
//!
//! | room | responsibility |
//! |---|---|
//! | [`wire`] | frames over a serial port or a TCP connection, with time limits |
//! | [`send`] | settings to the board, with lost frames sent again |
//! | [`image`] | settings into the image of a firmware |
//! | [`recorder`] | telemetry to a recording, with every loss counted |

pub mod image;
pub mod recorder;
pub mod send;
pub mod wire;
