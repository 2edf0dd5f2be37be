//! A board's signals live, on a page of the loopback address.
//!
//! | file | what |
//! |---|---|
//! | `signals` | what of a tick is shown, and its units |
//! | `feed` | what board and pages share: rows, condition, notes, the recording |
//! | `board` | the one that talks to the board: ticks into the feed, orders out of it |
//! | `server` | the page, and a WebSocket for each that is open |
//! | `udp` | the same rows as JSON datagrams, for PlotJuggler |
//! | `page.html`, `scope.css`, `scope.js` | the page |
//!
//! * Every tick that the board sends reaches every page, as a number of its own: what is lost on the
//!   board or on the wire is counted as a recording counts it, and a page that cannot keep up is
//!   told what it missed. What is drawn holds the least and the greatest value of each pixel.
//! * The page is served on the loopback address only. It and its WebSocket need the token of the
//!   address that the program prints; the host's name and the origin are checked, so that another
//!   page in the same browser cannot reach the board.
//! * A page only wishes: what the board does is what `pneuma board` and `pneuma settings` would have
//!   it do, with the same refusals, and stands in the log and in the recording.

pub mod board;
pub mod feed;
pub mod server;
pub mod signals;
pub mod udp;
