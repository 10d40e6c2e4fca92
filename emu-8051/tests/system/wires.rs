//! Two machines connected by a wire in each direction, each with its own clock.

use emu_8051::Mcs51;
use emu_core::pins::{ChipEvent, CycleTime, PinLevel};
use emu_core::{Cpu, Probe};

use crate::source::{self, Program, pin};

/// 9600 baud at 11.0592 MHz, 96 cycles per bit, from timer 1 on one side and timer 2 on the other. Both send
/// the bytes from 30h on and store received bytes from 50h on; they poll the flags in turn.
const TEXT: &str = "\
== timer 1
chip 8051
      mov TMOD,#0x20
      mov TH1,#0xFD
      mov TL1,#0xFD
      mov SCON,#$1
      setb TR1
      $2
      mov R0,#0x30
      mov R1,#0x50
      mov R2,#16
      sjmp send
loop: jnb RI,out
      clr RI
      mov @R1,SBUF
      inc R1
out:  jnb TI,loop
      cjne R2,#0,more
      sjmp loop
more: clr TI
send: mov SBUF,@R0
      inc R0
      dec R2
      sjmp loop
-- {0x50|nop} x
-- {0xD8|nop} x
-- {0x50|mov PCON,#0x80} x
== timer 2
chip 8052
      mov RCAP2L,#0xDC
      mov RCAP2H,#0xFF
      mov TL2,#0xDC
      mov TH2,#0xFF
      mov SCON,#$1
      mov T2CON,#0x34
      $2
      mov R0,#0x30
      mov R1,#0x50
      mov R2,#16
      sjmp send
loop: jnb RI,out
      clr RI
      mov @R1,SBUF
      inc R1
out:  jnb TI,loop
      cjne R2,#0,more
      sjmp loop
more: clr TI
send: mov SBUF,@R0
      inc R0
      dec R2
      sjmp loop
-- {0x50|nop} x
-- {0xD8|nop} x
";

#[derive(Default)]
struct Edges(Vec<(u64, PinLevel)>);

impl Probe for Edges {
    const EVENTS: bool = true;
    fn on_event(&mut self, event: ChipEvent) -> bool {
        match event {
            ChipEvent::Edge { at, pin: on, level } if Some(on) == pin("P3.1") => self.0.push((at.cycle, level)),
            _ => {}
        }
        false
    }
}

/// Runs both for `cycles` of the first machine. The clock of the second one has `rate` ticks per million
/// ticks of the first one. An edge takes 40 cycles over the wire, so that it is known before the other
/// machine samples it.
fn talk(a: &mut Mcs51, b: &mut Mcs51, cycles: u64, rate: u64) {
    const DELAY: u64 = 40;
    const SLICE: u64 = 20;
    let rxd = pin("P3.0").expect("a pin");
    let (mut from_a, mut from_b) = (Edges::default(), Edges::default());
    for until in (SLICE..=cycles).step_by(SLICE as usize) {
        a.run(until, &mut from_a);
        b.run(until * rate / 1_000_000, &mut from_b);
        for (cycle, level) in from_a.0.drain(..) {
            b.drive(CycleTime::at((cycle + DELAY) * rate / 1_000_000), rxd, level);
        }
        for (cycle, level) in from_b.0.drain(..) {
            a.drive(CycleTime::at(cycle * 1_000_000 / rate + DELAY), rxd, level);
        }
    }
}

fn fill(mcs51: &mut Mcs51, seed: u8) -> Vec<u8> {
    let bytes: Vec<u8> = (0..16).map(|i: u8| i.wrapping_mul(0x3B) ^ seed).collect();
    for (i, &byte) in bytes.iter().enumerate() {
        assert!(mcs51.poke("idata", 0x30 + i as u32, byte));
    }
    bytes
}

/// The programs of a text.
fn programs(text: &str) -> Vec<Program> {
    source::texts(text).iter().map(|(name, text, _)| source::program(name, text).0).collect()
}

fn received(mcs51: &Mcs51) -> Vec<u8> {
    let end = mcs51.reg("r1").expect("a register");
    (0x50..end).filter_map(|addr| mcs51.peek("idata", addr)).collect()
}

#[test]
fn two_machines_talk_both_ways() {
    let cases = programs(TEXT);
    let [timer1, nine1, double, timer2, nine2] = &cases[..] else { panic!("five programs") };
    // Programs, the second one's clock in millionths, and whether all bytes arrive. Half a bit in the tenth
    // (or eleventh) is five percent; the sampling takes a sixteenth of a bit of that.
    let table = [
        (timer1, timer1, 1_000_000, true),
        (timer1, timer2, 1_000_000, true),
        (timer2, timer2, 1_000_000, true),
        (nine1, nine2, 1_000_000, true),
        (timer1, timer2, 1_020_000, true),
        (timer1, timer2, 980_000, true),
        (timer2, timer1, 1_035_000, true),
        (nine2, nine1, 970_000, true),
        (timer1, timer2, 1_120_000, false),
        (timer1, timer2, 880_000, false),
        (timer1, double, 1_000_000, false),
        (double, double, 1_000_000, true),
        (double, timer1, 2_000_000, true),
    ];
    for (one, other, rate, whole) in table {
        let what = format!("{} with {} at {rate}", one.name, other.name);
        let (mut a, mut b) = (one.machine(), other.machine());
        let (from_a, from_b) = (fill(&mut a, 0x41), fill(&mut b, 0xA6));
        talk(&mut a, &mut b, 20_000, rate);
        let (at_a, at_b) = (received(&a), received(&b));
        assert_eq!(at_a == from_b, whole, "{what}: {from_b:02x?} came as {at_a:02x?}");
        assert_eq!(at_b == from_a, whole, "{what}: {from_a:02x?} came as {at_b:02x?}");
    }
}

/// One master and two slaves in mode 3: only the slave that is addressed clears SM2 and receives the bytes
/// after its address (user's manual, "Multiprocessor communications").
#[test]
fn a_master_calls_one_of_two() {
    let text = "\
== master
chip 8052
      mov TMOD,#0x20
      mov TH1,#0xFD
      mov TL1,#0xFD
      mov SCON,#0xC8
      setb TR1
      mov SBUF,#2
s1:   jnb TI,s1
      clr TI
      clr TB8
      mov SBUF,#0x77
s2:   jnb TI,s2
      clr TI
      mov SBUF,#0x78
s3:   jnb TI,s3
      clr TI
      setb TB8
      mov SBUF,#1
s4:   jnb TI,s4
      clr TI
      clr TB8
      mov SBUF,#0x99
      sjmp $
-- x
== another
chip 8052
      mov TMOD,#0x20
      mov TH1,#0xFD
      mov TL1,#0xFD
      mov SCON,#0xF0
      setb TR1
      mov R1,#0x50
wait: jnb RI,wait
      mov A,SBUF
      jnb RB8,data
      setb SM2
      cjne A,#$1,data
      clr SM2
data: mov @R1,A
      inc R1
      clr RI
      sjmp wait
-- {1} x
-- {2} x
";
    let cases = programs(text);
    for (other, wanted) in [(1, vec![0x02, 0x01, 0x99]), (2, vec![0x02, 0x77, 0x78, 0x01])] {
        let (mut master, mut b) = (cases[0].machine(), cases[other].machine());
        talk(&mut master, &mut b, 8000, 1_003_000);
        assert_eq!(received(&b), wanted, "{}", cases[other].name);
    }
}
