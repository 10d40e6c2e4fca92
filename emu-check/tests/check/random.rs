//! Random programs of all elements of LDmicro 2.3: image and evaluator agree on each.
//!
//! EMU_RANDOM_PROGRAMS sets their number (default 100), EMU_RANDOM_SEED the first seed; a failure prints seed
//! and text.

use crate::common;
use emu_check::CheckOptions;
use emu_core::rng::Rng;

/// A number from an environment variable.
fn number(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
}

#[test]
fn random_programs_agree() {
    let (first, count) = (number("EMU_RANDOM_SEED", 1), number("EMU_RANDOM_PROGRAMS", 100));
    let (mut checked, mut compared) = (0, 0);
    for seed in first..first + count {
        let text = RandomLadder(Rng::new(seed)).program();
        let program = common::parse("random.ld", &text);
        let options = CheckOptions { seed, scans: 400, ..CheckOptions::default() };
        match emu_check::check(&program, &options, &mut |_, _| {}) {
            Ok(report) => {
                assert!(report.agreed, "program {seed}:\n{text}\n{}", report.text());
                compared += report.compared;
                checked += 1;
            }
            // The only valid reason for a refusal is a scan that is too long for the period.
            Err(faults) => {
                assert!(faults.iter().all(|f| f.cause.contains("takes up to")), "{seed}: {faults:?}\n{text}")
            }
        }
    }
    println!("{checked} of {count} programs from seed {first} checked, {compared} values compared");
    assert!(checked * 10 >= count * 9, "only {checked} of {count} programs could be checked");
}

struct RandomLadder(Rng);

impl RandomLadder {
    fn pick<'a>(&mut self, from: &[&'a str]) -> &'a str {
        from[self.0.below(from.len() as u64) as usize]
    }

    fn program(&mut self) -> String {
        let cycle = self.pick(&["10000", "3333", "50000", "7001"]);
        let clock = self.pick(&["16000000", "8000000", "11059200", "3686400"]);
        let mut text = format!("LDmicro0.1\nCYCLE={cycle}\nCRYSTAL={clock}\nIO LIST\nEND\nPROGRAM\n");
        let delays = cycle.parse().unwrap_or(1);
        for _ in 0..1 + self.0.below(9) {
            text += "RUNG\n";
            self.series(&mut text, 0, true, delays);
            text += "END\n";
        }
        text
    }

    /// A series; at the right rail it may end in an element with an effect.
    fn series(&mut self, text: &mut String, depth: u32, rail: bool, cycle: u64) {
        for _ in 0..self.0.below(4) {
            if depth < 3 && self.0.one_in(5) {
                self.parallel(text, depth, false, cycle);
            } else {
                self.middle(text, cycle);
            }
        }
        match self.0.below(4) {
            0 if rail && depth < 3 => self.parallel(text, depth, true, cycle),
            1 | 2 if rail => self.end(text),
            _ => self.middle(text, cycle),
        }
    }

    fn parallel(&mut self, text: &mut String, depth: u32, rail: bool, cycle: u64) {
        *text += "PARALLEL\n";
        for _ in 0..2 + self.0.below(2) {
            let mut branch = String::new();
            self.series(&mut branch, depth + 1, rail, cycle);
            *text += &format!("SERIES\n{branch}END\n");
        }
        *text += "END\n";
    }

    /// An element that is allowed everywhere.
    fn middle(&mut self, text: &mut String, cycle: u64) {
        let line = match self.0.below(16) {
            0..7 => {
                let name = self.pick(&["Xa", "Xb", "Xc", "Ya", "Yb", "Ra", "Rb", "Rc", "Rd"]);
                format!("CONTACTS {name} {}", self.0.below(2))
            }
            7..10 => {
                let op = self.pick(&["EQU", "NEQ", "GRT", "GEQ", "LES", "LEQ"]);
                format!("{op} {} {}", self.operand(), self.operand())
            }
            10 => self.pick(&["OSR", "OSF"]).to_owned(),
            11 | 12 => {
                let kind = self.pick(&["TON", "TOF", "RTO"]);
                let scans = if self.0.one_in(6) { 32_768 } else { 2 + self.0.below(300) };
                format!("{kind} {} {}", self.pick(&["Ta", "Tb", "Tc"]), scans * cycle)
            }
            13 => {
                let kind = self.pick(&["CTU", "CTD", "CTC"]);
                let max = if kind == "CTC" { "12".to_owned() } else { self.constant() };
                format!("{kind} {} {max}", self.pick(&["Ca", "Cb"]))
            }
            14 => "SHORT".to_owned(),
            _ => self.pick(&["OPEN", "SHORT", "CONTACTS Xa 0", "COMMENT nothing"]).to_owned(),
        };
        *text += &line;
        text.push('\n');
    }

    /// An element that is only allowed at the end of a rung.
    fn end(&mut self, text: &mut String) {
        let line = match self.0.below(10) {
            0..5 => {
                let name = self.pick(&["Ya", "Yb", "Ra", "Rb", "Rc", "Rd"]);
                let flags = self.pick(&["0 0 0", "0 0 0", "1 0 0", "0 1 0", "0 0 1"]);
                format!("COIL {name} {flags}")
            }
            5 => format!("RES {}", self.pick(&["Ta", "Tb", "Tc", "Ca", "Cb"])),
            6 => format!("MOVE {} {}", self.integer(), self.operand()),
            7 if self.0.one_in(3) => "MASTER_RELAY".to_owned(),
            _ => {
                let op = self.pick(&["ADD", "SUB", "MUL", "DIV"]);
                format!("{op} {} {} {}", self.integer(), self.operand(), self.operand())
            }
        };
        *text += &line;
        text.push('\n');
    }

    fn integer(&mut self) -> &'static str {
        self.pick(&["a", "b", "c", "d", "Ta", "Ca"])
    }

    fn constant(&mut self) -> String {
        match self.0.below(3) {
            0 => self.pick(&["0", "1", "-1", "2", "255", "256", "-256", "32767", "-32768", "100"]).to_owned(),
            1 => (self.0.below(40) as i64 - 20).to_string(),
            _ => i64::from(self.0.next_u64() as i16).to_string(),
        }
    }

    fn operand(&mut self) -> String {
        if self.0.one_in(3) { self.constant() } else { self.integer().to_owned() }
    }
}
