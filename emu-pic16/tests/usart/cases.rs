//! Hand-made cases, one per line, in clocks.

use emu_pic16::periph::map::{InterruptFlag, Pic16Line, Sfr};
use emu_pic16::periph::usart::Pic16Usart;
use emu_pic16::periph::{Device, Pic16Drive, Pic16Outbox, Pic16Signal};
use emu_test_support::case_lines;

/// Format: `topic | script | events`.
///
/// In a script, `N` is the clock of what follows it:
///
/// - `rc=XX`, `tx=XX`, `br=XX`, `w=XX` are writes to RCSTA, TXSTA, SPBRG, TXREG.
/// - `r0`, `r1`, `c0`, `c1` are levels of RX and TX from outside; RX is high initially.
/// - `/bits:N` are levels of RX of N clocks each.
/// - `^bits:N` are pulses of CK from outside, N clocks each, high in the first half, with the bits on RX.
/// - `read` reads RCREG; `?` shows RCSTA and TXSTA, `i` TXIF and RCIF, `s` the byte in its stop bit.
/// - `sleep`, `wake`, `reset`; `early` makes TRMT set at the start of a stop bit.
///
/// Events are `N T0`, `N T1`, `N T-` for TX driven or left to the port, `R` likewise for RX, flags set, and
/// bytes sent. With SPBRG = 1 a period of the generator is 8 clocks: a bit is 32 clocks with BRGH = 1, and 8
/// clocks in synchronous mode.
const CASES: &str = "
# Asynchronous transmission (10.2.1)
80 cycles at 8 a bit, from an edge of the shift clock | 0 br=01 tx=24 rc=80 8 w=A5 400 | 0 TXIF, 0 T1, 16 TXIF, 32 T0, 64 T1, 96 T0, 128 T1, 160 T0, 224 T1, 256 T0, 288 T1, 352 sent A5
BRGH = 0: 64 clocks a bit | 0 tx=20 rc=80 8 w=FF 800 | 0 TXIF, 0 T1, 16 TXIF, 64 T0, 128 T1, 704 sent FF
TSR loaded as the shift clock ticks | 0 br=01 tx=24 rc=80 28 w=FF 400 | 0 TXIF, 0 T1, 32 T0, 36 TXIF, 64 T1, 352 sent FF
TSR loaded too late for it | 0 br=01 tx=24 rc=80 32 w=FF 400 | 0 TXIF, 0 T1, 40 TXIF, 64 T0, 96 T1, 384 sent FF
TXIF is valid in the second instruction | 0 br=01 tx=24 rc=80 8 w=FF i 11 i 12 i 16 i 20 w=FF i 24 i 300 i | 0 TXIF, 0 T1, 8 i 10, 11 i 10, 12 i 00, 16 TXIF, 16 i 10, 20 i 10, 24 i 00, 32 T0, 64 T1, 300 i 00
back to back | 0 br=01 tx=24 rc=80 8 w=FF 16 w=00 700 | 0 TXIF, 0 T1, 16 TXIF, 32 T0, 64 T1, 352 sent FF, 352 T0, 356 TXIF, 640 T1, 672 sent 00
two writes in a row: TSR has the first | 0 br=01 tx=24 rc=80 8 w=FF 12 w=00 700 | 0 TXIF, 0 T1, 32 T0, 64 T1, 352 sent FF, 352 T0, 356 TXIF, 640 T1, 672 sent 00
a third replaces the second | 0 br=01 tx=24 rc=80 8 w=FF 12 w=00 16 w=FF 700 | 0 TXIF, 0 T1, 32 T0, 64 T1, 352 sent FF, 352 T0, 356 TXIF, 384 T1, 672 sent FF
TRMT from the load to the middle of the stop bit | 0 br=01 tx=24 rc=80 8 w=FF 11 ? 12 ? 335 ? s 336 ? s 352 ? s | 0 TXIF, 0 T1, 11 rc=80 tx=26, 12 rc=80 tx=24, 16 TXIF, 32 T0, 64 T1, 335 rc=80 tx=24, 335 s FF, 336 rc=80 tx=26, 336 s FF, 352 sent FF, 352 rc=80 tx=26, 352 s --
TRMT as the stop bit begins, by the other reading, a reset or not | early reset 0 br=01 tx=24 rc=80 8 w=FF 319 ? s 320 ? s 352 ? | 0 TXIF, 0 T1, 16 TXIF, 32 T0, 64 T1, 319 rc=80 tx=24, 319 s --, 320 rc=80 tx=26, 320 s FF, 352 sent FF, 352 rc=80 tx=26
TRMT stays clear while the next byte waits | 0 br=01 tx=24 rc=80 8 w=FF 16 w=00 351 ? 352 ? 655 ? 656 ? 700 | 0 TXIF, 0 T1, 16 TXIF, 32 T0, 64 T1, 351 rc=80 tx=24, 352 sent FF, 352 T0, 352 rc=80 tx=24, 356 TXIF, 640 T1, 655 rc=80 tx=24, 656 rc=80 tx=26, 672 sent 00
a byte written behind TRMT follows without a gap | 0 br=01 tx=24 rc=80 8 w=FF 340 w=00 341 ? 700 | 0 TXIF, 0 T1, 16 TXIF, 32 T0, 64 T1, 341 rc=80 tx=24, 352 sent FF, 352 T0, 356 TXIF, 640 T1, 672 sent 00
stop bit from its begin on | 0 br=01 tx=24 rc=80 8 w=00 319 s 320 s 330 | 0 TXIF, 0 T1, 16 TXIF, 32 T0, 319 s --, 320 T1, 320 s 00
nine bits, the ninth 1 | 0 br=01 tx=65 rc=80 8 w=00 400 | 0 TXIF, 0 T1, 16 TXIF, 32 T0, 320 T1, 384 sent 00
nine bits, the ninth 0 | 0 br=01 tx=64 rc=80 8 w=FF 400 | 0 TXIF, 0 T1, 16 TXIF, 32 T0, 64 T1, 320 T0, 352 T1, 384 sent FF
TX9D after the load is for the next word | 0 br=01 tx=64 rc=80 8 w=FF 12 tx=65 400 | 0 TXIF, 0 T1, 16 TXIF, 32 T0, 64 T1, 320 T0, 352 T1, 384 sent FF
TXEN cleared: aborted, pin left | 0 br=01 tx=24 rc=80 8 w=00 100 tx=04 i ? 500 | 0 TXIF, 0 T1, 16 TXIF, 32 T0, 100 T-, 100 i 00, 100 rc=80 tx=06
TXEN set again: idle | 0 br=01 tx=24 rc=80 8 w=00 100 tx=04 104 tx=24 500 | 0 TXIF, 0 T1, 16 TXIF, 32 T0, 100 T-, 104 TXIF, 104 T1
TXREG loaded before TXEN is set | 0 br=01 rc=80 4 w=FF 40 tx=24 400 | 40 T1, 48 TXIF, 64 T0, 96 T1, 384 sent FF
SPEN cleared: aborted | 0 br=01 tx=24 rc=80 8 w=00 100 rc=00 500 | 0 TXIF, 0 T1, 16 TXIF, 32 T0, 100 T-
nothing goes out before SPEN is set | 0 br=01 tx=24 8 w=FF 100 rc=80 460 | 0 TXIF, 100 T1, 108 TXIF, 128 T0, 160 T1, 448 sent FF
SPBRG written: the generator begins anew | 0 br=01 tx=24 rc=80 8 w=FF 20 br=01 400 | 0 TXIF, 0 T1, 16 TXIF, 52 T0, 84 T1, 372 sent FF
.. in the middle of a bit: it grows longer | 0 br=01 tx=24 rc=80 8 w=FF 52 br=01 400 | 0 TXIF, 0 T1, 16 TXIF, 32 T0, 84 T1, 372 sent FF
stopped in sleep | 0 br=01 tx=24 rc=80 8 w=FF 40 sleep 140 wake 500 | 0 TXIF, 0 T1, 16 TXIF, 32 T0, 164 T1, 452 sent FF
TRMT, bit 3, FERR, OERR and RX9D are not written | 0 tx=FF ? tx=00 rc=FF ? rc=00 ? | 0 TXIF, 0 rc=00 tx=F7, 0 rc=F8 tx=02, 0 rc=00 tx=02
a reset leaves nothing, and SPBRG is 0 | 0 br=01 tx=24 rc=80 8 w=00 12 w=FF 100 reset ? i 500 tx=24 rc=80 508 w=FF 700 | 0 TXIF, 0 T1, 32 T0, 100 T-, 100 rc=00 tx=02, 100 i 00, 500 T1, 500 TXIF, 516 T0, 516 TXIF, 532 T1, 676 sent FF

# Asynchronous reception (10.2.2): with BRGH = 0 the periods that end 7, 8, 9 after the edge, 16 apart
35h, edge 2 clocks before a period ends | 0 rc=90 102 /0101011001:64 800 read ? | 712 RCIF, 800 read 35, 800 rc=90 tx=02
the edge as a period ends: it is not counted | 0 rc=90 104 /0101011001:64 800 read | 716 RCIF, 800 read 35
BRGH = 1, SPBRG = 1: votes at 116, 148, .. | 0 br=01 tx=04 rc=90 102 /0101011001:32 500 read | 404 RCIF, 500 read 35
BRGH = 1, SPBRG = 0: votes at 110, 126, .. | 0 tx=04 rc=90 102 /0101011001:16 500 read | 254 RCIF, 500 read 35
nine bits | 0 br=01 tx=04 rc=D0 102 /00101010111:32 500 ? read | 436 RCIF, 500 rc=D1 tx=06, 500 read AA
CREN is 0 | 0 br=01 tx=04 rc=80 102 /0101011001:32 500 |
SPEN is 0 | 0 br=01 tx=04 rc=10 102 /0101011001:32 500 |
SREN alone is nothing here | 0 br=01 tx=04 rc=A0 102 /0101011001:32 500 ? | 500 rc=A0 tx=06
two of three samples high: no start bit | 0 br=01 tx=04 rc=90 102 r0 112 r1 120 /0111111111:32 500 read | 428 RCIF, 500 read FF
two of three low: a start bit | 0 br=01 tx=04 rc=90 102 r0 114 r1 500 read | 404 RCIF, 500 read FF
a level is sampled before it changes | 0 br=01 tx=04 rc=90 102 r0 113 r1 500 read | 404 RCIF, 500 read FF
BRGH = 0: samples at 128, 132, 136; one low | 0 rc=90 102 r0 131 r1 133 r0 134 r1 900 |
BRGH = 0: the first and the last are low | 0 rc=90 102 r0 129 r1 133 r0 137 r1 900 read | 712 RCIF, 900 read FF
BRGH = 0: what is not sampled does not count | 0 rc=90 102 r0 103 r1 127 r0 133 r1 900 read | 712 RCIF, 900 read FF
a line that is low begins no frame | 0 br=01 tx=04 r0 8 rc=90 700 |
framing error | 0 br=01 tx=04 rc=90 102 /0111111110:32 422 r1 500 ? read ? | 404 RCIF, 500 rc=94 tx=06, 500 read FF, 500 rc=94 tx=06
a break is one word | 0 br=01 tx=04 rc=90 102 r0 3000 ? read i | 404 RCIF, 3000 rc=94 tx=06, 3000 read 00, 3000 i 00
FERR and RX9D go with their word | 0 br=01 tx=04 rc=90 100 /0111111110:32 420 r1 430 /0010000001:32 800 ? read ? read i | 404 RCIF, 800 rc=94 tx=06, 800 read FF, 800 rc=90 tx=06, 800 read 02, 800 i 00
the third word is an overrun; two stay | 0 br=01 tx=04 rc=90 100 /0100000001:32 /0010000001:32 /011000000:32 r1 1043 ? 1044 ? read i read i read | 404 RCIF, 1043 rc=90 tx=06, 1044 rc=92 tx=06, 1044 read 01, 1044 i 01, 1044 read 02, 1044 i 00, 1044 read 02
OERR ends reception | 0 br=01 tx=04 rc=90 100 /0100000001:32 /0010000001:32 /0110000001:32 1100 read read /0001000001:32 1500 i ? | 404 RCIF, 1100 read 01, 1100 read 02, 1500 i 00, 1500 rc=92 tx=06
CREN cleared takes OERR away, and not the words | 0 br=01 tx=04 rc=90 100 /0100000001:32 /0010000001:32 /0110000001:32 1100 rc=80 ? rc=90 ? read read 1120 /0001000001:32 1500 read | 404 RCIF, 1100 rc=80 tx=06, 1100 rc=90 tx=06, 1100 read 01, 1100 read 02, 1428 RCIF, 1500 read 04
read in time | 0 br=01 tx=04 rc=90 100 /0100000001:32 /0010000001:32 1000 read /0110000001:32 1400 ? | 404 RCIF, 1000 read 01, 1400 rc=90 tx=06
SPEN cleared drops all | 0 br=01 tx=04 rc=90 102 /0111111110:32 422 r1 500 rc=10 i ? | 404 RCIF, 500 i 00, 500 rc=10 tx=06
CREN cleared in mid-frame | 0 br=01 tx=04 rc=90 102 /011111:32 200 rc=80 rc=90 600 |
ADDEN: ninth bit 0 is not loaded | 0 br=01 tx=04 rc=D8 102 /00101010101:32 500 i ? | 500 i 00, 500 rc=D8 tx=06
ADDEN: ninth bit 1 is | 0 br=01 tx=04 rc=D8 102 /00101010111:32 500 ? read | 436 RCIF, 500 rc=D9 tx=06, 500 read AA
ADDEN with eight bits is nothing | 0 br=01 tx=04 rc=98 102 /0010101011:32 500 read | 404 RCIF, 500 read AA
stopped in sleep, with what it had | 0 br=01 tx=04 rc=90 102 r0 114 r1 200 sleep 1200 wake 1500 read | 1404 RCIF, 1500 read FF
no start bit is found in sleep | 0 br=01 tx=04 rc=90 100 sleep 102 /0101011001:32 500 wake 1500 i | 1500 i 00
3 % slow, 3 % fast | 0 br=07 tx=04 rc=90 101 /0101010101:124 1401 /0101010101:132 3000 read read i | 1328 RCIF, 3000 read 55, 3000 read 55, 3000 i 00

# Synchronous master (10.3): 8 clocks a bit
transmission: data change as CK rises | 0 br=01 tx=B0 rc=80 16 w=A5 200 | 0 TXIF, 0 T0, 0 R1, 20 T1, 24 T0, 24 TXIF, 28 R0, 28 T1, 32 T0, 36 R1, 36 T1, 40 T0, 44 R0, 44 T1, 48 T0, 52 T1, 56 T0, 60 R1, 60 T1, 64 T0, 68 R0, 68 T1, 72 T0, 76 R1, 76 T1, 80 T0, 84 sent A5
two words go without a gap; DT keeps its last bit | 0 tx=B0 rc=80 8 w=FF 12 w=00 90 | 0 TXIF, 0 T0, 0 R1, 12 T1, 14 T0, 16 T1, 18 T0, 20 T1, 22 T0, 24 T1, 26 T0, 28 T1, 30 T0, 32 T1, 34 T0, 36 T1, 38 T0, 40 T1, 42 T0, 44 sent FF, 44 R0, 44 T1, 46 T0, 48 TXIF, 48 T1, 50 T0, 52 T1, 54 T0, 56 T1, 58 T0, 60 T1, 62 T0, 64 T1, 66 T0, 68 T1, 70 T0, 72 T1, 74 T0, 76 sent 00
TXREG loaded first: the generator starts with TXEN | 0 br=40 tx=90 rc=80 4 w=FF 100 tx=B0 250 | 100 T0, 100 R1, 104 T1, 108 TXIF, 234 T0
TXEN cleared: both pins left | 0 br=40 tx=90 rc=80 4 w=FF 100 tx=B0 152 tx=90 ? 500 | 100 T0, 100 R1, 104 T1, 108 TXIF, 152 T-, 152 R-, 152 rc=80 tx=92
SREN: one word, sampled as CK falls | 0 br=01 tx=90 rc=80 100 rc=A0 104 /01010011:8 200 ? read | 100 T0, 104 T1, 108 T0, 112 T1, 116 T0, 120 T1, 124 T0, 128 T1, 132 T0, 136 T1, 140 T0, 144 T1, 148 T0, 152 T1, 156 T0, 160 T1, 164 T-, 164 RCIF, 200 rc=80 tx=92, 200 read CA
SREN and CREN: CREN counts | 0 tx=90 100 rc=B0 104 /01010011:4 134 ? 140 ? rc=80 read | 100 T0, 104 T1, 106 T0, 108 T1, 110 T0, 112 T1, 114 T0, 116 T1, 118 T0, 120 T1, 122 T0, 124 T1, 126 T0, 128 T1, 130 T0, 132 T1, 134 T0, 134 RCIF, 134 rc=90 tx=92, 136 T1, 138 T0, 140 T1, 140 rc=90 tx=92, 140 T-, 140 read CA
a reception takes DT away; the word is lost | 0 br=40 tx=B0 rc=80 8 w=FF 264 rc=A0 rc=80 300 | 0 TXIF, 0 T0, 0 R1, 16 TXIF, 264 T1, 264 R-, 264 R1
stopped in sleep | 0 br=40 tx=90 rc=80 4 w=FF 100 tx=B0 152 sleep 252 wake 480 | 100 T0, 100 R1, 104 T1, 108 TXIF, 334 T0, 464 T1

# Synchronous slave (10.4)
transmission: over as CK falls for the last time | 0 tx=30 rc=80 8 w=A5 20 ^11111111:8 200 ? | 0 TXIF, 0 R1, 16 TXIF, 28 R0, 36 R1, 44 R0, 60 R1, 68 R0, 76 R1, 80 sent A5, 200 rc=80 tx=32
in sleep: the second word sets TXIF | 0 tx=30 rc=80 8 w=A5 12 w=00 20 sleep 24 ^11111111:8 200 i | 0 TXIF, 0 R1, 32 R0, 40 R1, 48 R0, 64 R1, 72 R0, 80 R1, 84 sent A5, 88 TXIF, 200 i 10
reception | 0 tx=10 rc=90 20 ^01010011:8 200 read | 80 RCIF, 200 read CA
reception in sleep | 0 tx=10 rc=90 8 sleep 20 ^01010011:8 200 i | 80 RCIF, 200 i 01
nine bits | 0 tx=10 rc=D0 20 ^010100111:8 200 ? read | 88 RCIF, 200 rc=D1 tx=12, 200 read CA
SREN is nothing here | 0 tx=10 rc=A0 20 ^01010011:8 200 ? | 200 rc=A0 tx=12
";

struct TestBench {
    port: Pic16Usart,
    t: u64,
    out: Pic16Outbox,
    said: Vec<(u64, String)>,
}

impl TestBench {
    fn say(&mut self, what: String) {
        self.drain();
        self.said.push((self.t, what));
    }

    fn drain(&mut self) {
        for signal in self.out.drain(..) {
            let said = match signal {
                Pic16Signal::Flag { t, flag } => {
                    assert!(matches!(flag, InterruptFlag::TXIF | InterruptFlag::RCIF));
                    (t, format!("{flag:?}"))
                }
                Pic16Signal::Drive { t, line, drive } => {
                    let level = match drive {
                        Pic16Drive::Port => '-',
                        Pic16Drive::Low => '0',
                        Pic16Drive::High => '1',
                        Pic16Drive::Float | Pic16Drive::Open => 'Z',
                    };
                    (t, format!("{}{level}", if line == Pic16Line::Tx { 'T' } else { 'R' }))
                }
                Pic16Signal::Sent { t, byte } => (t, format!("sent {byte:02X}")),
                other => panic!("{other:?}"),
            };
            self.said.push(said);
        }
    }

    fn to(&mut self, t: u64) {
        self.t = t;
        self.port.run_due(t, &mut self.out);
    }

    fn line(&mut self, line: Pic16Line, high: bool) {
        self.port.on_line_changed(line, high, self.t, &mut self.out);
    }

    fn word(&mut self, word: &str) {
        if let Ok(t) = word.parse() {
            self.to(t);
        } else if let Some((name, value)) = word.split_once('=') {
            let reg = match name {
                "rc" => Sfr::RCSTA,
                "tx" => Sfr::TXSTA,
                "br" => Sfr::SPBRG,
                "w" => Sfr::TXREG,
                _ => panic!("{word}"),
            };
            self.port.write(reg, u8::from_str_radix(value, 16).expect(word), 0xFF, self.t, &mut self.out);
        } else if let Some((bits, time)) = word.split_once(':') {
            let time: u64 = time.parse().expect(word);
            for bit in bits[1..].chars() {
                let begin = self.t;
                self.line(Pic16Line::Rx, bit == '1');
                if word.starts_with('^') {
                    self.line(Pic16Line::Tx, true);
                    self.to(begin + time / 2);
                    self.line(Pic16Line::Tx, false);
                }
                self.to(begin + time);
            }
        } else {
            let t = self.t;
            match word {
                "r0" | "r1" => self.line(Pic16Line::Rx, word == "r1"),
                "c0" | "c1" => self.line(Pic16Line::Tx, word == "c1"),
                "early" => self.port = Pic16Usart::new().with_early_trmt(true),
                "reset" => self.port.reset(true, t, &mut self.out),
                "sleep" => self.port.stop_clock(t, &mut self.out),
                "wake" => self.port.restart_clock(t, &mut self.out),
                "read" => {
                    let value = self.port.read(Sfr::RCREG, t, &mut self.out);
                    self.say(format!("read {value:02X}"));
                }
                "?" => {
                    let (rc, tx) = (self.port.peek(Sfr::RCSTA, t), self.port.peek(Sfr::TXSTA, t));
                    self.say(format!("rc={rc:02X} tx={tx:02X}"));
                }
                "i" => self.say(format!("i {}{}", u8::from(self.port.txif(t)), u8::from(self.port.rcif()))),
                "s" => {
                    let byte = self.port.byte_in_stop_bit().map_or("--".to_owned(), |byte| format!("{byte:02X}"));
                    self.say(format!("s {byte}"));
                }
                _ => panic!("{word}"),
            }
        }
        self.drain();
    }
}

/// Sorts events by time. In one clock, lines and flags are sorted, because their order has no meaning; the
/// others keep their order.
fn normal(mut said: Vec<(u64, String)>) -> Vec<(u64, String)> {
    said.sort_by_key(|(t, what)| {
        let order = match what.get(..1) {
            Some("T" | "R") if !what.starts_with("read") => what.clone(),
            _ => String::new(),
        };
        (*t, order)
    });
    said
}

#[test]
fn cases_worked_by_hand() {
    let mut failed = Vec::new();
    for line in case_lines(CASES) {
        let [name, script, ought] = *line.split('|').map(str::trim).collect::<Vec<_>>() else { panic!("{line}") };
        let mut bench = TestBench { port: Pic16Usart::new(), t: 0, out: Vec::new(), said: Vec::new() };
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
