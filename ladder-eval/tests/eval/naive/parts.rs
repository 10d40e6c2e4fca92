//! Timers, the serial line and the EEPROM of the naive interpreter.

use ladder::format::StringPiece;
use ladder::{LadderProgram, TimerKind};

use super::*;

impl NaiveInterpreter {
    /// What LDmicro 5 does besides, with power.
    pub(super) fn more(&mut self, element: &Element, program: &LadderProgram) {
        match element {
            Element::Segments { display, dest, src, common } => {
                let wanted = self.operand_value(src);
                let code =
                    if wanted == 176 { 128 } else { Some(wanted).filter(|n| (0..129).contains(n)).unwrap_or(32) };
                if let LadderOperand::Var(name) = src {
                    self.store(name, code);
                }
                let lit: i64 = display.characters()[code as usize].into();
                self.store(dest, if *common == 'C' { lit } else { -1 - lit });
            }
            Element::TimeValue { is_scans, dest, time } => {
                let settings = &program.settings;
                let (times, part) =
                    if *is_scans { (1, settings.cycle_us as i64) } else { (settings.crystal_hz as i64, 1_000_000) };
                let exact = i128::from(self.operand_value(time)) * i128::from(times) / i128::from(part);
                self.store(dest, exact.rem_euclid(1 << 32) as i64);
            }
            Element::Random { dest } => {
                let state = self.sequences.get(dest).copied().unwrap_or(1);
                let next = (state * 1_103_515_245 + 12_345).rem_euclid(1 << 32);
                self.sequences.insert(dest.clone(), next);
                // The upper half comes first.
                self.store(dest, next / 65_536 + next % 65_536 * 65_536);
            }
            Element::SeedRandom { dest, src } => {
                let seed = self.operand_value(src).rem_euclid(1 << 32);
                self.sequences.insert(dest.clone(), seed);
            }
            _ => {}
        }
    }

    /// UART_SEND that waits.
    pub(super) fn send_at_once(&mut self, name: &str, bytes: u32, (power, program): (bool, &LadderProgram)) -> bool {
        let all = bits::of(self.integer(name), 32);
        for byte in all.chunks(8).take(if power { bytes as usize } else { 0 }) {
            let byte = (0..8).filter(|&n| byte[n]).map(|n| 1 << n).sum();
            self.transmit(byte, program);
        }
        if bytes == 1 {
            self.line_free = self.now;
        }
        self.now < self.line_free
    }

    /// SPI, SPI_WR, I2C_RD and I2C_WR.
    pub(super) fn on_bus(&mut self, transfer: &ladder::BusTransfer, power: bool) -> bool {
        if !power {
            return false;
        }
        let low = |value: i64| value.rem_euclid(256);
        let byte = transfer.send.as_ref().map_or(0, |send| low(self.operand_value(send)));
        let place = (self.operand_value(&transfer.device), low(self.operand_value(&transfer.register)));
        match transfer.op {
            ladder::BusOp::SpiText => {
                self.on_buses.extend(transfer.text_bytes().into_iter().map(|byte| (-1, -1, i64::from(byte))));
            }
            ladder::BusOp::Spi => self.on_buses.push((-1, -1, byte)),
            ladder::BusOp::I2cWrite => self.on_buses.push((place.0, place.1, byte)),
            ladder::BusOp::I2cRead => self.on_buses.push((place.0, place.1, -1)),
        }
        if let Some(name) = &transfer.recv {
            self.store(name, self.answer);
        }
        true
    }

    /// The number of scans that a constant delay gives.
    pub(super) fn scans_of(
        &self,
        delay: &LadderOperand,
        adjust: Option<&LadderOperand>,
        program: &LadderProgram,
    ) -> i64 {
        let five = program.dialect == LadderDialect::Ldmicro5;
        let usual = if five && program.format == LdFormat::V02 { 0 } else { -1 };
        let (delay, cycle) = (self.operand_value(delay), program.settings.cycle_us as i64);
        let adjust = adjust.map_or(usual, |adjust| self.operand_value(adjust));
        // In LDmicro 5 the sum is divided, and what is left of it below 0 is cut off.
        let sum = delay + adjust * cycle;
        if five && sum < 0 { -(-sum / cycle) } else { delay.div_euclid(cycle) + adjust }
    }

    /// One scan of a timer that counts to `scans`; a TOF begins with that.
    pub(super) fn timer(&mut self, kind: TimerKind, name: &str, scans: i64, power: bool, memory: bool) -> bool {
        if kind == TimerKind::Tof && !memory {
            self.remembered.insert(self.current_element, true);
            self.store(name, scans);
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
        self.sent.push(byte);
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
