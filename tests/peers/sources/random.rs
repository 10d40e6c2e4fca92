//! Generates random ladder programs as text, with every element of LDmicro 2.3.

use emu_core::rng::Rng;

/// Generates programs.
pub struct Generator {
    rng: Rng,
    cycle: u64,
}

impl Generator {
    /// Returns the program of a seed, always the same.
    pub fn program(seed: u64) -> String {
        let mut draw = Generator { rng: Rng::new(seed), cycle: 10_000 };
        draw.cycle = [10_000, 3_333, 50_000][draw.rng.below(3) as usize];
        let mut text = format!(
            "LDmicro0.1\nCYCLE={}\nCRYSTAL=16000000\nBAUD={}\nIO LIST\nEND\nPROGRAM\n",
            draw.cycle,
            [2400, 9600][draw.rng.below(2) as usize]
        );
        for _ in 0..1 + draw.rng.below(9) {
            text += "RUNG\n";
            draw.series(&mut text, 0, true);
            text += "END\n";
        }
        text
    }

    fn pick<'a>(&mut self, from: &[&'a str]) -> &'a str {
        from[self.rng.below(from.len() as u64) as usize]
    }

    fn series(&mut self, text: &mut String, depth: u32, rail: bool) {
        for _ in 0..self.rng.below(4) {
            if depth < 3 && self.rng.one_in(5) {
                self.parallel(text, depth, false);
            } else {
                self.middle(text);
            }
        }
        match self.rng.below(4) {
            0 if rail && depth < 3 => self.parallel(text, depth, true),
            1 | 2 if rail => self.end(text),
            _ => self.middle(text),
        }
    }

    fn parallel(&mut self, text: &mut String, depth: u32, rail: bool) {
        *text += "PARALLEL\n";
        for _ in 0..2 + self.rng.below(2) {
            let mut branch = String::new();
            self.series(&mut branch, depth + 1, rail);
            *text += &format!("SERIES\n{branch}END\n");
        }
        *text += "END\n";
    }

    /// Writes an element that may be at any position.
    fn middle(&mut self, text: &mut String) {
        let line = match self.rng.below(18) {
            0..7 => {
                let name = self.pick(&["Xa", "Xb", "Xc", "Ya", "Yb", "Ra", "Rb", "Rc"]);
                format!("CONTACTS {name} {}", self.rng.below(2))
            }
            7..10 => {
                let op = self.pick(&["EQU", "NEQ", "GRT", "GEQ", "LES", "LEQ"]);
                format!("{op} {} {}", self.operand(), self.operand())
            }
            10 => self.pick(&["OSR", "OSF"]).to_owned(),
            11 | 12 => {
                let kind = self.pick(&["TON", "TOF", "RTO"]);
                format!("{kind} {} {}", self.pick(&["Ta", "Tb"]), (2 + self.rng.below(40)) * self.cycle)
            }
            13 => {
                let kind = self.pick(&["CTU", "CTD", "CTC"]);
                let max = if kind == "CTC" { "12".to_owned() } else { self.constant() };
                format!("{kind} {} {max}", self.pick(&["Ca", "Cb"]))
            }
            14 => self.pick(&["UART_SEND a", "UART_SEND b", "UART_RECV c", "UART_RECV a"]).to_owned(),
            15 => {
                let text = self.pick(&["\"x=\\-5d\\r\\n\"", "\"\\3d\"", "\"q\\1d|\\x41\""]);
                let codes: Vec<String> = text.trim_matches('"').bytes().map(|b| b.to_string()).collect();
                format!("FORMATTED_STRING {} {} {}", self.integer(), codes.len(), codes.join(" "))
            }
            16 => "SHORT".to_owned(),
            _ => self.pick(&["OPEN", "COMMENT nothing", "CONTACTS Xa 0"]).to_owned(),
        };
        *text += &line;
        text.push('\n');
    }

    /// Writes an element that ends a rung.
    fn end(&mut self, text: &mut String) {
        let line = match self.rng.below(16) {
            0..5 => {
                let name = self.pick(&["Ya", "Yb", "Ra", "Rb", "Rc"]);
                let flags = self.pick(&["0 0 0", "0 0 0", "1 0 0", "0 1 0", "0 0 1"]);
                format!("COIL {name} {flags}")
            }
            5 => format!("RES {}", self.pick(&["Ta", "Tb", "Ca", "Cb"])),
            6 => format!("MOVE {} {}", self.integer(), self.operand()),
            7 if self.rng.one_in(3) => "MASTER_RELAY".to_owned(),
            8 => format!("SHIFT_REGISTER s {}", 2 + self.rng.below(4)),
            9 => format!("LOOK_UP_TABLE {} {} 5 0 1 -2 300 -32768 32767", self.integer(), self.integer()),
            10 => format!("PIECEWISE_LINEAR {} {} 3 0 0 10 100 200 -30", self.integer(), self.integer()),
            11 => format!("READ_ADC {}", self.pick(&["Aa", "Ab"])),
            12 => format!("SET_PWM {} 1000", self.integer()),
            13 => format!("PERSIST {}", self.pick(&["a", "b"])),
            _ => {
                let op = self.pick(&["ADD", "SUB", "MUL", "DIV"]);
                format!("{op} {} {} {}", self.integer(), self.operand(), self.operand())
            }
        };
        *text += &line;
        text.push('\n');
    }

    fn integer(&mut self) -> &'static str {
        self.pick(&["a", "b", "c", "d", "s0", "s1", "Ta", "Ca"])
    }

    fn constant(&mut self) -> String {
        match self.rng.below(3) {
            0 => self.pick(&["0", "1", "-1", "2", "255", "256", "-256", "32767", "-32768", "100"]).to_owned(),
            1 => (self.rng.below(40) as i64 - 20).to_string(),
            _ => i64::from(self.rng.next_u64() as i16).to_string(),
        }
    }

    fn operand(&mut self) -> String {
        if self.rng.one_in(3) { self.constant() } else { self.integer().to_owned() }
    }
}
