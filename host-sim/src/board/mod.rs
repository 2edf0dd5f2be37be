//! Talking to a board over its serial wire, or over TCP to one in QEMU.
//!
//! | room | responsibility |
//! |---|---|
//! | [`port`] | a serial port or a TCP connection, with time limits |
//! | [`send`] | settings to the board, with lost frames sent again |
//! | [`orders`] | what a person tells a board: status, acknowledge, move, stop |
//! | [`experiment`] | a program to the board, run and recorded |
//! | [`words`] | a status report in words |
//! | [`image`] | settings into the image of a firmware |
//! | [`recorder`] | telemetry to a recording, with every loss counted |
//! | [`twin`] | a board on the host: the firmware's code before a simulated axis |

pub mod experiment;
pub mod image;
pub mod orders;
pub mod port;
pub mod recorder;
pub mod send;
pub mod twin;
pub mod words;
