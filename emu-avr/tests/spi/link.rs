//! A master and a slave that are connected to each other.

use emu_avr::periph::spi::{AvrSpi, CPHA, CPOL, DORD, MSTR, SPE, SPIF, SpiRegister};
use emu_avr::periph::{AvrDrive, AvrLine, AvrSignal, Device};
use emu_core::rng::Rng;

/// Passes the line changes of `from` at `t` to the other side.
fn carry(from: &mut Vec<AvrSignal>, to: &mut AvrSpi, t: u64, out: &mut Vec<AvrSignal>) {
    for signal in from.drain(..) {
        if let AvrSignal::Drive { t: at, line, drive: AvrDrive::Value(level) } = signal {
            assert_eq!(at, t, "{signal:?} comes late");
            to.on_line_changed(line, level, t, out);
        }
    }
}

/// Exchanges bytes in both directions; returns the bytes that each side sent, then those that each received.
fn exchange(modes: [u8; 2], rate: u8, double: u8) -> [Vec<u8>; 4] {
    let rng = &mut Rng::new(5);
    let (mut a, mut b, mut of_a, mut of_b) = (AvrSpi::new(), AvrSpi::new(), Vec::new(), Vec::new());
    a.on_line_changed(AvrLine::Ss, true, 0, &mut of_a);
    a.write(SpiRegister::SPCR, SPE | MSTR | modes[0] | rate, 0xFF, 0, &mut of_a);
    a.write(SpiRegister::SPSR, double, 0xFF, 0, &mut of_a);
    b.on_line_changed(AvrLine::Ss, true, 0, &mut of_b);
    b.write(SpiRegister::SPCR, SPE | modes[1], 0xFF, 0, &mut of_b);
    carry(&mut of_a, &mut b, 0, &mut of_b);
    carry(&mut of_b, &mut a, 0, &mut of_a);
    let [mut sent, mut answers, mut got, mut replies]: [Vec<u8>; 4] = Default::default();
    let mut t = 10;
    b.on_line_changed(AvrLine::Ss, false, t, &mut of_b);
    while got.len() < 30 {
        let bytes = [rng.next_u64() as u8, rng.next_u64() as u8];
        b.write(SpiRegister::SPDR, bytes[1], 0xFF, t, &mut of_b);
        carry(&mut of_b, &mut a, t, &mut of_a);
        t += 1 + rng.below(5);
        a.write(SpiRegister::SPDR, bytes[0], 0xFF, t, &mut of_a);
        sent.push(bytes[0]);
        answers.push(bytes[1]);
        carry(&mut of_a, &mut b, t, &mut of_b);
        // A byte at the slowest clock takes 1024 cycles.
        let end = t + 1100;
        while t < end && (a.peek(SpiRegister::SPSR, t) & b.peek(SpiRegister::SPSR, t)) & SPIF == 0 {
            t = a.next_deadline().min(b.next_deadline()).min(end);
            a.run_due(t, &mut of_a);
            b.run_due(t, &mut of_b);
            carry(&mut of_a, &mut b, t, &mut of_b);
            carry(&mut of_b, &mut a, t, &mut of_a);
        }
        for (part, out, list) in [(&mut a, &mut of_a, &mut replies), (&mut b, &mut of_b, &mut got)] {
            part.read(SpiRegister::SPSR, t, out);
            list.push(part.read(SpiRegister::SPDR, t, out));
            assert_eq!(part.peek(SpiRegister::SPSR, t) & SPIF, 0);
        }
        t += 1;
    }
    [sent, answers, got, replies]
}

#[test]
fn bytes_go_both_ways_in_every_mode_down_to_four_cycles_a_bit() {
    for mode in [0, CPHA, CPOL, CPOL | CPHA] {
        for order in [0, DORD] {
            for (rate, double) in [(0, 0), (1, 1), (1, 0), (2, 1), (3, 0)] {
                let [sent, answers, got, replies] = exchange([mode | order; 2], rate, double);
                assert_eq!((got, replies), (sent, answers), "{mode:02X} {order:02X} {rate} {double}");
            }
        }
    }
}

#[test]
fn another_phase_or_order_does_not_fit() {
    for other in [CPHA, DORD] {
        let [sent, answers, got, replies] = exchange([0, other], 1, 0);
        assert_ne!((got, replies), (sent, answers), "{other:02X}");
    }
}
