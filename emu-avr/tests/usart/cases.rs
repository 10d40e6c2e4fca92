//! Hand-made cases, one per line, in cycles.

use emu_avr::periph::usart::{AvrUsart, UsartRegister};
use emu_avr::periph::{AvrDrive, AvrLine, AvrOutbox, AvrSignal, Device};
use emu_test_support::case_lines;

/// Format: `topic | script | events`.
///
/// In a script, `N` is the edge of what follows it:
///
/// - `a=XX`, `b=XX`, `c=XX`, `l=XX`, `h=XX`, `w=XX` write UCSRA, UCSRB, UCSRC, UBRRL, UBRRH, UDR.
/// - `r0`, `r1`, `x0`, `x1` are levels of RXD and XCK; RXD is high initially. `out` makes XCK an output.
/// - `/bits:N` are levels of RXD of N cycles each.
/// - `^bits:N` is a rise and a fall of XCK for each bit, N cycles each, RXD changing at the rise.
/// - `read` reads UDR; `?` shows UCSRA, and a 9 if RXB8 is set; `i` shows the requested interrupts; `take`
///   enters TX.
/// - `sleep`, `wake`, `reset`.
///
/// Events are `N T0`, `N T1`, `N T-` for TXD driven or left to the port, `R` and `X` likewise for RXD and XCK
/// (`Z`: made an input), `sent`, and the results of the queries.
const CASES: &str = "
# 20.6: a first bit begins with the next edge of the bit clock
U2X, UBRR = 0: 8 cycles a bit | 0 a=02 b=08 w=A5 100 ? | 0 T1, 8 T0, 16 T1, 24 T0, 32 T1, 40 T0, 56 T1, 64 T0, 72 T1, 88 sent A5, 100 a=62
normal speed: 16 cycles a bit | 0 b=08 5 w=FF 200 | 0 T1, 16 T0, 32 T1, 176 sent FF
UBRR = 2: a bit of 24 | 4 a=02 l=02 b=08 w=FF 300 | 4 T1, 28 T0, 52 T1, 268 sent FF
UBRRL restarts generator and divider | 0 a=02 b=08 w=FF 5 l=00 100 | 0 T1, 13 T0, 21 T1, 93 sent FF
UBRRH acts when the counter is loaded | 0 a=02 l=03 b=08 1 w=FF 6 h=01 2400 | 0 T1, 1568 T0
UBRR in the middle of a frame | 0 a=02 b=08 w=FF 20 l=01 200 | 0 T1, 8 T0, 16 T1, 164 sent FF
U2X in the middle of a frame | 0 a=02 b=08 w=FF 20 a=00 200 | 0 T1, 8 T0, 16 T1, 160 sent FF
five bits, even parity, two stops | 0 a=02 c=28 b=08 w=FF 100 | 0 T1, 8 T0, 16 T1, 80 sent 1F
five bits, odd parity, two stops | 0 a=02 c=38 b=08 w=03 100 | 0 T1, 8 T0, 16 T1, 32 T0, 56 T1, 80 sent 03
the reserved parity is none | 0 a=02 c=10 b=08 w=00 100 | 0 T1, 8 T0, 56 T1, 64 sent 00
six, seven bits | 0 a=02 c=02 b=08 w=FF 1 w=FF 72 c=04 200 | 0 T1, 8 T0, 16 T1, 72 sent 3F, 72 T0, 80 T1, 136 sent 3F
nine bits | 0 a=02 b=0D w=00 100 | 0 T1, 8 T0, 80 T1, 96 sent 00
TXB8 belongs to the byte written after it | 0 a=02 b=0D w=00 b=0C 100 w=FF 200 | 0 T1, 8 T0, 80 T1, 96 sent 00, 104 T0, 112 T1, 176 T0, 184 T1, 192 sent FF
reserved sizes are those without UCSZ2 | 0 a=02 b=0D c=04 w=00 100 | 0 T1, 8 T0, 72 T1, 80 sent 00
buffer and shift register; a third byte is ignored | 0 a=02 b=08 w=FF ? 1 w=00 ? 2 w=FF 87 ? 88 ? 200 ? | 0 T1, 0 a=22, 1 a=02, 8 T0, 16 T1, 87 a=02, 88 sent FF, 88 T0, 88 a=22, 160 T1, 168 sent 00, 200 a=62
TXC only when both are empty, cleared by 1 | 0 a=02 b=08 w=FF 87 ? 88 ? 90 a=02 ? 91 a=42 ? | 0 T1, 8 T0, 16 T1, 87 a=22, 88 sent FF, 88 a=62, 90 a=62, 91 a=22
TXC cleared as it is set: it stays | 0 a=02 b=08 w=FF 88 a=42 ? 89 a=42 ? | 0 T1, 8 T0, 16 T1, 88 sent FF, 88 a=62, 89 a=22
TXC cleared by its interrupt, UDRE not | 0 a=02 b=68 w=FF i 88 i take i ? | 0 T1, 0 i 2, 8 T0, 16 T1, 88 sent FF, 88 i 6, 88 i 2, 88 a=22
TXEN cleared: what is pending goes out | 0 a=02 b=08 w=FF 1 w=00 20 b=00 300 | 0 T1, 8 T0, 16 T1, 88 sent FF, 88 T0, 160 T1, 168 sent 00, 168 T-
TXEN cleared while idle | 0 b=08 7 b=00 100 | 0 T1, 7 T-
a byte that waits for TXEN | 0 a=02 w=FF ? 50 b=08 200 | 0 a=02, 50 T1, 56 T0, 64 T1, 136 sent FF
stopped in sleep | 0 a=02 b=08 w=FF 10 sleep 110 wake 300 | 0 T1, 8 T0, 116 T1, 188 sent FF
reset | 0 a=03 b=BD c=FF l=12 h=FF w=00 w=11 9 ? reset ? 100 b=08 w=FF 300 | 0 T1, 0 RZ, 9 a=03, 9 T-, 9 R-, 9 a=20, 100 T1, 105 T0, 121 T1, 265 sent FF

# 20.7, 20.8: samples 4, 5, 6 vote, or 8, 9, 10; the first low one, a cycle after the edge, is number 1
U2X: complete with the last vote on the stop bit | 0 a=02 b=10 10 /010101100:8 82 r1 87 ? 88 ? read ? | 0 RZ, 87 a=22, 88 a=A2, 88 read 35, 88 a=22
normal speed | 0 b=10 10 /010101100:16 154 r1 163 ? 164 ? read | 0 RZ, 163 a=20, 164 a=A0, 164 read 35
UBRR = 3 | 0 a=02 l=03 b=10 10 /010101100:32 298 r1 319 ? 320 ? read | 0 RZ, 319 a=22, 320 a=A2, 320 read 35
two of three are high: no start bit | 0 a=02 b=10 10 r0 14 r1 300 ? | 0 RZ, 300 a=22
two of three are low: one | 0 a=02 b=10 10 r0 15 r1 87 ? 88 ? read | 0 RZ, 87 a=22, 88 a=A2, 88 read FF
a glitch is voted down | 0 a=02 b=10 10 /01:8 29 r0 30 r1 90 read | 0 RZ, 90 read FF
a glitch of two samples is not | 0 a=02 b=10 10 /01:8 29 r0 31 r1 90 read | 0 RZ, 90 read FD
a low line is no start | r0 0 a=02 b=10 300 ? | 0 RZ, 300 a=22
a break is one frame | 0 a=02 b=10 10 r0 900 ? read ? | 0 RZ, 900 a=B2, 900 read 00, 900 a=22
a stop bit cut short by the next start bit | 0 a=02 b=10 10 /010000000:8 82 r1 87 r0 95 r1 200 read read | 0 RZ, 200 read 01, 200 read FF
frame error, of its own byte alone | 0 a=02 b=10 10 /01111111101:8 98 /0100000001:8 200 ? read ? read ? | 0 RZ, 200 a=B2, 200 read FF, 200 a=A2, 200 read 01, 200 a=22
even parity | 0 a=02 b=10 c=26 10 /01111111101:8 /01111111111:8 300 ? read ? read ? | 0 RZ, 300 a=A2, 300 read FF, 300 a=A6, 300 read FF, 300 a=22
odd parity | 0 a=02 b=10 c=36 10 /01111111101:8 /01111111111:8 300 ? read ? read ? | 0 RZ, 300 a=A6, 300 read FF, 300 a=A2, 300 read FF, 300 a=22
the second stop bit is not looked at | 0 a=02 b=10 c=0E 10 /0100000001:8 /0010000001:8 200 read read | 0 RZ, 200 read 01, 200 read 02
five bits | 0 a=02 b=10 c=00 10 /0101011:8 100 read | 0 RZ, 100 read 15
nine bits | 0 a=02 b=14 10 /01010101001:8 /01010101011:8 300 ? read ? read | 0 RZ, 300 a=A2, 300 read 55, 300 a=A2 9, 300 read 55
two bytes and a third wait, a fourth start bit loses the third | 0 a=02 b=10 10 /0100000001:8 /0010000001:8 /0110000001:8 /0001000001:8 400 ? read ? read ? read ? | 0 RZ, 400 a=A2, 400 read 01, 400 a=A2, 400 read 02, 400 a=AA, 400 read 04, 400 a=22
three wait without a loss | 0 a=02 b=10 10 /0100000001:8 /0010000001:8 /0110000001:8 400 read read ? read ? | 0 RZ, 400 read 01, 400 read 02, 400 a=A2, 400 read 03, 400 a=22
RXC is asked for until it is read | 0 a=02 b=90 10 /0100000001:8 i take i read i | 0 RZ, 90 i 1, 90 i 1, 90 read 01, 90 i 0
RXEN cleared: all is lost | 0 a=02 b=10 10 /0100000000:8 90 r1 100 b=00 ? b=10 ? 300 ? | 0 RZ, 100 R-, 100 a=22, 100 RZ, 100 a=22, 300 a=22
MPCM, nine bits: the ninth says address | 0 a=03 b=14 10 /01000000001:8 /01000000011:8 300 ? read ? | 0 RZ, 300 a=A3 9, 300 read 01, 300 a=23 9
MPCM, eight bits: the stop bit says address | 0 a=03 b=10 10 /0100000000:8 r1 100 /0010000001:8 300 ? read ? | 0 RZ, 300 a=A3, 300 read 02, 300 a=23
stopped in sleep | 0 a=02 b=10 10 /01:8 30 sleep 130 wake 187 ? 188 ? read | 0 RZ, 187 a=22, 188 a=A2, 188 read FF

# 20.3.3: XCK gives two edges a bit; data change with the rising one, or with the falling one if UCPOL is set
synchronous master | 0 out l=01 c=46 b=08 w=FF 13 | 0 X1, 0 T1, 2 X0, 4 X1, 4 T0, 6 X0, 8 X1, 8 T1, 10 X0, 12 X1
UCPOL | 0 out l=01 c=47 b=08 w=FF 13 | 0 X0, 0 T1, 2 X1, 4 X0, 4 T0, 6 X1, 8 X0, 8 T1, 10 X1, 12 X0
a master samples with the other edge | 0 out c=46 b=10 4 /001000000:2 r1 22 ? 23 ? 24 read | 0 X1, 0 RZ, 1 X0, 2 X1, 3 X0, 4 X1, 5 X0, 6 X1, 7 X0, 8 X1, 9 X0, 10 X1, 11 X0, 12 X1, 13 X0, 14 X1, 15 X0, 16 X1, 17 X0, 18 X1, 19 X0, 20 X1, 21 X0, 22 X1, 22 a=20, 23 X0, 23 a=A0, 24 X1, 24 read 02
a slave acts two cycles after the edge | 0 c=46 b=08 w=55 10 ^1111:4 | 0 T1, 12 T0, 20 T1, 28 T0, 36 T1
a slave receives | 0 c=46 b=10 10 ^1010101100:4 90 r1 x1 94 x0 95 ? 96 ? read | 0 RZ, 95 a=20, 96 a=A0, 96 read 35
a pulse within a cycle is not seen | 0 c=46 b=08 w=00 10 x1 x0 20 | 0 T1
no start bit without a sample that is high before | r0 0 c=46 b=10 10 ^000000000000:4 ? | 0 RZ, 106 a=20

# 21: master of SPI
mode 0, clk/2 | 0 out c=C0 b=08 w=A5 20 ? | 0 X0, 0 T1, 3 X1, 4 X0, 4 T0, 5 X1, 6 X0, 6 T1, 7 X1, 8 X0, 8 T0, 9 X1, 10 X0, 11 X1, 12 X0, 12 T1, 13 X1, 14 X0, 14 T0, 15 X1, 16 X0, 16 T1, 17 X1, 18 X0, 20 a=60
mode 1 | 0 out c=C2 b=08 w=FF 6 | 0 X0, 0 T1, 2 X1, 3 X0, 4 X1, 5 X0, 6 X1
mode 2 | 0 out c=C1 b=08 w=FF 6 | 0 X1, 0 T1, 3 X0, 4 X1, 5 X0, 6 X1
mode 3, lowest bit first | 0 out c=C7 b=08 w=01 9 | 0 X1, 0 T1, 2 X0, 3 X1, 4 X0, 4 T0, 5 X1, 6 X0, 7 X1, 8 X0, 9 X1
a byte comes in with each that goes out | 0 out c=C0 l=03 b=18 w=FF 8 /1010010:8 r1 67 ? 68 ? 73 ? read | 0 X0, 0 T1, 0 RZ, 12 X1, 16 X0, 20 X1, 24 X0, 28 X1, 32 X0, 36 X1, 40 X0, 44 X1, 48 X0, 52 X1, 56 X0, 60 X1, 64 X0, 67 a=20, 68 X1, 68 a=A0, 72 X0, 73 a=E0, 73 read A5
";

struct TestBench {
    port: AvrUsart,
    t: u64,
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
            self.said.push(match signal {
                AvrSignal::Drive { t, line, drive } => {
                    let name = match line {
                        AvrLine::Txd => 'T',
                        AvrLine::Rxd => 'R',
                        _ => 'X',
                    };
                    let level = match drive {
                        AvrDrive::Port => '-',
                        AvrDrive::Input => 'Z',
                        AvrDrive::Output(high) | AvrDrive::Value(high) => char::from(b'0' + u8::from(high)),
                    };
                    (t, format!("{name}{level}"))
                }
                AvrSignal::Sent { t, byte } => (t, format!("sent {byte:02X}")),
                other => panic!("{other:?}"),
            });
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
                "a" => UsartRegister::UCSRA,
                "b" => UsartRegister::UCSRB,
                "c" => UsartRegister::UCSRC,
                "l" => UsartRegister::UBRRL,
                "h" => UsartRegister::UBRRH,
                "w" => UsartRegister::UDR,
                _ => panic!("{word}"),
            };
            self.port.write(reg, u8::from_str_radix(value, 16).expect(word), 0xFF, t, &mut self.out);
        } else if let Some((bits, time)) = word.split_once(':') {
            let time: u64 = time.parse().expect(word);
            for bit in bits[1..].chars() {
                if word.starts_with('^') {
                    self.line(AvrLine::Xck, true);
                    self.line(AvrLine::Rxd, bit == '1');
                    self.to(self.t + time);
                    self.line(AvrLine::Xck, false);
                } else {
                    self.line(AvrLine::Rxd, bit == '1');
                }
                self.to(self.t + time);
            }
        } else {
            match word {
                "r0" | "r1" => self.line(AvrLine::Rxd, word == "r1"),
                "x0" | "x1" => self.line(AvrLine::Xck, word == "x1"),
                "out" => self.port.on_direction_changed(AvrLine::Xck, true, t, &mut self.out),
                "reset" => self.port.reset(false, t, &mut self.out),
                "sleep" => self.port.stop_clock(t, &mut self.out),
                "wake" => self.port.restart_clock(t, &mut self.out),
                "take" => self.port.on_interrupt_taken(2, t, &mut self.out),
                "read" => {
                    let value = self.port.read(UsartRegister::UDR, t, &mut self.out);
                    self.say(format!("read {value:02X}"));
                }
                "?" => {
                    let ninth = if self.port.peek(UsartRegister::UCSRB, t) & 2 != 0 { " 9" } else { "" };
                    self.say(format!("a={:02X}{ninth}", self.port.peek(UsartRegister::UCSRA, t)));
                }
                "i" => self.say(format!("i {}", self.port.interrupt_requests())),
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
        let mut bench = TestBench { port: AvrUsart::new(0), t: 0, out: Vec::new(), said: Vec::new() };
        bench.word("r1");
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
