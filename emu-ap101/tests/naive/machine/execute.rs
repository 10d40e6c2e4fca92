//! The execute subcycle: what an instruction reads in it, and what it changes at the end of the machine
//! cycle.

use super::{Doing, Naive};
use crate::decode::{Op, Place, decode, place};

/// The changes of an instruction at the end of its cycle.
#[derive(Debug, Default)]
pub(super) struct Effects {
    accumulator: Option<bool>,
    write: Option<(Place, bool)>,
    preset: Option<(usize, u16)>,
    next: u16,
    ends: bool,
}

impl Naive {
    /// The execute subcycle (S22): all reads are done here.
    pub(super) fn execute(&mut self, at: u16) -> Effects {
        self.instructions += 1;
        let word = decode(self.ric);
        let place = place(word, self.rx);
        self.tally.executed(word);
        let a = self.a;
        let mut effects = Effects { next: self.na, ..Effects::default() };
        let entry = self.entries[self.prog];
        // Rule 13: the last word ends the program cycle.
        effects.ends = at == entry.last;
        match word.op {
            // S32, S33.
            Op::Ld => effects.accumulator = Some(self.read(place)),
            Op::Ldc => effects.accumulator = Some(!self.read(place)),
            // S36, S37.
            Op::Sto => effects.write = Some((place, a)),
            Op::Stoc => effects.write = Some((place, !a)),
            // S47, S48: only when the accumulator holds 1.
            Op::Stc if a => effects.write = Some((place, true)),
            Op::Rtc if a => effects.write = Some((place, false)),
            Op::Stc | Op::Rtc => {}
            // S53 to S59.
            Op::And => effects.accumulator = Some(a && self.read(place)),
            Op::Andc => effects.accumulator = Some(a && !self.read(place)),
            Op::Or => effects.accumulator = Some(a || self.read(place)),
            Op::Orc => effects.accumulator = Some(a || !self.read(place)),
            Op::Xor => effects.accumulator = Some(a != self.read(place)),
            Op::Not => effects.accumulator = Some(!a),
            Op::Clr => effects.accumulator = Some(false),
            Op::Jmp | Op::Jmpc => {
                if self.jumps(word.op) {
                    self.tally.event("jump taken");
                    effects.next = self.target(at);
                    effects.ends = effects.next == entry.start;
                }
            }
            Op::Nop => {}
        }
        if let Some((place, _)) = effects.write {
            self.tally.written(place);
        }
        // Rule 12: a port takes the data of the NOP after a STO, and nothing else.
        if let Some((Place::Port(n), _)) = effects.write {
            effects.write = None;
            let data = decode(self.word(self.na));
            if word.op == Op::Sto && data.op == Op::Nop && !data.indexed && self.modules[n].exists() {
                effects.preset = Some((n, data.field));
                self.tally.event("preset by software");
            }
        }
        effects
    }

    fn read(&mut self, place: Place) -> bool {
        self.tally.read(place);
        match place {
            Place::Input(n) if n >= self.config.inputs => false,
            // Rule 7: sampled before, or read now.
            Place::Input(n) if self.config.live => self.pins[n],
            Place::Input(n) => self.latches[n],
            Place::Output(n) if n >= self.config.outputs => false,
            // S41: the machine cannot read its outputs, so their image is read.
            Place::Output(n) => self.ram[256 + n],
            Place::Module(n) => {
                let q = self.modules[n].q();
                if q {
                    self.tally.module(self.modules[n].sort(), true);
                }
                q
            }
            Place::Running(n) => self.modules[n].running(),
            Place::Port(_) | Place::Nowhere => false,
            Place::Ram(n) => self.ram[n],
            Place::Image(n) => self.ram[256 + n],
        }
    }

    pub(super) fn finish(&mut self, effects: Effects) {
        if let Some(bit) = effects.accumulator {
            self.a = bit;
        }
        if let Some((n, preset)) = effects.preset {
            self.modules[n].preset = preset;
        }
        if let Some((place, bit)) = effects.write {
            match place {
                Place::Input(n) if n < self.config.inputs && !self.config.live => self.latches[n] = bit,
                Place::Output(n) if n < self.config.outputs => {
                    // S39: the bistable and its image, at the same time.
                    self.set_bistable(n, bit, (self.cycle, 0));
                    self.ram[256 + n] = bit;
                    self.written[n] = true;
                }
                Place::Module(n) => {
                    self.modules[n].write(bit);
                    self.tally.module(self.modules[n].sort(), false);
                }
                Place::Running(n) if bit => self.modules[n].reset(),
                Place::Ram(n) => self.ram[n] = bit,
                Place::Image(n) => self.ram[256 + n] = bit,
                _ => {}
            }
        }
        self.na = effects.next;
        if effects.ends {
            self.doing = Doing::Refresh(0);
        }
    }
}
