//! Runs cases of one line each: `title | words`. The words are executed in order:
//!
//! - `name=hex` writes a register or bit at the end of the present cycle;
//! - `PIN=0` or `PIN=1` (upper case) sets the pin's level from the next cycle on; `PIN!0` sets it within the
//!   present cycle, as a second change;
//! - `@n` advances to cycle n (decimal; `2^50` is allowed);
//! - `name:value` expects a register (hex) or a time (decimal, `never`).

use emu_core::NEVER;

/// A device that a table drives.
pub trait TimerUnderTest {
    /// Advances to `cycle`.
    fn sync(&mut self, cycle: u64);
    /// A register, bit or time by name.
    fn get(&self, name: &str) -> u64;
    /// Writes a register or bit.
    fn set(&mut self, name: &str, value: u8);
    /// Sets a pin's level at `cycle` and later.
    fn pin(&mut self, name: &str, level: bool, cycle: u64);
    /// Whether a name is a time or a number of overflows, which are written in decimal.
    fn decimal(&self, name: &str) -> bool;
}

/// Runs every line on a new device at cycle 0.
pub fn check<D: TimerUnderTest>(make: impl Fn() -> D, text: &str) {
    let mut wrong = Vec::new();
    let mut cases = 0;
    for line in text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#')) {
        let (title, words) = line.split_once('|').unwrap_or_else(|| panic!("no bar in: {line}"));
        cases += 1;
        let (mut device, mut now, mut wants) = (make(), 0, 0);
        for word in words.split_whitespace() {
            if let Some(cycle) = word.strip_prefix('@') {
                now = cycle.strip_prefix("2^").map_or_else(|| number(cycle, 10), |power| 1 << number(power, 10));
                device.sync(now);
            } else if let Some((name, value)) = word.split_once('=') {
                if name.starts_with(char::is_uppercase) {
                    device.pin(name, value == "1", now + 1);
                } else {
                    device.set(name, number(value, 16) as u8);
                }
            } else if let Some((name, value)) = word.split_once('!') {
                device.pin(name, value == "1", now);
            } else if let Some((name, value)) = word.split_once(':') {
                wants += 1;
                let decimal = device.decimal(name);
                let want = if value == "never" { NEVER } else { number(value, if decimal { 10 } else { 16 }) };
                let found = device.get(name);
                if found != want && decimal {
                    wrong.push(format!("{}: at {now} {name} is {found}, wanted {want}", title.trim()));
                } else if found != want {
                    wrong.push(format!("{}: at {now} {name} is {found:X}h, wanted {want:X}h", title.trim()));
                }
            } else {
                panic!("what is {word} in: {line}");
            }
        }
        assert!(wants > 0, "wants nothing: {line}");
    }
    assert!(cases > 0);
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

fn number(text: &str, base: u32) -> u64 {
    u64::from_str_radix(text, base).unwrap_or_else(|_| panic!("no number: {text}"))
}
