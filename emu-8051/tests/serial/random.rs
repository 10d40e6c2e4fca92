//! Random traffic on three ports: one that is stepped only when something is due, one that is stepped at
//! every tick, and the model.

use std::collections::VecDeque;

use emu_8051::periph::serial::{REN, RI, SerialLine, SerialPort, SerialStep, TI};
use emu_core::NEVER;
use emu_core::rng::Rng;

use crate::model::Model;

/// Future levels of RXD, each with the number of receive ticks for which it lasts.
#[derive(Default)]
struct Wire(VecDeque<(u64, bool)>);

impl Wire {
    fn tick(&mut self, rng: &mut Rng) -> bool {
        while self.0.front().is_none_or(|run| run.0 == 0) {
            if self.0.pop_front().is_none() {
                self.refill(rng);
            }
        }
        let Some(run) = self.0.front_mut() else { return true };
        run.0 -= 1;
        run.1
    }

    /// Adds a frame at about the correct rate, idle time, noise, a glitch or a break.
    fn refill(&mut self, rng: &mut Rng) {
        self.0.push_back((rng.below(4) * rng.below(40), true));
        match rng.below(12) {
            0 => self.0.extend((0..rng.below(60)).map(|n| (1 + rng.below(6), n & 1 == 0))),
            1 => self.0.extend([(1 + rng.below(12), false), (rng.below(40), true)]),
            2 => self.0.push_back((100 + rng.below(300), false)),
            kind => {
                // Ends of bits in hundredths of a tick: at most 3 % off, or at a rate that is clearly wrong.
                let rate = if kind == 3 { 1_100 + rng.below(1_000) } else { 1_552 + rng.below(97) };
                let bits = rng.next_u64() & 0x1FF | u64::from(rng.below(16) != 0) << 9;
                let mut at = 0;
                for n in 0..11 {
                    let end = rate * (n + 1) / 100;
                    self.0.push_back((end - at, n != 0 && bits >> (n - 1) & 1 != 0));
                    at = end;
                }
                if rng.one_in(6) {
                    let hit = rng.below(self.0.len() as u64) as usize;
                    let run = self.0[hit];
                    self.0[hit].0 = run.0 / 2;
                    self.0.insert(hit, (1, !run.1));
                }
            }
        }
    }
}

/// A port to which ticks are reported only when necessary.
#[derive(Clone)]
struct Lazy {
    port: SerialPort,
    tx: u64,
    rx: u64,
}

impl Lazy {
    fn sync(&mut self) {
        self.port.tx_advance(std::mem::take(&mut self.tx));
        self.port.rx_advance(std::mem::take(&mut self.rx));
    }

    fn synced(&self) -> SerialPort {
        let mut copy = self.clone();
        copy.sync();
        copy.port
    }

    fn tx_tick(&mut self, cycle: u64) -> SerialStep {
        if self.port.tx_ticks_to_next_step() != Some(self.tx + 1) {
            self.tx += 1;
            return SerialStep::default();
        }
        self.port.tx_advance(std::mem::take(&mut self.tx));
        self.port.step_transmitter(cycle)
    }

    fn rx_tick(&mut self, cycle: u64, level: bool) -> SerialStep {
        if self.port.rx_ticks_to_next_step() != Some(self.rx + 1) {
            self.rx += 1;
            return SerialStep::default();
        }
        self.port.rx_advance(std::mem::take(&mut self.rx));
        self.port.step_receiver(cycle, level)
    }
}

/// Ticks of a clock per machine cycle: several per cycle, or one in several cycles.
struct Rate(u64, u64);

impl Rate {
    fn draw(rng: &mut Rng) -> Rate {
        if rng.one_in(2) { Rate(1 + rng.below(6), 1) } else { Rate(1, 1 + rng.below(3)) }
    }

    fn ticks(&self, cycle: u64) -> u64 {
        if cycle.is_multiple_of(self.1) { self.0 } else { 0 }
    }
}

/// What the runs covered, so that a script that tests nothing is detected.
#[derive(Debug, Default)]
struct Seen {
    sent: [u32; 4],
    received: [u32; 4],
    lost: u32,
    stop_followed: u32,
    spoiled: u32,
    mode_changes: u32,
}

fn one(seed: u64, seen: &mut Seen) {
    let mut rng = Rng::new(seed);
    let (tx_rate, rx_rate) = (Rate::draw(&mut rng), Rate::draw(&mut rng));
    let mut model = Model::new();
    let mut lazy = Lazy { port: SerialPort::new(), tx: 0, rx: 0 };
    let mut eager = SerialPort::new();
    let mut wire = Wire::default();
    let mut level = true;
    let (mut txd, mut rxd) = (true, true);
    let mut edges = Vec::new();
    let mut sent = Vec::new();
    for cycle in 0..4_000 {
        let place = |what: &str| format!("{what}, seed {seed}, cycle {cycle}");
        let mut note = |step: SerialStep, other: SerialStep, scon: u8, now: u8| {
            assert_eq!(step, other, "{}", place("lazy step"));
            assert_eq!(step.flags, !scon & now & (RI | TI), "{}", place("flags"));
            edges.extend(step.edges());
            sent.extend(step.sent_byte.map(|byte| (cycle, byte)));
        };
        model.cycle(cycle, level);
        let was = eager.scon();
        if eager.next_shift_cycle() == cycle {
            let step = eager.step_shifter(cycle, level);
            note(lazy.port.step_shifter(cycle, level), step, was, eager.scon());
        }
        assert!(eager.next_shift_cycle() > cycle);
        let same = |model: &Model, lazy: &Lazy, eager: &SerialPort| {
            assert_eq!(lazy.synced(), *eager, "{}", place("lazy"));
            assert_eq!(eager.scon(), model.scon, "{}", place("SCON"));
            assert_eq!(eager.sbuf(), model.sbuf, "{}", place("SBUF"));
            assert_eq!(eager.flags_set_since(), model.since(), "{}", place("since"));
            assert_eq!(
                (eager.is_busy(), eager.is_receiving()),
                (model.busy(), model.receiving()),
                "{}",
                place("state")
            );
        };
        for _ in 0..tx_rate.ticks(cycle) {
            let was = eager.scon();
            let step = match eager.tx_ticks_to_next_step() {
                Some(1) => eager.step_transmitter(cycle),
                _ => {
                    eager.tx_advance(1);
                    SerialStep::default()
                }
            };
            note(lazy.tx_tick(cycle), step, was, eager.scon());
            model.tx_tick(cycle);
            same(&model, &lazy, &eager);
        }
        for _ in 0..rx_rate.ticks(cycle) {
            let now = wire.tick(&mut rng);
            if now != level {
                level = now;
                lazy.sync();
                lazy.port.set_rxd_level(level);
                eager.set_rxd_level(level);
            }
            let was = eager.scon();
            let step = eager.step_receiver(cycle, level);
            note(lazy.rx_tick(cycle, level), step, was, eager.scon());
            model.rx_tick(cycle, level);
            seen.received[usize::from(model.scon >> 6)] += u32::from(step.flags & RI != 0);
            same(&model, &lazy, &eager);
        }
        edges.sort_by_key(|edge| edge.at);
        for phase in 0..12 {
            while let Some(edge) = edges.first().filter(|edge| (edge.at.cycle, edge.at.phase) == (cycle, phase)) {
                let line = if edge.line == SerialLine::Txd { &mut txd } else { &mut rxd };
                assert_ne!(*line, edge.level, "{}", place("an edge without a change"));
                *line = edge.level;
                edges.remove(0);
            }
            let at = usize::from(phase);
            assert_eq!((txd, rxd), (model.txd[at], model.rxd[at]), "{}, clock {phase}", place("TXD, RXD"));
        }
        assert!(edges.iter().all(|edge| edge.at.cycle == cycle + 1), "{}", place("an edge in the past"));
        assert_eq!(eager.txd_at(cycle), model.txd[9], "{}", place("TXD at S5P2"));
        assert_eq!(eager.driven_rxd().unwrap_or(true), model.rxd[9], "{}", place("RXD at S5P2"));
        assert_eq!(sent, model.sent, "{}", place("sent"));

        // The program writes at the end of the cycle.
        if rng.one_in(if model.busy() { 300 } else { 20 }) || model.scon & TI != 0 && rng.one_in(20) {
            let v = rng.next_u64() as u8;
            let step = {
                lazy.sync();
                lazy.port.write_sbuf(v, cycle)
            };
            assert_eq!(step, eager.write_sbuf(v, cycle));
            seen.stop_followed += u32::from(model.stopping());
            seen.spoiled += u32::from(model.busy() && !model.stopping());
            model.write_sbuf(v);
            edges.extend(step.edges());
        }
        let due = model.scon & (RI | TI) != 0 && rng.one_in(30);
        if due || rng.one_in(400) {
            let noise = 1 << rng.below(8);
            let v = match rng.below(16) {
                0 => rng.next_u64() as u8,
                1 => model.scon ^ noise,
                2 | 3 => model.scon & !(RI | TI) ^ 0x08,
                _ => model.scon & !(RI | TI) | REN,
            };
            seen.mode_changes += u32::from((v ^ model.scon) >> 6 != 0);
            lazy.sync();
            let step = lazy.port.set_scon(v, cycle);
            assert_eq!(step, eager.set_scon(v, cycle));
            model.write_scon(v, cycle);
            edges.extend(step.edges());
            sent.extend(step.sent_byte.map(|byte| (cycle, byte)));
            same(&model, &lazy, &eager);
        }
        assert_eq!(eager.next_shift_cycle() == NEVER, !model.shifting(), "{}", place("mode 0 at rest"));
    }
    seen.lost += model.lost;
    for (n, count) in model.sent_in.into_iter().enumerate() {
        seen.sent[n] += count;
    }
    seen.received[0] += model.received_in_0;
}

#[test]
fn random_traffic_agrees_with_the_ticked_model() {
    let mut seen = Seen::default();
    for seed in 0..120 {
        one(seed, &mut seen);
    }
    let least = seen.sent.into_iter().chain(seen.received).min();
    assert!(least >= Some(40), "{seen:?}");
    assert!(seen.lost.min(seen.stop_followed).min(seen.spoiled).min(seen.mode_changes) >= 40, "{seen:?}");
}
