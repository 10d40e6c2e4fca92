//! Hand-made cases, one per line, in cycles.

use emu_avr::periph::spi::{AvrSpi, SpiRegister};
use emu_avr::periph::{AvrDrive, AvrLine, AvrOutbox, AvrSignal, Device};
use emu_test_support::case_lines;

/// Format: `topic | script | events`.
///
/// In a script, `N` is the edge of what follows it:
///
/// - `c=XX`, `s=XX`, `w=XX` write SPCR, SPSR, SPDR.
/// - `k0`, `k1`, `i0`, `i1`, `o0`, `o1`, `n0`, `n1` are levels of SCK, MISO, MOSI and SS; SS is high
///   initially. `out` makes SS an output.
/// - `/bits:N` are levels of MISO of N cycles each.
/// - `^bits:N` are bits of a master in mode 0: SCK low for N cycles and high for N, MOSI changing as SCK
///   falls, which it does once more at the end.
/// - `status` reads SPSR, `read` reads SPDR; `?` shows SPCR and SPSR; `q` shows the requested interrupt;
///   `take` enters it.
/// - `sleep`, `wake`, `reset`; `!k` hides later events of SCK.
///
/// Events are `K`, `I`, `O`, `N` for the lines with `0`, `1`, `Z` (made an input) or `-` (left to the port),
/// and the results of the queries.
const CASES: &str = "
# 19.3, 19.4, table 19-5: eight bits as master, from the write to the last edge of SCK
mode 0, clk/2: done 16 cycles after the write | 0 c=50 s=01 2 w=A5 17 ? 18 ? | 0 K0, 0 IZ, 0 O0, 2 O1, 3 K1, 4 K0, 4 O0, 5 K1, 6 K0, 6 O1, 7 K1, 8 K0, 8 O0, 9 K1, 10 K0, 11 K1, 12 K0, 12 O1, 13 K1, 14 K0, 14 O0, 15 K1, 16 K0, 16 O1, 17 K1, 17 c=50 s=01, 18 K0, 18 O0, 18 c=50 s=81
clk/4 | 0 c=50 w=FF 31 ? 32 ? | 0 K0, 0 IZ, 0 O0, 0 O1, 2 K1, 4 K0, 6 K1, 8 K0, 10 K1, 12 K0, 14 K1, 16 K0, 18 K1, 20 K0, 22 K1, 24 K0, 26 K1, 28 K0, 30 K1, 31 c=50 s=00, 32 K0, 32 O0, 32 c=50 s=80
clk/16 | 0 c=51 w=00 17 | 0 K0, 0 IZ, 0 O0, 8 K1, 16 K0
clk/64 | 0 c=52 w=00 65 | 0 K0, 0 IZ, 0 O0, 32 K1, 64 K0
clk/128 | 0 c=53 w=00 129 | 0 K0, 0 IZ, 0 O0, 64 K1, 128 K0
clk/8, then clk/32, then the doubled clk/64, each from the next half on | 0 c=51 s=01 w=00 9 c=52 13 c=53 61 | 0 K0, 0 IZ, 0 O0, 4 K1, 8 K0, 12 K1, 28 K0, 60 K1
mode 1: data change with the first edge, and stay | 0 c=54 s=01 w=01 17 ? | 0 K0, 0 IZ, 0 O0, 1 K1, 2 K0, 3 K1, 4 K0, 5 K1, 6 K0, 7 K1, 8 K0, 9 K1, 10 K0, 11 K1, 12 K0, 13 K1, 14 K0, 15 K1, 15 O1, 16 K0, 17 c=54 s=81
mode 2 | 0 c=58 w=80 5 | 0 K1, 0 IZ, 0 O0, 0 O1, 2 K0, 4 K1, 4 O0
mode 3 | 0 c=5C w=80 7 | 0 K1, 0 IZ, 0 O0, 2 K0, 2 O1, 4 K1, 6 K0, 6 O0
DORD: the lowest bit first | 0 c=70 w=01 5 | 0 K0, 0 IZ, 0 O0, 0 O1, 2 K1, 4 K0, 4 O0
a byte comes in with the one that goes out | 0 !k c=50 w=00 /10100101:4 ? read | 0 IZ, 0 O0, 32 O1, 32 c=50 s=80, 32 read A5
.. lowest bit first, in mode 3 | 0 !k c=7C w=00 2 /10100001:4 34 ? read | 0 IZ, 0 O0, 34 c=7C s=80, 34 read 85
SPDR shows the last byte while the next comes | 0 !k c=50 w=00 /10100101:4 i0 33 w=00 40 read 65 read | 0 IZ, 0 O0, 32 O1, 33 O0, 40 read A5, 65 read 00

# 19.5.2: flags
SPIF: SPSR is read, then SPDR | 0 !k c=50 s=01 w=00 20 read ? status ? read ? | 0 IZ, 0 O0, 20 read 00, 20 c=50 s=81, 20 status 81, 20 c=50 s=81, 20 read 00, 20 c=50 s=01
.. or SPDR is written | 0 !k c=50 s=01 w=00 20 status w=00 ? 36 ? | 0 IZ, 0 O0, 20 status 81, 20 c=50 s=01, 36 c=50 s=81
.. or the interrupt is entered | 0 !k c=D0 s=01 w=00 15 q 16 q take ? q | 0 IZ, 0 O0, 15 q 0, 16 q 1, 16 c=D0 s=01, 16 q 0
SPSR read too early clears nothing | 0 !k c=50 s=01 w=00 10 status 20 read ? | 0 IZ, 0 O0, 10 status 01, 20 read 00, 20 c=50 s=81
WCOL up to the edge that ends the byte | 0 !k c=50 s=01 w=FF 10 w=00 ? 16 w=00 ? status 17 w=00 ? 40 ? | 0 IZ, 0 O0, 0 O1, 10 c=50 s=41, 16 O0, 16 c=50 s=C1, 16 status C1, 17 c=50 s=01, 40 c=50 s=81
flags are not written | 0 s=FF ? | 0 c=00 s=01
SPE cleared ends the byte | 0 !k c=50 s=01 w=FF 5 c=10 ? 40 ? c=50 80 ? | 0 IZ, 0 O0, 0 O1, 5 I-, 5 O-, 5 c=10 s=01, 40 c=10 s=01, 40 IZ, 40 O1, 80 c=50 s=01
a write while SPE is 0 starts nothing | 0 !k c=10 w=80 5 c=50 100 ? | 5 IZ, 5 O1, 100 c=50 s=00

# 19.3.2: SS of a master
an input that goes low: no master any more | 0 !k c=D0 10 n0 ? 11 ? q | 0 IZ, 0 O0, 10 c=D0 s=00, 11 I0, 11 NZ, 11 OZ, 11 c=C0 s=80, 11 q 1
low for no whole cycle | 0 !k c=D0 10 n0 n1 20 ? | 0 IZ, 0 O0, 20 c=D0 s=00
low already | 0 n0 !k c=50 ? 1 ? | 0 IZ, 0 O0, 0 c=50 s=00, 1 I0, 1 NZ, 1 OZ, 1 c=40 s=80
an output does not matter | 0 out !k c=50 10 n0 20 ? | 0 IZ, 0 O0, 20 c=50 s=00
.. until it is none | 0 out !k c=50 w=00 10 n0 20 in 21 ? 90 ? | 0 IZ, 0 O0, 21 I0, 21 NZ, 21 OZ, 21 c=40 s=80, 90 c=40 s=80

# 19.3.1: slave; two cycles behind SCK, but for its output
mode 0 | 0 !k c=40 w=A5 10 n0 12 ^11000011:4 77 ? 78 ? read | 0 IZ, 0 OZ, 0 NZ, 10 I1, 20 I0, 28 I1, 36 I0, 52 I1, 60 I0, 68 I1, 77 c=40 s=00, 78 c=40 s=80, 78 read C3
without a new byte what came in goes out again | 0 !k c=40 w=00 10 n0 12 ^11000011:4 80 ^00000000:4 150 read | 0 IZ, 0 OZ, 0 NZ, 10 I0, 76 I1, 96 I0, 128 I1, 144 I0, 150 read 00
SS high: what has come in is dropped at once | 0 !k c=40 w=FF 10 n0 12 ^1111:4 n1 50 n0 52 ^11000011:4 120 ? read | 0 IZ, 0 OZ, 0 NZ, 10 I1, 44 IZ, 50 I1, 120 c=40 s=80, 120 read C3
WCOL from the first edge on | 0 !k c=40 10 n0 12 ^1:4 22 w=00 ? | 0 IZ, 0 OZ, 0 NZ, 10 I0, 22 c=40 s=40
not selected | 0 !k c=40 12 ^11000011:4 100 ? | 0 IZ, 0 OZ, 0 NZ, 100 c=40 s=00
MOSI counts as it is in the cycle in which SCK rises | 0 !k c=40 10 n0 12 ^0000000:4 o1 72 k1 73 o0 80 k0 90 read | 0 IZ, 0 OZ, 0 NZ, 10 I0, 90 read 01

# 10, table 14-3
stopped in sleep | 0 !k c=50 w=00 10 sleep 110 wake 131 ? 132 ? | 0 IZ, 0 O0, 131 c=50 s=00, 132 c=50 s=80
reset | 0 !k c=FF s=01 w=12 5 reset ? 300 ? | 0 IZ, 0 O0, 5 I-, 5 O-, 5 c=00 s=00, 300 c=00 s=00
";

struct TestBench {
    port: AvrSpi,
    t: u64,
    quiet: bool,
    out: AvrOutbox,
    said: Vec<(u64, String)>,
}

impl TestBench {
    fn say(&mut self, what: String) {
        self.drain();
        self.said.push((self.t, what));
    }

    fn drain(&mut self) {
        for signal in self.out.drain(..) {
            let AvrSignal::Drive { t, line, drive } = signal else { panic!("{signal:?}") };
            let name = match line {
                AvrLine::Sck if self.quiet => continue,
                AvrLine::Sck => 'K',
                AvrLine::Miso => 'I',
                AvrLine::Mosi => 'O',
                _ => 'N',
            };
            let level = match drive {
                AvrDrive::Port => '-',
                AvrDrive::Input => 'Z',
                AvrDrive::Output(high) | AvrDrive::Value(high) => char::from(b'0' + u8::from(high)),
            };
            self.said.push((t, format!("{name}{level}")));
        }
    }

    fn to(&mut self, t: u64) {
        assert!(t >= self.t, "{t} is past");
        self.t = t;
        self.port.run_due(t, &mut self.out);
    }

    fn line(&mut self, line: AvrLine, high: bool) {
        self.port.on_line_changed(line, high, self.t, &mut self.out);
    }

    fn word(&mut self, word: &str) {
        let t = self.t;
        if let Ok(t) = word.parse() {
            self.to(t);
        } else if let Some((name, value)) = word.split_once('=') {
            let reg = match name {
                "c" => SpiRegister::SPCR,
                "s" => SpiRegister::SPSR,
                "w" => SpiRegister::SPDR,
                _ => panic!("{word}"),
            };
            self.port.write(reg, u8::from_str_radix(value, 16).expect(word), 0xFF, t, &mut self.out);
        } else if let Some((bits, time)) = word.split_once(':') {
            let time: u64 = time.parse().expect(word);
            for bit in bits[1..].chars() {
                if word.starts_with('^') {
                    self.line(AvrLine::Sck, false);
                    self.line(AvrLine::Mosi, bit == '1');
                    self.to(self.t + time);
                    self.line(AvrLine::Sck, true);
                } else {
                    self.line(AvrLine::Miso, bit == '1');
                }
                self.to(self.t + time);
            }
            if word.starts_with('^') {
                self.line(AvrLine::Sck, false);
            }
        } else {
            match word {
                "k0" | "k1" => self.line(AvrLine::Sck, word == "k1"),
                "i0" | "i1" => self.line(AvrLine::Miso, word == "i1"),
                "o0" | "o1" => self.line(AvrLine::Mosi, word == "o1"),
                "n0" | "n1" => self.line(AvrLine::Ss, word == "n1"),
                "out" | "in" => self.port.on_direction_changed(AvrLine::Ss, word == "out", t, &mut self.out),
                "!k" => self.quiet = true,
                "reset" => self.port.reset(false, t, &mut self.out),
                "sleep" => self.port.stop_clock(t, &mut self.out),
                "wake" => self.port.restart_clock(t, &mut self.out),
                "take" => self.port.on_interrupt_taken(0, t, &mut self.out),
                "read" | "status" => {
                    let reg = if word == "read" { SpiRegister::SPDR } else { SpiRegister::SPSR };
                    let value = self.port.read(reg, t, &mut self.out);
                    self.say(format!("{word} {value:02X}"));
                }
                "?" => {
                    let (c, s) = (self.port.peek(SpiRegister::SPCR, t), self.port.peek(SpiRegister::SPSR, t));
                    self.say(format!("c={c:02X} s={s:02X}"));
                }
                "q" => self.say(format!("q {}", self.port.interrupt_requests())),
                _ => panic!("{word}"),
            }
        }
        self.drain();
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
        let mut bench = TestBench { port: AvrSpi::new(), t: 0, quiet: false, out: Vec::new(), said: Vec::new() };
        bench.word("n1");
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
