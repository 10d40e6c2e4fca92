//! Compares the parts with models that tick, and parses random texts.

use emu_core::rng::Rng;

use super::command::{parse_assertion, parse_command};
use super::parts::usart::CodUsart;
use super::parts::wave::StimulusWave;
use super::value::CodValue;
use crate::devices::eeprom24::Eeprom24;

/// A waveform computed cycle by cycle: at each cycle with a point, the level becomes that of the point; a new
/// period may begin with the initial level.
fn ticked_wave(wave: &StimulusWave, points: &[(u64, i64)], cycles: u64) -> Vec<i64> {
    let (mut level, mut phase, mut lap) = (wave.initial, 0, 0u64);
    let mut levels = Vec::new();
    for cycle in 0..cycles {
        if cycle >= wave.start {
            if wave.holds_last && lap > 0 && phase == 0 {
                level = wave.initial;
            }
            for (at, to) in points {
                if *at == phase {
                    level = *to;
                }
            }
            phase += 1;
            if phase == wave.period {
                (phase, lap) = (0, lap + 1);
            }
        }
        levels.push(level);
    }
    levels
}

#[test]
fn waves_are_what_a_ticking_one_is() {
    let seed = 0x0A7E;
    let mut rng = Rng::new(seed);
    for turn in 0..400 {
        let mut wave = StimulusWave::default();
        (wave.start, wave.period) = (rng.below(30), rng.below(2) * rng.below(40));
        (wave.initial, wave.holds_last) = (rng.below(2) as i64 * 5000, rng.below(2) == 1);
        let mut points: Vec<(u64, i64)> = Vec::new();
        for _ in 0..rng.below(6) {
            let (at, level) = (rng.below(45), rng.below(2) as i64 * 5000);
            points.retain(|(known, _)| *known != at);
            points.push((at, level));
            wave.set(at, level);
        }
        let levels = ticked_wave(&wave, &points, 300);
        let sampled: Vec<i64> = (0..300).map(|cycle| wave.at(cycle)).collect();
        assert_eq!(sampled, levels, "seed {seed:#x} turn {turn}: {wave:?}");
        // No change is missed between two announced times.
        for cycle in 0..299 {
            let next = wave.next(cycle).unwrap_or(u64::MAX);
            assert!(next > cycle);
            let until = next.min(299) as usize;
            let still = levels[cycle as usize..until].iter().all(|level| *level == levels[cycle as usize]);
            assert!(still, "seed {seed:#x} turn {turn}: {wave:?} at {cycle}, next {next}");
        }
    }
}

/// A byte on the line, clock by clock: start, 8 bits from the lowest, stop.
fn frame(byte: u8, hz: u64, baud: u64) -> Vec<bool> {
    let bits: Vec<bool> = std::iter::once(false).chain((0..8).map(|b| byte >> b & 1 == 1)).chain([true]).collect();
    let mut clocks = Vec::new();
    for n in 0.. {
        // Number of whole bits after n clocks.
        let passed = n * baud / hz;
        match bits.get(passed as usize) {
            Some(bit) => clocks.push(*bit),
            None => return clocks,
        }
    }
    clocks
}

#[test]
fn bytes_are_sent_as_a_ticking_port_sends_them() {
    let seed = 0x5E4D;
    let mut rng = Rng::new(seed);
    for turn in 0..60 {
        let (hz, baud) = (10_000 + rng.below(10_000), 300 + rng.below(1000));
        let mut usart = CodUsart::default();
        usart.txbaud = baud;
        let bytes: Vec<u8> = (0..1 + rng.below(4)).map(|_| rng.below(256) as u8).collect();
        for byte in &bytes {
            assert!(usart.assign("tx", &CodValue::Int((*byte).into()), 0, hz));
        }
        let idle = hz.div_ceil(baud) as usize;
        let mut wanted = vec![true; idle];
        for byte in &bytes {
            wanted.extend(frame(*byte, hz, baud));
        }
        let mut t = 0;
        let mut next = usart.next_drive(0, hz);
        for (clock, level) in wanted.iter().enumerate() {
            if next == Some(clock as u64) {
                t = clock as u64;
                usart.advance(t, hz);
                next = usart.next_drive(t, hz);
            }
            // The level is right at all times, although it is only queried at announced changes.
            assert_eq!(usart.tx_level(t, hz), *level, "seed {seed:#x} turn {turn} clock {clock}");
        }
    }
}

#[test]
fn bytes_are_taken_in_from_a_line_that_ticks() {
    let seed = 0x4ECE;
    let mut rng = Rng::new(seed);
    for turn in 0..200 {
        let (hz, baud) = (10_000 + rng.below(10_000), 300 + rng.below(700));
        let mut usart = CodUsart::default();
        usart.rxbaud = baud;
        let byte = rng.below(256) as u8;
        // The sender may be off by up to 3 %.
        let off = baud * (970 + rng.below(60)) / 1000;
        let (mut level, mut t) = (true, 100 + rng.below(100));
        for bit in frame(byte, hz, off) {
            if bit != level {
                usart.on_rx_change(bit, t, hz);
                level = bit;
            }
            t += 1;
        }
        usart.sample(t + hz / baud, hz);
        assert_eq!(usart.rx, byte, "seed {seed:#x} turn {turn}: {hz} Hz, {baud} and {off} baud");
        assert_eq!(usart.next_sample(hz), None);
    }
}

/// The bus master, edge by edge.
struct Master(Eeprom24);

impl Master {
    fn start(&mut self) {
        for (pin, high) in [(0, true), (1, true), (0, false), (1, false)] {
            self.0.on_pin_change(pin, high, 0, 1_000_000);
        }
    }

    fn stop(&mut self) {
        for (pin, high) in [(0, false), (1, true), (0, true)] {
            self.0.on_pin_change(pin, high, 0, 1_000_000);
        }
    }

    /// One clock with SDA released or pulled low; returns the level of the wire while SCL is high.
    fn clock(&mut self, high: bool) -> bool {
        self.0.on_pin_change(0, high && !self.0.pulls_sda, 0, 1_000_000);
        self.0.on_pin_change(1, true, 0, 1_000_000);
        let seen = high && !self.0.pulls_sda;
        self.0.on_pin_change(1, false, 0, 1_000_000);
        seen
    }

    /// Returns true if the byte is acknowledged.
    fn send(&mut self, byte: u8) -> bool {
        for bit in (0..8).rev() {
            self.clock(byte >> bit & 1 == 1);
        }
        !self.clock(true)
    }

    fn take(&mut self, more: bool) -> u8 {
        let byte = (0..8).fold(0, |byte, _| byte << 1 | u8::from(self.clock(true)));
        self.clock(!more);
        byte
    }
}

/// Random transfers compared with a list of bytes: writes wrap around within a page, reads within the whole
/// memory.
#[test]
fn eeproms_keep_what_is_written() {
    let seed = 0x24C0;
    let mut rng = Rng::new(seed);
    for (name, size, page, bytes) in [("e24xx024", 256, 16, 1), ("e24xx16b", 2048, 16, 1), ("e24xx256", 32768, 64, 2)] {
        let mut master = Master(Eeprom24::module(name).unwrap());
        let mut cells = vec![0u8; size];
        let select = if name == "e24xx16b" { 0 } else { rng.below(8) as u8 };
        for pin in 0..3 {
            master.0.on_pin_change(2 + pin, select >> pin & 1 == 1, 0, 1_000_000);
        }
        for turn in 0..200 {
            let at = rng.below(size as u64) as usize;
            let block = if bytes == 1 { (at >> 8) as u8 } else { 0 };
            let control = 0xA0 | (select | block) << 1;
            master.start();
            if name != "e24xx16b" && rng.below(8) == 0 {
                assert!(!master.send(control ^ 2), "{name}: another chip");
                assert!(!master.send(0));
                continue;
            }
            assert!(master.send(control), "{name} turn {turn}");
            for shift in (0..bytes).rev() {
                assert!(master.send((at >> (8 * shift)) as u8));
            }
            if rng.below(2) == 0 {
                let protected = rng.below(4) == 0;
                master.0.on_pin_change(5, protected, 0, 1_000_000);
                for i in 0..rng.below(20) as usize {
                    let byte = rng.below(256) as u8;
                    assert!(master.send(byte));
                    if !protected {
                        cells[at / page * page + (at + i) % page] = byte;
                    }
                }
                master.stop();
            } else {
                master.start();
                assert!(master.send(control | 1));
                let count = 1 + rng.below(20) as usize;
                for i in 0..count {
                    let byte = master.take(i + 1 < count);
                    assert_eq!(byte, cells[(at + i) % size], "seed {seed:#x} {name} turn {turn}");
                }
                if rng.below(2) == 0 {
                    master.stop();
                }
            }
        }
        assert_eq!(master.0.cells.bytes(), cells);
    }
}

/// Any message gives either a command or an error message.
#[test]
fn random_messages_are_answered() {
    let words = [
        "module", "load", "pullup", "p1", "node", "attach", "break", "c", "0x10", "symbol", "a=1", "=", "==", "(", ")",
        "{", "}", ",", "'x'", "\"", "'", "&&", "&", "*", "-", "!", "~", "$", "0b", "b'1", "1e", ".5", "stimulus",
        "asy", "end", "é", "cycles", ".", "reg(", "dump", "e", "\\",
    ];
    let seed = 0x7E27;
    let mut rng = Rng::new(seed);
    let (mut taken, mut refused) = (0, 0);
    for _ in 0..20_000 {
        let text: Vec<&str> = (0..rng.below(7)).map(|_| words[rng.below(words.len() as u64) as usize]).collect();
        let text = text.join(if rng.below(2) == 0 { " " } else { "" });
        match (parse_command(&text).is_ok(), parse_assertion(&text).is_ok()) {
            (false, false) => refused += 1,
            _ => taken += 1,
        }
    }
    assert!(taken > 500 && refused > 500, "{taken} {refused}");
    assert!(parse_assertion(&"(".repeat(100_000)).is_err());
    assert!(parse_assertion(&"-".repeat(100_000)).is_err());
}
