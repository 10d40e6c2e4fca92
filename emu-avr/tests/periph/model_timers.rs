//! A model of the timers that steps cycle by cycle, and random programs: the chip must agree with it in every
//! cycle.

use crate::script::chip;
use emu_avr::chips::ATMEGA328P as CHIP;
use emu_core::rng::Rng;
use emu_core::{Bus, NEVER};

const TOV: u8 = 1;
const OCFA: u8 = 2;
const OCFB: u8 = 4;
const ICF: u8 = 0x20;

#[derive(Default, Clone, Debug)]
struct Timer {
    wide: bool,
    tccra: u8,
    tccrb: u8,
    tcnt: u16,
    ocra: u16,
    ocrb: u16,
    icr: u16,
    tifr: u8,
    timsk: u8,
    blocked: bool,
}

impl Timer {
    fn mode(&self) -> u8 {
        self.tccra & 3 | if self.wide { self.tccrb >> 3 & 3 } else { self.tccrb >> 3 & 1 } << 2
    }

    fn step(&mut self) {
        let max = if self.wide { 0xFFFF } else { 0xFF };
        let clear_at = match (self.wide, self.mode()) {
            (false, 2) | (true, 4) => Some(self.ocra),
            (true, 12) => Some(self.icr),
            _ => None,
        };
        let matches = |value: u16| !self.blocked && self.tcnt == value;
        let mut set = 0;
        if matches(self.ocra) {
            set |= OCFA;
        }
        if matches(self.ocrb) {
            set |= OCFB;
        }
        if self.wide && self.mode() == 12 && matches(self.icr) {
            set |= ICF;
        }
        let clear = clear_at.is_some_and(matches);
        if self.tcnt == max {
            set |= TOV;
        }
        self.tcnt = if clear || self.tcnt == max { 0 } else { self.tcnt + 1 };
        self.blocked = false;
        self.tifr |= set;
    }
}

#[derive(Default, Debug)]
struct Model {
    timers: [Timer; 3],
    temp: u8,
    /// Prescaler of timers 0 and 1, then that of timer 2.
    counts: [u16; 2],
    held: [bool; 2],
    gtccr: u8,
}

const STOPPED: u16 = 0;

impl Model {
    fn new() -> Model {
        let mut model = Model::default();
        model.timers[1].wide = true;
        model
    }

    fn divisor(&self, n: usize) -> u16 {
        let table = if n == 2 {
            [STOPPED, 1, 8, 32, 64, 128, 256, 1024]
        } else {
            [STOPPED, 1, 8, 64, 256, 1024, STOPPED, STOPPED]
        };
        table[usize::from(self.timers[n].tccrb & 7)]
    }

    /// Executes one clock edge, with the register written in the cycle before it.
    fn edge(&mut self, write: Option<(&str, u8)>) {
        // Flags are cleared first, so a flag that is set at this edge stays set.
        if let Some((name, value)) = write {
            for n in 0..3 {
                if name == ["TIFR0", "TIFR1", "TIFR2"][n] {
                    self.timers[n].tifr &= !value;
                }
            }
        }
        for group in 0..2 {
            if !self.held[group] {
                self.counts[group] = (self.counts[group] + 1) % 1024;
            }
        }
        for n in 0..3 {
            let (group, div) = (usize::from(n == 2), self.divisor(n));
            let edge = match div {
                STOPPED => false,
                1 => true,
                _ => !self.held[group] && self.counts[group].is_multiple_of(div),
            };
            if edge {
                self.timers[n].step();
            }
        }
        if let Some((name, value)) = write {
            self.write(name, value);
        }
    }

    fn write(&mut self, name: &str, value: u8) {
        let word = u16::from(self.temp) << 8 | u16::from(value);
        let byte = u16::from(value);
        let [t0, t1, t2] = &mut self.timers;
        match name {
            "TCCR0A" => t0.tccra = value,
            "TCCR0B" => t0.tccrb = value,
            "TCCR1A" => t1.tccra = value,
            "TCCR1B" => t1.tccrb = value,
            "TCCR2A" => t2.tccra = value,
            "TCCR2B" => t2.tccrb = value,
            "TCNT0" => (t0.tcnt, t0.blocked) = (byte, true),
            "TCNT2" => (t2.tcnt, t2.blocked) = (byte, true),
            "TCNT1L" => (t1.tcnt, t1.blocked) = (word, true),
            "TCNT1H" | "OCR1AH" | "OCR1BH" | "ICR1H" => self.temp = value,
            "OCR0A" => t0.ocra = byte,
            "OCR0B" => t0.ocrb = byte,
            "OCR2A" => t2.ocra = byte,
            "OCR2B" => t2.ocrb = byte,
            "OCR1AL" => t1.ocra = word,
            "OCR1BL" => t1.ocrb = word,
            "ICR1L" => t1.icr = word,
            "TIMSK0" => t0.timsk = value,
            "TIMSK1" => t1.timsk = value,
            "TIMSK2" => t2.timsk = value,
            "GTCCR" => {
                for (group, bit) in [1, 2].into_iter().enumerate() {
                    let clear = value & bit != 0;
                    if clear || self.held[group] {
                        self.counts[group] = 0;
                    }
                    self.held[group] = clear && value & 0x80 != 0;
                }
                self.gtccr = if value & 0x80 != 0 { value } else { 0 };
            }
            "TIFR0" | "TIFR1" | "TIFR2" => {}
            other => panic!("{other}"),
        }
    }

    fn pending(&self) -> Option<u8> {
        const ORDER: [(usize, u8, u8); 10] = [
            (2, OCFA, 7),
            (2, OCFB, 8),
            (2, TOV, 9),
            (1, ICF, 10),
            (1, OCFA, 11),
            (1, OCFB, 12),
            (1, TOV, 13),
            (0, OCFA, 14),
            (0, OCFB, 15),
            (0, TOV, 16),
        ];
        ORDER.iter().find(|(n, flag, _)| self.timers[*n].tifr & self.timers[*n].timsk & flag != 0).map(|row| row.2)
    }
}

/// Returns a random write that uses only the modelled modes.
fn random_write(rng: &mut Rng) -> (&'static str, u8) {
    const NAMES: [&str; 30] = [
        "TCCR0A", "TCCR0B", "TCCR1A", "TCCR1B", "TCCR2A", "TCCR2B", "TCNT0", "TCNT2", "TCNT1L", "TCNT1H", "OCR1AH",
        "OCR1BH", "ICR1H", "OCR0A", "OCR0B", "OCR2A", "OCR2B", "OCR1AL", "OCR1BL", "ICR1L", "TIMSK0", "TIMSK1",
        "TIMSK2", "GTCCR", "TIFR0", "TIFR1", "TIFR2", "TIFR0", "TIFR1", "TIFR2",
    ];
    let name = NAMES[rng.below(NAMES.len() as u64) as usize];
    let select = |rng: &mut Rng| if rng.one_in(3) { rng.below(8) } else { 1 + rng.below(2) } as u8;
    let value = match name {
        "TCCR0A" | "TCCR2A" => [0, 2][rng.below(2) as usize],
        "TCCR1A" => 0,
        "TCCR0B" | "TCCR2B" => select(rng),
        "TCCR1B" => select(rng) | [0x00, 0x08, 0x18][rng.below(3) as usize],
        "TCNT1H" | "OCR1AH" | "OCR1BH" | "ICR1H" => [0, 0, 0xFF, 1][rng.below(4) as usize],
        "GTCCR" => [0x00, 0x01, 0x02, 0x03, 0x81, 0x82, 0x83][rng.below(7) as usize],
        "TIMSK0" | "TIMSK2" => rng.below(8) as u8,
        "TIMSK1" => (rng.below(8) | rng.below(2) << 5) as u8,
        _ if rng.one_in(3) => rng.next_u64() as u8,
        _ => [0, 1, 2, 3, 7, 0xFD, 0xFE, 0xFF][rng.below(8) as usize],
    };
    (name, value)
}

#[test]
fn random_programs_agree_with_stepped_timers_at_every_cycle() {
    for seed in 0..25 {
        let mut rng = Rng::new(seed);
        let (mut soc, mut model) = (chip(), Model::new());
        let mut deadline = NEVER;
        let mut flags_steady = [(0, 0); 3];
        let busy = 2 + rng.below(60);
        for now in 0..6000 {
            if now > 0 && (deadline <= now || rng.one_in(50)) {
                deadline = soc.fire(now);
            }
            let place = || format!("seed {seed}, cycle {now}, {model:?}");
            for n in 0..3 {
                let want = &model.timers[n];
                let reg = |name: &str| CHIP.reg(&format!("{name}{n}")).expect("a register");
                let low = if n == 1 { CHIP.reg("TCNT1L") } else { CHIP.reg(["TCNT0", "", "TCNT2"][n]) };
                assert_eq!(soc.peek(low.expect("a register"), now), want.tcnt as u8, "TCNT{n}, {}", place());
                assert_eq!(soc.peek(reg("TIFR"), now), want.tifr, "TIFR{n}, {}", place());
                let (until, flags) = flags_steady[n];
                assert!(now >= until || want.tifr == flags, "TIFR{n} was steady until {until}, {}", place());
            }
            assert_eq!(soc.pending_interrupt(now), model.pending(), "pending, {}", place());
            if rng.one_in(10) {
                assert_eq!(soc.read(0x84, now).value, model.timers[1].tcnt as u8);
                model.temp = (model.timers[1].tcnt >> 8) as u8;
                assert_eq!(soc.read(0x85, now).value, model.temp, "TCNT1H, seed {seed}, cycle {now}");
            }
            if let Some(vector) = soc.pending_interrupt(now).filter(|_| rng.one_in(20)) {
                soc.acknowledge_interrupt(vector, now);
                let (n, first) = if vector >= 14 {
                    (0, 13)
                } else if vector >= 10 {
                    (1, 10)
                } else {
                    (2, 6)
                };
                model.timers[n].tifr &= !([ICF, OCFA, OCFB, TOV][usize::from(vector - first)]);
                deadline = soc.fire(now);
            }
            let write = rng.one_in(busy).then(|| random_write(&mut rng));
            if let Some((name, value)) = write {
                soc.write(CHIP.reg(name).expect("a register"), value, now);
                flags_steady = [(0, 0); 3];
                deadline = 0;
            } else {
                for n in 0..3 {
                    let reg = CHIP.reg(["TIFR0", "TIFR1", "TIFR2"][n]).expect("a register");
                    flags_steady[n] = (soc.steady_until(reg, now), model.timers[n].tifr);
                }
            }
            model.edge(write);
        }
    }
}
