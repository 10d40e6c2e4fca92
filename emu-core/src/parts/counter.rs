//! An up-counter in closed form. It counts up to its top and then returns to 0; from a value above the top it
//! counts up to its maximum first.

/// An up-counter with a programmable top, as in timers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TimerCounter {
    /// The present count.
    pub value: u16,
    /// The last value before the counter returns to 0.
    pub top: u16,
    /// The largest value of its width; after it the counter always returns to 0.
    pub max: u16,
}

impl TimerCounter {
    /// The value after one step if the top is ignored.
    #[must_use]
    pub const fn next_ignoring_top(self) -> u16 {
        self.value.wrapping_add(1) & self.max
    }

    /// Number of steps until the counter leaves the value `x`, at least 1; `None` if it never reaches `x`.
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

    /// The last value before the counter next returns to 0.
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
