//! A time measured by a clock other than the core's, converted to cycles of the core.

use emu_core::NEVER;
use emu_core::state;

/// Picoseconds per second.
const SECOND_PS: u128 = 1_000_000_000_000;

/// A delay that keeps its real duration when the core's clock changes. The remaining time is kept in
/// picoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RealTimeDelay {
    from: u64,
    left: u64,
    hz: u64,
    end: u64,
}

state! { RealTimeDelay { from, left, hz, end } if |span, _now| ![span.from, span.left, span.hz].contains(&NEVER) }

impl RealTimeDelay {
    /// Returns a delay of `us` microseconds from the edge `t` on, at a core clock of `hz` Hz.
    #[must_use]
    pub fn new(us: u32, hz: u64, t: u64) -> RealTimeDelay {
        RealTimeDelay::from_remaining(u64::from(us) * 1_000_000, hz, t)
    }

    fn from_remaining(left: u64, hz: u64, from: u64) -> RealTimeDelay {
        let cycles = (u128::from(left) * u128::from(hz)).div_ceil(SECOND_PS);
        let end = from.saturating_add(u64::try_from(cycles).unwrap_or(NEVER));
        RealTimeDelay { from, left, hz, end }
    }

    /// Returns the first edge at which the delay is over.
    #[must_use]
    pub const fn end(&self) -> u64 {
        self.end
    }

    /// Changes the core clock to `hz` Hz from `t` on.
    pub fn set_clock_hz(&mut self, hz: u64, t: u64) {
        if t < self.end {
            let gone = u128::from(t.saturating_sub(self.from)) * SECOND_PS / u128::from(self.hz.max(1));
            *self = RealTimeDelay::from_remaining(
                self.left.saturating_sub(u64::try_from(gone).unwrap_or(u64::MAX)),
                hz,
                t.max(self.from),
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::RealTimeDelay;

    #[test]
    fn spans_by_hand() {
        assert_eq!(RealTimeDelay::new(3_400, 16_000_000, 100).end(), 100 + 54_400);
        // 40 us at 32,768 Hz are 1.31 cycles.
        assert_eq!(RealTimeDelay::new(40, 32_768, 7).end(), 9);
        assert_eq!(RealTimeDelay::new(5, 0, 7).end(), 7);
        let mut span = RealTimeDelay::new(1_000, 1_000_000, 0);
        span.set_clock_hz(2_000_000, 400);
        assert_eq!(span.end(), 400 + 1_200);
        span.set_clock_hz(1_000_000, 1_000);
        assert_eq!(span.end(), 1_000 + 300);
        span.set_clock_hz(8_000_000, 1_300);
        assert_eq!(span.end(), 1_300);
    }
}
