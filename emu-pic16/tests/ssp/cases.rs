//! Hand-made cases, one per line.

use emu_pic16::periph::map::{InterruptFlag, Pic16Line, Sfr};
use emu_pic16::periph::ssp::Pic16Ssp;
use emu_pic16::periph::{Device, Pic16Drive};
use emu_test_support::case_lines;

use crate::bus::Bus;
use crate::rig::TestBench;

/// Format: `topic | script | events`.
///
/// In a script, `N` is the clock of what follows:
///
/// - `con=XX` and so on are writes.
/// - `i`, `k`, `s` with a level are SDI, SCK, SS; `t2` is a period of timer 2.
/// - `buf` reads SSPBUF; `sleep`, `wake`.
/// - `keep` makes SSPSR keep its bits when SS rises.
/// - `?` shows SSPCON, SSPSTAT and SSPBUF.
///
/// Events are the clock and `K` (SCK) or `O` (SDO) with its override, and `IF` for SSPIF.
const SPI: &str = "
# Master, DS39582 figure 9-3: the first bit begins 2 clocks after the write, SSPIF comes 2 clocks after the last one
A5h at Fosc/4, SDI low | 4 con=20 8 buf=A5 45 ? | 4 K0, 4 O0, 10 K1, 10 O1, 12 K0, 14 K1, 14 O0, 16 K0, 18 K1, 18 O1, 20 K0, 22 K1, 22 O0, 24 K0, 26 K1, 28 K0, 30 K1, 30 O1, 32 K0, 34 K1, 34 O0, 36 K0, 38 K1, 38 O1, 40 K0, 44 IF, 45 con=20 stat=01 buf=00
idle high: the same upside down | 4 con=30 8 buf=00 45 | 4 K1, 4 O0, 10 K0, 12 K1, 14 K0, 16 K1, 18 K0, 20 K1, 22 K0, 24 K1, 26 K0, 28 K1, 30 K0, 32 K1, 34 K0, 36 K1, 38 K0, 40 K1, 44 IF
CKE: the clock comes half a bit later | 4 stat=40 con=20 8 buf=80 45 | 4 K0, 4 O0, 10 O1, 12 K1, 14 K0, 14 O0, 16 K1, 18 K0, 20 K1, 22 K0, 24 K1, 26 K0, 28 K1, 30 K0, 32 K1, 34 K0, 36 K1, 38 K0, 40 K1, 42 K0, 44 IF
Fosc/16: bits of 16 clocks | 4 con=21 8 buf=00 145 | 4 K0, 4 O0, 10 K1, 18 K0, 26 K1, 34 K0, 42 K1, 50 K0, 58 K1, 66 K0, 74 K1, 82 K0, 90 K1, 98 K0, 106 K1, 114 K0, 122 K1, 130 K0, 140 IF
Fosc/64: bits of 64 clocks | 4 con=22 8 buf=00 600 | 4 K0, 4 O0, 10 K1, 42 K0, 74 K1, 106 K0, 138 K1, 170 K0, 202 K1, 234 K0, 266 K1, 298 K0, 330 K1, 362 K0, 394 K1, 426 K0, 458 K1, 490 K0, 524 IF
timer 2: a period is half a bit; the flag in the Q4 after the Q2 after the last one | 4 con=23 8 buf=C0 t2 16 t2 24 t2 32 t2 40 t2 48 t2 56 t2 64 t2 72 t2 80 t2 88 t2 96 t2 104 t2 112 t2 120 t2 128 t2 136 t2 150 | 4 K0, 4 O0, 8 K1, 8 O1, 16 K0, 24 K1, 32 K0, 40 K1, 40 O0, 48 K0, 56 K1, 64 K0, 72 K1, 80 K0, 88 K1, 96 K0, 104 K1, 112 K0, 120 K1, 128 K0, 140 IF
SMP clear: sampled in the middle, at 12 and 16 | 4 con=20 8 buf=00 11 i1 13 i0 15 i1 17 i0 45 ? | 4 K0, 4 O0, 10 K1, 12 K0, 14 K1, 16 K0, 18 K1, 20 K0, 22 K1, 24 K0, 26 K1, 28 K0, 30 K1, 32 K0, 34 K1, 36 K0, 38 K1, 40 K0, 44 IF, 45 con=20 stat=01 buf=C0
SMP set: sampled at the end, at 14 and 42 | 4 stat=80 con=20 8 buf=00 11 i1 15 i0 41 i1 45 ? | 4 K0, 4 O0, 10 K1, 12 K0, 14 K1, 16 K0, 18 K1, 20 K0, 22 K1, 24 K0, 26 K1, 28 K0, 30 K1, 32 K0, 34 K1, 36 K0, 38 K1, 40 K0, 44 IF, 45 con=20 stat=81 buf=81
a write before the flag is a collision | 4 con=20 8 buf=00 40 buf=FF 45 ? | 4 K0, 4 O0, 10 K1, 12 K0, 14 K1, 16 K0, 18 K1, 20 K0, 22 K1, 24 K0, 26 K1, 28 K0, 30 K1, 32 K0, 34 K1, 36 K0, 38 K1, 40 K0, 44 IF, 45 con=A0 stat=01 buf=00
a write with the flag is none | 4 con=20 8 buf=00 44 buf=FF 47 ? | 4 K0, 4 O0, 10 K1, 12 K0, 14 K1, 16 K0, 18 K1, 20 K0, 22 K1, 24 K0, 26 K1, 28 K0, 30 K1, 32 K0, 34 K1, 36 K0, 38 K1, 40 K0, 44 IF, 46 K1, 46 O1, 47 con=20 stat=01 buf=FF
SSPEN cleared ends it | 4 con=20 8 buf=FF 12 con=00 100 ? | 4 K0, 4 O0, 10 K1, 10 O1, 12 K0, 12 Kp, 12 Op, 100 con=00 stat=00 buf=FF
sleep in mid-byte: it goes on afterwards | 4 con=20 8 buf=00 20 sleep 120 wake 150 | 4 K0, 4 O0, 10 K1, 12 K0, 14 K1, 16 K0, 18 K1, 20 K0, 122 K1, 124 K0, 126 K1, 128 K0, 130 K1, 132 K0, 134 K1, 136 K0, 138 K1, 140 K0, 144 IF
off: SSPBUF is a plain register | 4 buf=77 8 ? | 8 con=00 stat=00 buf=77

# Slave, DS39582 figures 9-5 and 9-6
rising edges put out, falling ones sample | 4 con=25 8 buf=81 i1 20 k1 24 k0 i0 28 k1 32 k0 36 k1 40 k0 44 k1 48 k0 52 k1 56 k0 60 k1 64 k0 68 k1 72 k0 76 k1 80 i1 k0 90 ? | 4 O0, 20 O1, 28 O0, 76 O1, 84 IF, 90 con=25 stat=01 buf=81
CKE: bit 7 is out at once, rising edges sample | 4 stat=40 con=25 8 buf=80 i1 20 k1 24 k0 i0 28 k1 32 k0 36 k1 40 k0 44 k1 48 k0 52 k1 56 k0 60 k1 64 k0 68 k1 72 k0 76 k1 81 k0 90 ? | 4 O0, 8 O1, 24 O0, 81 O1, 84 IF, 90 con=25 stat=41 buf=80
an edge after the end of Q2 waits for the next one | 4 con=25 10 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 k1 15 k0 30 | 4 O0, 20 IF
SSPBUF full: the byte is lost | 4 con=25 10 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 20 i1 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 30 ? | 4 O0, 12 IF, 24 IF, 30 con=65 stat=01 buf=00
SSPBUF read in time | 4 con=25 10 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 16 buf 20 i1 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 30 ? | 4 O0, 12 IF, 16 read 00, 24 IF, 30 con=25 stat=01 buf=FF
SS high floats SDO, stops the clock and clears the bit counter | 4 con=24 i1 10 k1 k0 k1 k0 20 s1 k1 k0 30 s0 40 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 50 k1 k0 58 k1 k0 70 ? | 4 O0, 20 Oz, 30 O0, 60 IF, 70 con=24 stat=01 buf=FF
SS high within a byte: the next time it is sent from bit 7 on | 4 con=24 8 buf=81 10 k1 12 k0 14 k1 16 k0 20 s1 30 s0 40 k1 42 k0 44 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 50 k1 54 k0 70 ? | 4 O0, 10 O1, 14 O0, 20 Oz, 30 O0, 40 O1, 44 O0, 50 O1, 56 IF, 70 con=24 stat=01 buf=00
SS high within a byte, by the other reading: what is left of it goes on | keep 4 con=24 8 buf=81 10 k1 12 k0 14 k1 16 k0 20 s1 30 s0 40 k1 42 k0 44 k1 k0 k1 k0 k1 k0 k1 k0 50 k1 k0 52 k1 k0 54 k1 k0 70 ? | 4 O0, 10 O1, 14 O0, 20 Oz, 30 O0, 50 O1, 52 O0, 56 IF, 70 con=24 stat=01 buf=00
SS high between bytes: what was received is sent | 4 con=24 i1 8 buf=00 10 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 20 s1 30 s0 40 k1 50 ? | 4 O0, 12 IF, 20 Oz, 30 O0, 40 O1, 50 con=24 stat=01 buf=FF
SS does not matter in mode 5 | 4 con=25 s1 10 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 20 | 4 O0, 12 IF
a write after the first edge is a collision | 4 con=25 10 k1 12 buf=FF 16 ? | 4 O0, 16 con=A5 stat=00 buf=00
in sleep the flag comes with the last edge | 4 con=25 i1 8 sleep 11 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 k1 13 k0 20 wake ? | 4 O0, 13 IF, 20 con=25 stat=01 buf=FF
the clock idles high | k1 4 con=35 6 i1 10 k0 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 k1 k0 k1 20 ? | 4 O0, 12 IF, 20 con=35 stat=01 buf=FF
";

fn register(name: &str) -> Sfr {
    match name {
        "buf" => Sfr::SSPBUF,
        "con" => Sfr::SSPCON,
        "con2" => Sfr::SSPCON2,
        "add" => Sfr::SSPADD,
        "stat" => Sfr::SSPSTAT,
        _ => panic!("{name} is not a register"),
    }
}

fn drive(drive: Pic16Drive) -> &'static str {
    match drive {
        Pic16Drive::Port => "p",
        Pic16Drive::Low => "0",
        Pic16Drive::High => "1",
        Pic16Drive::Float => "z",
        Pic16Drive::Open => "o",
    }
}

fn rows(text: &str) -> impl Iterator<Item = [&str; 3]> {
    case_lines(text).map(|line| {
        let mut parts = line.split('|').map(str::trim);
        [(); 3].map(|()| parts.next().unwrap_or_else(|| panic!("three parts: {line}")))
    })
}

/// Returns the level in the last character of a token.
fn level(token: &str) -> bool {
    token.ends_with('1')
}

fn spi(script: &str) -> String {
    let mut bench = TestBench::new(Pic16Ssp::new(true));
    let mut said: Vec<String> = Vec::new();
    let (mut t, mut drives, mut flags) = (0, bench.drives, 0);
    let mut note = |bench: &TestBench, t: u64, said: &mut Vec<String>| {
        for (n, name) in [(0, "K"), (2, "O")] {
            if bench.drives[n] != drives[n] {
                said.push(format!("{t} {name}{}", drive(bench.drives[n])));
            }
        }
        said.extend((flags..bench.flags.len()).map(|_| format!("{t} IF")));
        (drives, flags) = (bench.drives, bench.flags.len());
    };
    for token in script.split_whitespace() {
        if let Ok(to) = token.parse::<u64>() {
            while t < to {
                t += 1;
                bench.tick(t);
                note(&bench, t, &mut said);
            }
            continue;
        }
        match token {
            "keep" => bench = TestBench::new(Pic16Ssp::new(true).with_kept_bits(true)),
            "t2" => bench.timer2(t),
            "sleep" => bench.sleep(t),
            "wake" => bench.wake(t),
            "buf" => {
                let value = bench.read(Sfr::SSPBUF, t);
                said.push(format!("{t} read {value:02X}"));
            }
            "?" => {
                let [buf, con, _, _, stat] = bench.regs(t);
                said.push(format!("{t} con={con:02X} stat={stat:02X} buf={buf:02X}"));
            }
            "i0" | "i1" => bench.line(Pic16Line::Sdi, level(token), t),
            "k0" | "k1" => bench.line(Pic16Line::Sck, level(token), t),
            "s0" | "s1" => bench.line(Pic16Line::Ss, level(token), t),
            _ => {
                let (name, value) = token.split_once('=').unwrap_or_else(|| panic!("{token}?"));
                bench.write(register(name), u8::from_str_radix(value, 16).expect("a byte"), t);
            }
        }
        note(&bench, t, &mut said);
    }
    said.join(", ")
}

#[test]
fn spi_cases() {
    let mut wrong = Vec::new();
    for [what, script, expected] in rows(SPI) {
        let said = spi(script);
        if said != expected {
            wrong.push(format!("{what}\n  expected {expected}\n  but      {said}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Format: `kind: topic | script | events`; kind is `basic` or `mssp`. The script is as for [`SPI`], but on
/// lines with pull-ups: `c`, `d` with a level are an outside device that pulls SCL or SDA low or releases it.
/// Events are the clock and `C` or `D` with the level of the line, `IF`, `BC`.
const I2C: &str = "
# Start, DS39582 figure 9-19: TBRG is 4 clocks with SSPADD = 1
mssp: Start, A0h without an answer, Stop | 4 add=01 con=28 8 con2=01 20 buf=A0 93 ? 96 con2=04 110 ? | 12 D0, 16 C0, 16 IF, 20 D1, 24 C1, 28 C0, 28 D0, 32 C1, 36 C0, 36 D1, 40 C1, 44 C0, 44 D0, 48 C1, 52 C0, 56 C1, 60 C0, 64 C1, 68 C0, 72 C1, 76 C0, 80 C1, 84 C0, 84 D1, 88 C1, 92 C0, 92 IF, 93 con=28 con2=40 stat=08 buf=A0, 96 D0, 100 C1, 104 D1, 108 IF, 110 con=28 con2=00 stat=10 buf=A0
mssp: SSPADD = 0 is half of that | 4 con=28 8 con2=01 20 | 10 D0, 12 C0, 12 IF
mssp: SSPADD<7> does not count | 4 add=81 con=28 8 con2=01 20 | 12 D0, 16 C0, 16 IF
mssp: SDA is low already | 4 add=01 con=28 6 d0 8 con2=01 9 ? 20 | 6 D0, 6 IF, 8 BC, 9 con=28 con2=00 stat=08 buf=00
mssp: SCL falls before SDA | 4 add=01 con=28 8 con2=01 10 c0 11 ? 20 | 10 C0, 10 BC, 11 con=28 con2=00 stat=00 buf=00
mssp: another pulls SDA first: joined, TBRG anew (figure 9-28) | 4 add=01 con=28 8 con2=01 10 d0 20 | 10 D0, 14 C0, 14 IF
mssp: SCL falls in the second TBRG: no collision | 4 add=01 con=28 8 con2=01 13 c0 20 | 12 D0, 13 C0, 16 IF
mssp: SSPBUF written in the Start is a collision of writes | 4 add=01 con=28 8 con2=01 12 buf=55 20 ? | 12 D0, 16 C0, 16 IF, 20 con=A8 con2=00 stat=08 buf=00
mssp: no queue: PEN does not take in the Start | 4 add=01 con=28 8 con2=01 12 con2=24 13 ? 30 | 12 D0, 13 con=28 con2=21 stat=08 buf=00, 16 C0, 16 IF
mssp: Start again while the lines are held: let go, looked at 2 clocks later | 4 add=01 con=28 8 con2=01 20 con2=01 40 | 12 D0, 16 C0, 16 IF, 20 D1, 20 C1, 26 D0, 30 C0, 30 IF
# Repeated Start, figure 9-20
mssp: repeated Start: TBRG low, TBRG high, TBRG with SDA low | 4 add=01 con=28 8 con2=01 20 con2=02 40 ? | 12 D0, 16 C0, 16 IF, 20 D1, 24 C1, 28 D0, 32 C0, 32 IF, 40 con=28 con2=00 stat=08 buf=00
mssp: repeated Start: SDA is low as SCL rises | 4 add=01 con=28 8 con2=01 20 con2=02 21 d0 40 | 12 D0, 16 C0, 16 IF, 20 D1, 21 D0, 24 C1, 24 BC
mssp: repeated Start: SCL falls first | 4 add=01 con=28 8 con2=01 20 con2=02 26 c0 40 | 12 D0, 16 C0, 16 IF, 20 D1, 24 C1, 26 C0, 26 BC
# Stop, figures 9-24, 9-31, 9-32
mssp: Stop: SDA stays low | 4 add=01 con=28 8 con2=01 20 con2=04 22 d0 40 | 12 D0, 16 C0, 16 IF, 24 C1, 32 BC
mssp: Stop: SCL falls before SDA rises | 4 add=01 con=28 8 con2=01 20 con2=04 26 c0 40 | 12 D0, 16 C0, 16 IF, 24 C1, 26 C0, 26 D1, 26 BC
# Clock arbitration, figure 9-18
mssp: SCL is held for 5 clocks: TBRG counts from the next even clock | 4 add=01 con=28 8 con2=01 20 con2=04 22 c0 29 c1 60 | 12 D0, 16 C0, 16 IF, 29 C1, 34 D1, 38 IF
# Reception and acknowledge, figures 9-22 and 9-23
mssp: reception of FFh, acknowledged, then one without | 4 add=00 con=28 8 con2=01 16 con2=08 49 ? 52 con2=10 60 con2=30 70 ? | 10 D0, 12 C0, 12 IF, 16 D1, 18 C1, 20 C0, 22 C1, 24 C0, 26 C1, 28 C0, 30 C1, 32 C0, 34 C1, 36 C0, 38 C1, 40 C0, 42 C1, 44 C0, 46 C1, 48 C0, 48 IF, 49 con=28 con2=00 stat=09 buf=FF, 52 D0, 54 C1, 56 C0, 56 D1, 56 IF, 62 C1, 64 C0, 64 IF, 70 con=28 con2=20 stat=09 buf=FF
mssp: SSPBUF still full: SSPOV | 4 add=00 con=28 8 con2=01 16 con2=08 52 con2=08 60 d0 90 ? | 10 D0, 12 C0, 12 IF, 16 D1, 18 C1, 20 C0, 22 C1, 24 C0, 26 C1, 28 C0, 30 C1, 32 C0, 34 C1, 36 C0, 38 C1, 40 C0, 42 C1, 44 C0, 46 C1, 48 C0, 48 IF, 54 C1, 56 C0, 58 C1, 60 C0, 60 D0, 62 C1, 64 C0, 66 C1, 68 C0, 70 C1, 72 C0, 74 C1, 76 C0, 78 C1, 80 C0, 82 C1, 84 C0, 84 IF, 90 con=68 con2=00 stat=09 buf=FF
mssp: a collision in an acknowledge of 1 | 4 add=00 con=28 8 con2=01 16 con2=30 17 d0 30 ? | 10 D0, 12 C0, 12 IF, 16 D1, 17 D0, 18 C1, 18 BC, 30 con=28 con2=20 stat=08 buf=00
mssp: a collision in a byte: BF and R/W go | 4 add=00 con=28 8 con2=01 16 buf=FF 17 d0 30 ? | 10 D0, 12 C0, 12 IF, 16 D1, 17 D0, 18 C1, 18 BC, 30 con=28 con2=00 stat=08 buf=FF
mssp: the answer 0 goes to ACKSTAT | 4 add=00 con=28 8 con2=01 16 con2=40 buf=00 47 d0 60 ? | 10 D0, 12 C0, 12 IF, 18 C1, 20 C0, 22 C1, 24 C0, 26 C1, 28 C0, 30 C1, 32 C0, 34 C1, 36 C0, 38 C1, 40 C0, 42 C1, 44 C0, 46 C1, 48 C0, 50 C1, 52 C0, 52 IF, 60 con=28 con2=00 stat=08 buf=00
basic: there is no master and no SSPCON2 | 4 add=01 con=28 8 con2=01 20 buf=A0 60 ? | 60 con=28 con2=00 stat=00 buf=A0
# The program as master
mssp: 1011: Start and Stop are noticed | 4 con=2B 8 d0 c0 16 c1 20 d1 24 ? | 8 D0, 8 IF, 8 C0, 16 C1, 20 D1, 20 IF, 24 con=2B con2=00 stat=10 buf=00
mssp: sleep in a Start: TBRG goes on afterwards | 4 add=01 con=28 8 con2=01 sleep 100 wake 120 | 104 D0, 108 C0, 108 IF
";

fn i2c(kind: &str, script: &str) -> String {
    let port = match kind {
        "basic" => Pic16Ssp::new(false),
        "mssp" => Pic16Ssp::new(true),
        _ => panic!("{kind}?"),
    };
    let mut bus = Bus::new(vec![port]);
    let mut said: Vec<String> = Vec::new();
    let (mut edges, mut flags) = (0, 0);
    let mut note = |bus: &Bus, said: &mut Vec<String>| {
        for &(t, wire, level) in &bus.edges[edges..] {
            said.push(format!("{t} {}{}", ["C", "D"][wire], u8::from(level)));
        }
        for &(t, flag) in &bus.rigs[0].flags[flags..] {
            said.push(format!("{t} {}", if flag == InterruptFlag::SSPIF { "IF" } else { "BC" }));
        }
        (edges, flags) = (bus.edges.len(), bus.rigs[0].flags.len());
    };
    for token in script.split_whitespace() {
        if let Ok(to) = token.parse::<u64>() {
            while bus.t < to {
                bus.to(bus.t + 1);
                note(&bus, &mut said);
            }
            continue;
        }
        match token {
            "sleep" => bus.rigs[0].sleep(bus.t),
            "wake" => bus.rigs[0].wake(bus.t),
            "?" => {
                let [buf, con, con2, _, stat] = bus.rigs[0].regs(bus.t);
                said.push(format!("{} con={con:02X} con2={con2:02X} stat={stat:02X} buf={buf:02X}", bus.t));
            }
            "c0" | "c1" => bus.hand[0] = !level(token),
            "d0" | "d1" => bus.hand[1] = !level(token),
            _ => {
                let (name, value) = token.split_once('=').unwrap_or_else(|| panic!("{token}?"));
                bus.write(0, register(name), u8::from_str_radix(value, 16).expect("a byte"));
            }
        }
        bus.settle();
        note(&bus, &mut said);
    }
    said.join(", ")
}

#[test]
fn i2c_cases() {
    let mut wrong = Vec::new();
    for [what, script, expected] in rows(I2C) {
        let (kind, what) = what.split_once(": ").expect("a kind");
        let said = i2c(kind, script);
        if said != expected {
            wrong.push(format!("{what}\n  expected {expected}\n  but      {said}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn reset_gives_all_back() {
    let mut bench = TestBench::new(Pic16Ssp::new(true));
    for (reg, value) in [(Sfr::SSPCON, 0x20), (Sfr::SSPCON2, 0xFF), (Sfr::SSPADD, 0x12), (Sfr::SSPBUF, 0x34)] {
        bench.write(reg, value, 4);
    }
    let mut out = Vec::new();
    bench.port.reset(false, 8, &mut out);
    assert_eq!(bench.regs(8), [0x34, 0, 0, 0, 0]);
    assert_eq!((out.len(), bench.port.next_deadline()), (2, emu_core::NEVER), "{out:?}");
    bench.port.reset(true, 12, &mut out);
    assert_eq!(bench.regs(12), [0; 5]);
}

#[test]
fn only_what_stays_is_promised_to_stay() {
    let mut bench = TestBench::new(Pic16Ssp::new(true));
    bench.write(Sfr::SSPCON, 0x20, 4);
    assert_eq!(bench.port.steady_until(Sfr::SSPBUF, 4), emu_core::NEVER);
    bench.write(Sfr::SSPBUF, 0x55, 8);
    assert_eq!(
        (bench.port.steady_until(Sfr::SSPSTAT, 8), bench.port.steady_until(Sfr::SSPADD, 8)),
        (10, emu_core::NEVER)
    );
    (9..=44).for_each(|t| bench.tick(t));
    // A read of a full SSPBUF clears BF.
    assert_eq!(
        (bench.port.steady_until(Sfr::SSPBUF, 44), bench.port.steady_until(Sfr::SSPSTAT, 44)),
        (44, emu_core::NEVER)
    );
    bench.write(Sfr::SSPCON, 0x23, 48);
    bench.write(Sfr::SSPBUF, 0x55, 48);
    assert_eq!(
        (bench.port.steady_until(Sfr::SSPSTAT, 48), bench.port.next_deadline()),
        (48, emu_core::NEVER),
        "timer 2 may come"
    );
}
