//! Timers, the serial line and the EEPROM of the naive interpreter.

use ladder::format::StringPiece;
use ladder::{LadderProgram, TimerKind};

use super::*;

impl NaiveInterpreter {
    /// One scan of a timer that counts to `scans` and, if it is a TOF, begins with `first`.
    pub(super) fn timer(
        &mut self,
        kind: TimerKind,
        name: &str,
        (scans, first): (i64, i64),
        power: bool,
        memory: bool,
    ) -> bool {
        if kind == TimerKind::Tof && !memory {
            self.remembered.insert(self.current_element, true);
            self.store(name, first);
        }
        if kind == TimerKind::Tlo && power {
            self.armed.insert(self.current_element);
        }
        let armed = self.armed.contains(&self.current_element);
        let t = self.integer(name);
        // Whether a pulse is under way, or the phase of a cyclic timer.
        let on = match kind {
            TimerKind::Thi => memory || power,
            TimerKind::Tlo => memory || armed && !power,
            _ => memory,
        };
        let (next, out, on) = match (kind, power, t < scans) {
            (TimerKind::Ton, false, _) => (0, false, on),
            (TimerKind::Ton, true, true) => (t + 1, false, on),
            (TimerKind::Ton, true, false) => (t, true, on),
            (TimerKind::Tof, true, _) => (0, true, on),
            (TimerKind::Tof, false, true) => (t + 1, true, on),
            (TimerKind::Tof, false, false) => (t, false, on),
            (TimerKind::Rto, true, true) | (TimerKind::Rtl, false, true) => (t + 1, false, on),
            (TimerKind::Rto, false, true) | (TimerKind::Rtl, true, true) => (t, false, on),
            (TimerKind::Rto | TimerKind::Rtl, _, false) => (t, true, on),
            (TimerKind::Tcy, false, _) => (0, false, on),
            (TimerKind::Tcy, true, true) => (t + 1, on, on),
            (TimerKind::Tcy, true, false) => (0, !on, !on),
            (TimerKind::Thi, ..) if !on => (t, false, false),
            (TimerKind::Thi, _, true) => (t + 1, true, true),
            (TimerKind::Thi, true, false) => (t, false, true),
            (TimerKind::Thi, false, false) => (0, false, false),
            (TimerKind::Tlo, ..) if !on => (t, armed, false),
            (TimerKind::Tlo, _, true) => (t + 1, false, true),
            (TimerKind::Tlo, true, false) => (0, true, false),
            (TimerKind::Tlo, false, false) => (t, true, true),
        };
        if matches!(kind, TimerKind::Tcy | TimerKind::Thi | TimerKind::Tlo) {
            self.remembered.insert(self.current_element, on);
        }
        self.store(name, next);
        out
    }

    pub(super) fn transmit(&mut self, byte: u8, program: &LadderProgram) {
        let rate = program.settings.baud.expect("a rate") * program.settings.cycle_us;
        self.sent = Some(byte);
        self.line_free = self.now + (10_000_000 / rate + u64::from(10_000_000 % rate != 0)).max(1);
    }

    pub(super) fn string(&mut self, pieces: &[StringPiece], var: Option<&str>, program: &LadderProgram) -> bool {
        let Some(&(at, mut shown)) = self.texts.get(&self.current_element) else { return false };
        if at < pieces.len() && self.now >= self.line_free {
            let value = var.map_or(0, |name| self.integer(name));
            let places = pieces.iter().filter(|p| matches!(p, StringPiece::Digit { .. })).count() as u32;
            let signed = pieces.contains(&StringPiece::Sign);
            let byte = match pieces[at] {
                StringPiece::Byte(byte) => byte,
                StringPiece::Sign => {
                    let bits = 8 * self.widths[var.expect("a variable")];
                    shown = wrap_to_bits(value.abs(), bits);
                    if value < 0 { b'-' } else { b' ' }
                }
                StringPiece::Digit { divisor, first, last } => {
                    if first && !signed {
                        shown = value;
                    }
                    let above = if first { shown } else { shown % (i64::from(divisor) * 10) };
                    let blank = shown / i64::from(divisor) == 0 && !last && places > 1;
                    if blank { b' ' } else { (48 + above / i64::from(divisor)).rem_euclid(256) as u8 }
                }
            };
            self.transmit(byte, program);
            self.texts.insert(self.current_element, (at + 1, shown));
        }
        let left = self.texts[&self.current_element].0 < pieces.len();
        if !left {
            self.texts.remove(&self.current_element);
        }
        left
    }

    pub(super) fn persist(&mut self, name: &str, loaded: bool, program: &LadderProgram) {
        let (from, count) = (self.addresses[&self.current_element], self.widths[name] as usize);
        let byte = |value: i64, place: usize| value.div_euclid(256_i64.pow(place as u32)).rem_euclid(256) as u8;
        let held = |naive: &NaiveInterpreter, place: usize| naive.cells.get(&(from + place)).copied().unwrap_or(255);
        if !loaded {
            let value = (0..count).map(|place| i64::from(held(self, place)) * 256_i64.pow(place as u32)).sum();
            return self.store(name, value);
        }
        let value = self.integer(name);
        if let Some(place) = (0..count).find(|&place| held(self, place) != byte(value, place)) {
            self.cells.insert(from + place, byte(value, place));
            let cycle = program.settings.cycle_us;
            self.cells_free = self.now + 10_000 / cycle + u64::from(10_000 % cycle != 0);
        }
    }
}
