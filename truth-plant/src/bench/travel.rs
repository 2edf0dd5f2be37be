//! The way of a carriage that a test machine moves: pieces of constant speed
//! with smooth changes, and sines.

/// A piece of the way.
#[derive(Clone, Copy, Debug)]
pub(super) enum Piece {
    /// The speed changes to this one within the time of the change, and stays.
    Speed {
        /// Length of the piece.
        duration_s: f64,
        /// Speed after the change.
        speed_m_per_s: f64,
        /// Time of the change.
        change_s: f64,
    },
    /// A sine about where the piece before it ended, which swells in its first
    /// period and fades in its last.
    Sine {
        /// Length of the piece: whole periods.
        duration_s: f64,
        /// Amplitude.
        amplitude_m: f64,
        /// Frequency.
        frequency_hz: f64,
    },
}

impl Piece {
    fn duration_s(&self) -> f64 {
        match self {
            Self::Speed { duration_s, .. } | Self::Sine { duration_s, .. } => *duration_s,
        }
    }

    /// Way since the start of the piece, which was entered at this speed.
    fn way_m(&self, since_s: f64, entry_m_per_s: f64) -> f64 {
        match *self {
            Self::Speed {
                speed_m_per_s,
                change_s,
                ..
            } => {
                let changing_s = since_s.min(change_s);
                let turn = core::f64::consts::PI / change_s;
                // Integral of entry + gain (1 - cos(turn t)) / 2.
                let gained_s = 0.5 * (changing_s - libm::sin(turn * changing_s) / turn);
                entry_m_per_s * changing_s
                    + (speed_m_per_s - entry_m_per_s) * gained_s
                    + speed_m_per_s * (since_s - changing_s)
            }
            Self::Sine {
                duration_s,
                amplitude_m,
                frequency_hz,
            } => {
                let periods = frequency_hz * since_s.min(duration_s - since_s);
                let angle_rad = 2.0 * core::f64::consts::PI * frequency_hz * since_s;
                amplitude_m * super::smooth(periods) * libm::sin(angle_rad)
            }
        }
    }

    fn exit_m_per_s(&self) -> f64 {
        match *self {
            Self::Speed { speed_m_per_s, .. } => speed_m_per_s,
            Self::Sine { .. } => 0.0,
        }
    }
}

/// The whole way: pieces with the time, place and speed of their start.
pub(super) struct Travel {
    pieces: Vec<(f64, f64, f64, Piece)>,
    duration_s: f64,
}

impl Travel {
    /// From rest at a place.
    pub(super) fn new(start_m: f64, pieces: &[Piece]) -> Self {
        let (mut time_s, mut place_m, mut speed_m_per_s) = (0.0, start_m, 0.0);
        let mut placed = Vec::with_capacity(pieces.len());
        for piece in pieces {
            placed.push((time_s, place_m, speed_m_per_s, *piece));
            place_m += piece.way_m(piece.duration_s(), speed_m_per_s);
            time_s += piece.duration_s();
            speed_m_per_s = piece.exit_m_per_s();
        }
        Self {
            pieces: placed,
            duration_s: time_s,
        }
    }

    /// Length of the whole.
    pub(super) fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// Position at a time.
    pub(super) fn position_m(&self, time_s: f64) -> f64 {
        let after = self
            .pieces
            .partition_point(|(start_s, ..)| *start_s <= time_s);
        let (start_s, place_m, entry_m_per_s, piece) = &self.pieces[after.max(1) - 1];
        let since_s = (time_s - start_s).clamp(0.0, piece.duration_s());
        place_m + piece.way_m(since_s, *entry_m_per_s)
    }
}
