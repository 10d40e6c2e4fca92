//! An up-counter in closed form: it counts to its top, returns to 0, and wraps at its full width when it is above its top.

/// An up-counter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TimerCounter {
    /// The count.
    pub value: u16,
    /// The last value before it returns to 0.
    pub top: u16,
    /// The highest value of its width; it always returns to 0 after it.
    pub max: u16,
}

impl TimerCounter {
    /// The value after one step without regard to the top.
    #[must_use]
    pub const fn next_ignoring_top(self) -> u16 {
        self.value.wrapping_add(1) & self.max
    }

    /// Steps until the counter goes on from the value `x`, at least 1; `None` when it never gets there.
    #[must_use]
    pub fn steps_to_leave(self, x: u16) -> Option<u64> {
        let [value, x, end] = [self.value, x, self.round_end()].map(u64::from);
        if value <= x && x <= end {
            Some(x - value + 1)
        } else if x <= u64::from(self.top) {
            Some((end - value + 1) + x + 1)
        } else {
            None
        }
    }

    /// The value after `steps` steps.
    #[must_use]
    pub fn value_after(self, steps: u64) -> u16 {
        let [value, end] = [self.value, self.round_end()].map(u64::from);
        let ahead = end - value;
        if steps <= ahead { (value + steps) as u16 } else { ((steps - ahead - 1) % (u64::from(self.top) + 1)) as u16 }
    }

    /// The last value of the round that the counter is in.
    const fn round_end(self) -> u16 {
        if self.value <= self.top { self.top } else { self.max }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Rng;

    fn step(c: TimerCounter) -> u16 {
        if c.value == c.top || c.value == c.max { 0 } else { c.value + 1 }
    }

    #[test]
    fn closed_form_agrees_with_single_steps() {
        let seed = 0xc0de;
        let mut rng = Rng::new(seed);
        for _ in 0..3000 {
            let max = if rng.one_in(4) { 255 } else { 15 };
            let pick = |rng: &mut Rng| rng.below(u64::from(max) + 1) as u16;
            let start = TimerCounter { value: pick(&mut rng), top: pick(&mut rng), max };
            let x = pick(&mut rng);
            let (mut now, mut left) = (start, None);
            for n in 1..=600 {
                if now.value == x && left.is_none() {
                    left = Some(n);
                }
                now.value = step(now);
                assert_eq!(start.value_after(n), now.value, "seed {seed:#x}: {start:?} after {n}");
            }
            assert_eq!(start.steps_to_leave(x), left, "seed {seed:#x}: {start:?} leaves {x}");
        }
    }
}
