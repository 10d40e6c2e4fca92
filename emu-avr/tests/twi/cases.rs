//! Hand-made cases, one per line, in cycles.

use emu_avr::periph::twi::{AvrTwi, TwiRegister};
use emu_avr::periph::{AvrDrive, AvrLine, AvrOutbox, AvrSignal, Device};
use emu_test_support::case_lines;

/// Format: `topic | script | events`.
///
/// In a script, `N` is the edge of what follows it:
///
/// - `b=XX`, `s=XX`, `a=XX`, `d=XX`, `c=XX`, `m=XX` write TWBR, TWSR, TWAR, TWDR, TWCR, TWAMR.
/// - `k0`, `k1`, `d0`, `d1`: another device pulls SCL or SDA low, or releases it. Both lines are high
///   initially.
/// - `^bits:N` are bits of another master: SCL low for N cycles and high for N, SDA changing as SCL falls.
/// - `?` shows TWCR and TWSR, `data` TWDR, `q` the requested interrupt.
/// - `sleep`, `wake`, `reset`; `!k` hides later events of SCL.
///
/// Events are `K` and `D` for the lines with `0` (pulled low), `1` (released) or `-` (left to the port), and
/// the results of the queries. With TWBR = 0 half a period is 8 cycles (22.5.2); a change of a line is
/// detected two cycles later.
const CASES: &str = "
# 22.7.1: master
START, when the bus has been free for half a period | 10 c=A4 27 ? 28 ? | 10 K1, 10 D1, 18 D0, 26 K0, 27 c=24 s=F8, 28 c=A4 s=08
TWBR = 12, TWPS = 1: halves of 56 | 10 b=0C s=01 c=A4 123 ? 124 ? | 10 K1, 10 D1, 66 D0, 122 K0, 123 c=24 s=F9, 124 c=A4 s=09
TWSTA taken back in time | 10 c=A4 15 c=04 100 ? | 10 K1, 10 D1, 100 c=04 s=F8
SLA+W, nobody there | 10 c=A4 30 d=40 c=84 175 ? 176 ? | 10 K1, 10 D1, 18 D0, 26 K0, 38 K1, 46 K0, 48 D1, 54 K1, 62 K0, 64 D0, 70 K1, 78 K0, 86 K1, 94 K0, 102 K1, 110 K0, 118 K1, 126 K0, 134 K1, 142 K0, 150 K1, 158 K0, 160 D1, 166 K1, 174 K0, 175 c=04 s=F8, 176 c=84 s=20
SLA+W, acknowledged; a data byte, not | !k 10 c=A4 30 d=40 c=84 160 d0 177 ? d1 180 d=00 c=84 325 ? 326 ? | 10 D1, 18 D0, 48 D1, 64 D0, 160 D1, 177 c=84 s=18, 180 D0, 310 D1, 325 c=04 s=F8, 326 c=84 s=30
.. and one that is | !k 10 c=A4 30 d=40 c=84 160 d0 177 180 d=00 c=84 326 ? | 10 D1, 18 D0, 48 D1, 64 D0, 160 D1, 180 D0, 310 D1, 326 c=84 s=28
SLA+R, not acknowledged | !k 10 c=A4 30 d=41 c=84 176 ? | 10 D1, 18 D0, 48 D1, 64 D0, 144 D1, 176 c=84 s=48
SLA+R and a byte that is acknowledged | !k 10 c=A4 30 d=41 c=84 160 d0 177 ? d1 180 c=C4 310 326 ? data | 10 D1, 18 D0, 48 D1, 64 D0, 144 D1, 177 c=84 s=40, 310 D0, 326 D1, 326 c=C4 s=50, 326 data FF
.. and one that is not | !k 10 c=A4 30 d=41 c=84 160 d0 177 180 c=84 310 d1 326 ? data | 10 D1, 18 D0, 48 D1, 64 D0, 144 D1, 326 c=84 s=58, 326 data 00
STOP after START | 10 c=A4 30 c=94 47 ? 48 ? | 10 K1, 10 D1, 18 D0, 26 K0, 38 K1, 46 D1, 47 c=14 s=F8, 48 c=04 s=F8
STOP and START | 10 c=A4 30 c=B4 65 ? 66 ? | 10 K1, 10 D1, 18 D0, 26 K0, 38 K1, 46 D1, 56 D0, 64 K0, 65 c=24 s=F8, 66 c=A4 s=08
repeated START | 10 c=A4 30 c=A4 55 ? 56 ? | 10 K1, 10 D1, 18 D0, 26 K0, 30 D1, 38 K1, 46 D0, 54 K0, 55 c=24 s=F8, 56 c=A4 s=10
a slave that stretches the clock | 10 c=A4 30 d=00 c=84 34 k0 60 k1 83 | 10 K1, 10 D1, 18 D0, 26 K0, 38 K1, 68 K0, 76 K1
another master that ends the high time | 10 c=A4 30 d=00 c=84 42 k0 50 k1 64 | 10 K1, 10 D1, 18 D0, 26 K0, 38 K1, 44 K0, 50 K1, 58 K0
a bus that is in use: START after its STOP | !k 5 c=04 10 d0 15 k0 20 c=A4 100 ? 110 k1 120 d1 139 ? 140 ? | 5 D1, 100 c=24 s=F8, 130 D0, 139 c=24 s=F8, 140 c=A4 s=08
arbitration lost in data | !k 10 c=A4 30 d=40 c=84 160 d0 177 d1 180 d=FF c=84 186 d0 200 ^00000001:8 k0 329 ? 330 ? | 10 D1, 18 D0, 48 D1, 64 D0, 160 D1, 329 c=04 s=F8, 330 c=84 s=38

# 22.7.3, 22.7.4: slave
SLA+W | 10 a=40 c=44 20 d0 30 k0 ^010000001:8 k0 175 ? 176 ? 180 c=C4 190 ? | 10 K1, 10 D1, 160 D0, 175 c=44 s=F8, 176 K0, 176 D1, 176 c=C4 s=60, 182 K1, 190 c=44 s=F8
another address | 10 a=42 c=44 20 d0 30 k0 ^010000001:8 k0 190 ? | 10 K1, 10 D1, 190 c=44 s=F8
.. which TWAMR lets pass | 10 a=42 m=03 c=44 20 d0 30 k0 ^010000001:8 k0 176 ? | 10 K1, 10 D1, 160 D0, 176 K0, 176 D1, 176 c=C4 s=60
not without TWEA | 10 a=40 c=04 20 d0 30 k0 ^010000001:8 k0 190 ? | 10 K1, 10 D1, 190 c=04 s=F8
general call | 10 a=41 c=44 20 d0 30 k0 ^000000001:8 k0 176 ? | 10 K1, 10 D1, 160 D0, 176 K0, 176 D1, 176 c=C4 s=70
.. not without TWGCE | 10 a=40 c=44 20 d0 30 k0 ^000000001:8 k0 190 ? | 10 K1, 10 D1, 190 c=44 s=F8
a byte, and STOP | !k 10 a=40 c=44 20 d0 30 k0 ^010000001:8 k0 180 c=C4 190 ^101001011:8 k0 335 ? 336 ? data 340 c=C4 350 d0 360 k1 370 d1 371 ? 372 ? | 10 D1, 160 D0, 176 D1, 320 D0, 335 c=44 s=F8, 336 D1, 336 c=C4 s=80, 336 data A5, 371 c=44 s=F8, 372 c=C4 s=A0
a byte that is not acknowledged | !k 10 a=40 c=44 20 d0 30 k0 ^010000001:8 k0 180 c=84 190 ^101001011:8 k0 336 ? | 10 D1, 160 D0, 176 D1, 336 c=84 s=88
slave transmitter, acknowledged | !k 10 a=40 c=44 20 d0 30 k0 ^010000011:8 k0 176 ? 180 d=A5 c=C4 190 ^111111110:8 k0 336 ? | 10 D1, 160 D0, 176 D1, 176 c=C4 s=A8, 208 D0, 224 D1, 240 D0, 272 D1, 288 D0, 304 D1, 336 c=C4 s=B8
.. not acknowledged | !k 10 a=40 c=44 20 d0 30 k0 ^010000011:8 k0 180 d=FF c=C4 190 ^111111111:8 k0 336 ? | 10 D1, 160 D0, 176 D1, 336 c=C4 s=C0
.. acknowledged though it was the last one | !k 10 a=40 c=44 20 d0 30 k0 ^010000011:8 k0 180 d=FF c=84 190 ^111111110:8 k0 336 ? | 10 D1, 160 D0, 176 D1, 336 c=84 s=C8
TWSTO throws a slave out | !k 10 a=40 c=44 20 d0 30 k0 ^010000001:8 k0 180 c=D4 ? 190 ^101001011:8 k0 340 ? | 10 D1, 160 D0, 176 D1, 180 c=44 s=F8, 340 c=44 s=F8

# 22.7.5, 22.9
START within a byte: bus error; TWSTO leaves it | !k 10 a=40 c=44 20 d0 30 k0 ^010000001:8 k0 180 c=C4 190 ^11:8 d0 223 ? 224 ? 230 c=D4 ? | 10 D1, 160 D0, 176 D1, 223 c=44 s=F8, 224 c=C4 s=00, 230 c=44 s=F8
TWDR is written while TWINT is 0 | 10 d=12 ? data | 10 c=08 s=F8, 10 data FF
TWEN cleared | 10 c=A4 20 c=00 100 ? | 10 K1, 10 D1, 18 D0, 20 K-, 20 D-, 100 c=00 s=F8
the interrupt | !k 10 c=A5 27 q 28 q 30 c=85 q | 10 D1, 18 D0, 27 q 0, 28 q 1, 30 D1, 30 q 0
an address is found in sleep, and SCL held | 10 a=40 c=45 15 sleep 20 d0 30 k0 ^010000001:8 k0 q ? 200 wake c=C5 210 | 10 K1, 10 D1, 158 D0, 174 K0, 174 D1, 174 q 1, 174 c=C5 s=60, 202 K1
reset | 10 a=41 b=12 s=03 m=FF c=A5 20 reset ? data | 10 K1, 10 D1, 20 K-, 20 D-, 20 c=00 s=F8, 20 data FF
";

struct TestBench {
    part: AvrTwi,
    t: u64,
    quiet: bool,
    out: AvrOutbox,
    /// Whether another device pulls SCL and SDA low, then whether the interface does; then the levels of the
    /// lines as passed to the interface.
    others: [bool; 2],
    own: [bool; 2],
    wires: [bool; 2],
    said: Vec<(u64, String)>,
}

impl TestBench {
    fn say(&mut self, what: String) {
        self.said.push((self.t, what));
    }

    /// Updates the lines after a change of who pulls them.
    fn settle(&mut self) {
        for signal in std::mem::take(&mut self.out) {
            let AvrSignal::Drive { t, line, drive } = signal else { panic!("{signal:?}") };
            let (n, name) = if line == AvrLine::Scl { (0, 'K') } else { (1, 'D') };
            self.own[n] = drive == AvrDrive::Output(false);
            let level = match drive {
                AvrDrive::Port => '-',
                AvrDrive::Output(false) => '0',
                _ => '1',
            };
            if n == 1 || !self.quiet {
                self.said.push((t, format!("{name}{level}")));
            }
        }
        for (n, line) in [AvrLine::Scl, AvrLine::Sda].into_iter().enumerate() {
            let high = !self.others[n] && !self.own[n];
            if std::mem::replace(&mut self.wires[n], high) != high {
                self.part.on_line_changed(line, high, self.t, &mut self.out);
            }
        }
        if !self.out.is_empty() {
            self.settle();
        }
    }

    fn to(&mut self, t: u64) {
        assert!(t >= self.t, "{t} is past");
        while self.part.next_deadline() <= t {
            self.t = self.part.next_deadline();
            self.part.run_due(self.t, &mut self.out);
            self.settle();
        }
        self.t = t;
        self.part.run_due(t, &mut self.out);
        self.settle();
    }

    fn pull(&mut self, n: usize, low: bool) {
        self.others[n] = low;
        self.settle();
    }

    fn word(&mut self, word: &str) {
        let t = self.t;
        if let Ok(t) = word.parse() {
            self.to(t);
        } else if let Some((name, value)) = word.split_once('=') {
            let reg = match name {
                "b" => TwiRegister::TWBR,
                "s" => TwiRegister::TWSR,
                "a" => TwiRegister::TWAR,
                "d" => TwiRegister::TWDR,
                "c" => TwiRegister::TWCR,
                "m" => TwiRegister::TWAMR,
                _ => panic!("{word}"),
            };
            self.part.write(reg, u8::from_str_radix(value, 16).expect(word), 0xFF, t, &mut self.out);
        } else if let Some((bits, time)) = word.split_once(':') {
            let time: u64 = time.parse().expect(word);
            for bit in bits[1..].chars() {
                self.pull(0, true);
                self.pull(1, bit == '0');
                self.to(self.t + time);
                self.pull(0, false);
                self.to(self.t + time);
            }
        } else {
            match word {
                "k0" | "k1" => self.pull(0, word == "k0"),
                "d0" | "d1" => self.pull(1, word == "d0"),
                "!k" => self.quiet = true,
                "reset" => self.part.reset(false, t, &mut self.out),
                "sleep" => self.part.stop_clock(t, &mut self.out),
                "wake" => self.part.restart_clock(t, &mut self.out),
                "?" => {
                    let (c, s) = (self.part.peek(TwiRegister::TWCR, t), self.part.peek(TwiRegister::TWSR, t));
                    self.say(format!("c={c:02X} s={s:02X}"));
                }
                "data" => self.say(format!("data {:02X}", self.part.peek(TwiRegister::TWDR, t))),
                "q" => self.say(format!("q {}", self.part.interrupt_requests())),
                _ => panic!("{word}"),
            }
        }
        self.settle();
    }
}

/// Sorts events by time; in one cycle, query results come after line events, in their original order.
fn normal(mut said: Vec<(u64, String)>) -> Vec<(u64, String)> {
    said.sort_by_key(|(t, what)| (*t, if what.len() == 2 { what.clone() } else { "Z".to_owned() }));
    said
}

#[test]
fn cases_worked_by_hand() {
    let mut failed = Vec::new();
    for line in case_lines(CASES) {
        let [name, script, ought] = *line.split('|').map(str::trim).collect::<Vec<_>>() else { panic!("{line}") };
        let mut bench = TestBench {
            part: AvrTwi::new(),
            t: 0,
            quiet: false,
            out: Vec::new(),
            others: [false; 2],
            own: [false; 2],
            wires: [false; 2],
            said: Vec::new(),
        };
        bench.settle();
        script.split_whitespace().for_each(|word| bench.word(word));
        let ought = ought.split(',').map(str::trim).filter(|item| !item.is_empty()).map(|item| {
            let (t, what) = item.split_once(' ').expect(item);
            (t.parse().expect(item), what.to_owned())
        });
        let (is, ought) = (normal(bench.said), normal(ought.collect()));
        if is != ought {
            let text = |said: &[(u64, String)]| {
                said.iter().map(|(t, what)| format!("{t} {what}")).collect::<Vec<_>>().join(", ")
            };
            failed.push(format!("{name}\n  is    {}\n  ought {}", text(&is), text(&ought)));
        }
    }
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}
