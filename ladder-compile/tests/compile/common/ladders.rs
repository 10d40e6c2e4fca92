//! Generates random ladder programs as text: both dialects, all elements except [`LEFT_OUT`], few names, so
//! that they are shared, boundary constants.

use emu_core::rng::Rng;

const INTEGERS: &[&str] = &["Ta", "Tb", "Ca", "n", "m", "s1"];

/// Elements that the programs leave out, with the reason.
#[rustfmt::skip]
pub const LEFT_OUT: &[(&str, &str)] = &[
    ("PLACEHOLDER", "an error of the check"),
    ("LABEL",       "needs rungs of its own, like the next three; `emu fuzz` generates them"),
    ("GOSUB",       "see LABEL"),
    ("SUBPROG",     "see LABEL"),
    ("ENDSUB",      "see LABEL"),
    ("LOCK",        "ends all scans"),
];

/// Generates a program of some rungs. `wide` selects dialect ldmicro-5 with integers of one to four bytes.
pub fn random_ladder(rng: &mut Rng, wide: bool) -> String {
    let mut draw = LadderGenerator { rng, wide };
    let head = if wide { "LDmicro0.2" } else { "LDmicro0.1" };
    let cycle = [10_000, 3_000, 1_000][draw.rng.below(3) as usize];
    let mut out = format!("{head}\nCYCLE={cycle}\nCRYSTAL=4000000\nBAUD=2400\nIO LIST\nEND\n");
    if wide {
        out += "VAR LIST\n";
        for name in INTEGERS.iter().filter(|name| !name.starts_with(['T', 'C'])) {
            if draw.rng.one_in(2) {
                out += &format!("  {} bytes {name}\n", 1 + draw.rng.below(4));
            }
        }
        out += "END\n";
    }
    out += "PROGRAM\n";
    for _ in 0..1 + draw.rng.below(6) {
        out += "RUNG\n";
        out += &draw.series(0, true);
        out += "END\n";
    }
    out
}

struct LadderGenerator<'a> {
    rng: &'a mut Rng,
    wide: bool,
}

impl LadderGenerator<'_> {
    fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.rng.below(from.len() as u64) as usize]
    }

    fn series(&mut self, depth: u32, whole: bool) -> String {
        let mut out = String::new();
        for _ in 0..1 + self.rng.below(4) {
            if depth < 2 && self.rng.one_in(4) {
                out += "PARALLEL\n";
                for _ in 0..2 + self.rng.below(2) {
                    let inner = self.series(depth + 1, false);
                    out += &if inner.lines().count() == 1 { inner } else { format!("SERIES\n{inner}END\n") };
                }
                out += "END\n";
            } else {
                out += &(self.element() + "\n");
            }
        }
        if whole && self.rng.one_in(2) {
            out += &format!(
                "COIL {} {}\n",
                self.pick(&["Ya", "Yb", "Ra"]),
                self.pick(&["0 0 0", "1 0 0", "0 1 0", "0 0 1"])
            );
        }
        out
    }

    fn integer(&mut self) -> &'static str {
        self.pick(INTEGERS)
    }

    fn constant(&mut self) -> i64 {
        const SOME: &[i64] = &[0, 1, -1, 2, 3, 5, 10, 100, 127, 128, -128, -129, 255, 256, 300, 32767, -32768, -32767];
        match self.rng.below(4) {
            0 => self.rng.next_u64() as i16 as i64,
            1 if self.wide => {
                self.pick(&[2_147_483_647, -2_147_483_648, 65536, 8_388_607, 8_388_608, -8_388_609, 70_000])
            }
            _ => self.pick(SOME),
        }
    }

    fn operand(&mut self) -> String {
        if self.rng.one_in(2) { self.integer().to_owned() } else { self.constant().to_string() }
    }

    fn element(&mut self) -> String {
        if self.wide && self.rng.one_in(3) {
            return self.ldmicro5_element();
        }
        let (a, b) = (self.integer(), self.integer());
        match self.rng.below(27) {
            0..=3 => format!("CONTACTS {} {}", self.pick(&["Xa", "Xb", "Ya", "Ra", "Rb"]), self.rng.below(2)),
            4 | 5 => {
                format!("COIL {} {}", self.pick(&["Ya", "Ra", "Rb"]), self.pick(&["0 0 0", "1 0 0", "0 1 0", "0 0 1"]))
            }
            6 => self.pick(&["SHORT", "OPEN", "MASTER_RELAY", "OSR", "OSF"]).to_owned(),
            7 => self.pick(&["OSR", "OSF", "COMMENT nothing"]).to_owned(),
            8 | 9 => {
                let delay = self.pick(&[20_000, 30_000, 45_000, 60_000]);
                let name = self.pick(&["Ta", "Tb"]);
                let adjust = if self.wide && self.rng.one_in(2) { " 1" } else { "" };
                format!("{} {name} {delay}{adjust}", self.pick(&["TON", "TOF", "RTO"]))
            }
            10 | 11 => {
                let kind = self.pick(&["CTU", "CTD", "CTC"]);
                let max = self.pick(&[0, 1, 2, 3, -1, 127, 32767]);
                match self.wide && self.rng.one_in(2) {
                    true => {
                        let (start, input) = (self.pick(&[0, 1, 5, -2]), self.pick(&['/', '\\', '-', 'o']));
                        let max = if self.rng.one_in(4) { "n".to_owned() } else { max.to_string() };
                        format!("{kind} Ca {max} {start} {input}")
                    }
                    false => format!("{kind} Ca {max}"),
                }
            }
            12 => format!("RES {a}"),
            13 => format!("MOVE {a} {}", self.operand()),
            14..=16 => {
                let op = self.pick(&["ADD", "SUB", "MUL", "DIV"]);
                format!("{op} {a} {} {}", self.operand(), self.operand())
            }
            17 | 18 => {
                let op = self.pick(&["EQU", "NEQ", "GRT", "GEQ", "LES", "LEQ"]);
                format!("{op} {} {}", self.operand(), self.operand())
            }
            19 => format!("SHIFT_REGISTER s {}", 1 + self.rng.below(4)),
            20 => {
                let count = 1 + self.rng.below(6);
                let values: Vec<String> = (0..count).map(|_| self.constant().to_string()).collect();
                format!("LOOK_UP_TABLE {a} {} {count} 0 {}", self.pick(&["n", "m", "3", "Ca"]), values.join(" "))
            }
            21 => self.curve(a, b),
            22 => self.pick(&["READ_ADC Ain", "READ_ADC Aux"]).to_owned(),
            23 => format!("SET_PWM {} 1000", self.pick(&["n", "50", "m"])),
            24 => self.pick(&["UART_SEND n", "UART_SEND m", "UART_RECV m", "UART_RECV n"]).to_owned(),
            25 => format!("PERSIST {}", self.pick(&["n", "m"])),
            _ => {
                let text =
                    self.pick(&["a", "ab\\1\\r", "\\5", "x\\-3yz", "\\-1", "=\\4", "\\xff\\-5", "hello", "\\2!"]);
                let var = if text.contains(|c: char| c.is_ascii_digit()) { self.pick(&["n", "m"]) } else { "(none)" };
                if self.wide {
                    format!("FORMATTED_STRING {var} \"{text}\"")
                } else {
                    let codes: Vec<String> = text.bytes().map(|b| b.to_string()).collect();
                    format!("FORMATTED_STRING {var} {} {}", codes.len(), codes.join(" "))
                }
            }
        }
    }

    /// An element that release 2.3 does not have.
    fn ldmicro5_element(&mut self) -> String {
        let (a, b) = (self.integer(), self.integer());
        let [few, other, third] = [(); 3].map(|()| self.rng.below(5));
        let coil = self.pick(&["Ya", "Ra"]);
        match self.rng.below(18) {
            17 => match few {
                0 => format!("SPI s {} {a} Master 0b00 8 MSB_FIRST 1000000", self.operand()),
                1 => "SPI_WR s ab - Master 0b00 8 MSB_FIRST 1000000".to_owned(),
                2 | 3 => format!("I2C_RD b - {a} Master 0x20 {other} MSB_FIRST 100000"),
                _ => format!("I2C_WR b {} - Master 0x20 {other} MSB_FIRST 100000", self.operand()),
            },
            16 => match few {
                0 => self.pick(&["DELAY 5", "SLEEP", "CLRWDT", "STRING t (none) \"a\""]).to_owned(),
                1 => "RETURN".to_owned(),
                _ => format!("GOTO {}", 1 + self.rng.below(9)),
            },
            0 => self.pick(&["ODR", "ODF", "OSL", "OSC"]).to_owned(),
            1 => format!("{} {} {}", self.pick(&["RTL", "TCY", "THI", "TLO"]), self.pick(&["Ta", "Tb"]), 30_000),
            2 => format!("CTR Ca {} 4 /", self.pick(&[0, 1, -2])),
            3 | 4 => format!("{} {a} {} {}", self.pick(&["MOD", "AND", "OR", "XOR"]), self.operand(), self.operand()),
            5 | 6 => {
                let op = self.pick(&["NOT", "NEG", "SWAP", "OPPOSITE", "BIN2BCD", "BCD2BIN"]);
                format!("{op} {a} {}", self.operand())
            }
            7 | 8 => {
                let count = if self.rng.one_in(2) { b.to_owned() } else { self.rng.below(9).to_string() };
                format!("{} {a} {} {count}", self.pick(&["SHL", "SHR", "SR0", "ROL", "ROR"]), self.operand())
            }
            9 => format!("{} {a} {}", self.pick(&["SET_BIT", "CLEAR_BIT"]), self.rng.below(34)),
            10 => format!("{} {a} {}", self.pick(&["IF_BIT_SET", "IF_BIT_CLEAR"]), self.rng.below(34)),
            11 => format!("BUS {a} {} 0 2 1 3 {few} {other} 7 {third}", self.operand()),
            12 => {
                let kind = self.pick(&["7SEGMENTS", "9SEGMENTS", "14SEGMENTS", "16SEGMENTS"]);
                format!("{kind} {a} {} {}", self.operand(), self.pick(&["C", "A"]))
            }
            13 => match few {
                0 => format!("TIME2COUNT {a} 70000"),
                1 => format!("TIME2DELAY {a} 70000"),
                2 => format!("SEED_RANDOM {a} {}", self.operand()),
                _ => format!("RANDOM {a}"),
            },
            14 => self
                .pick(&[
                    "UART_RECV_AVAIL",
                    "UART_SEND_READY",
                    "NPULSE_OFF",
                    "UART_RECV m 2 1",
                    "UART_RECV n 2 1",
                    "UART_RECV n 2 0",
                ])
                .to_owned(),
            _ => match few {
                0 | 1 => format!("PULSER {other} {third} {few} {} {coil}", self.operand()),
                2 => format!("NPULSE {other} 10 {coil}"),
                3 => format!("STEPPER q {other} {third} 0 0 Ya"),
                _ => format!("QUAD_ENCOD {a} 0 Xa Xb {} {coil} / {other}", self.pick(&["(none)", "Xa"])),
            },
        }
    }

    fn curve(&mut self, a: &str, b: &str) -> String {
        let mut x = self.pick(&[-100, 0, 10, -32768, 32700]);
        let mut points = vec![(x, self.pick(&[0, 100, -5, 32000]))];
        for _ in 0..1 + self.rng.below(4) {
            let dx = 1 + self.rng.below(30) as i64;
            x += dx;
            let last = points.last().map_or(0, |p| p.1);
            let dy = self.pick(&[0, dx, -dx, 2 * dx, 7, -13, 1, 1000]);
            points.push((x, (last + dy).clamp(-32768, 32767)));
        }
        points.retain(|p| p.0 <= 32767);
        let count = points.len();
        let text: Vec<String> = points.iter().map(|(x, y)| format!("{x} {y}")).collect();
        format!("PIECEWISE_LINEAR {a} {b} {count} {}", text.join(" "))
    }
}
