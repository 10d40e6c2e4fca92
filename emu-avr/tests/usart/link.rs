//! Two ports that are connected to each other.

use emu_avr::periph::spi::{self, AvrSpi};
use emu_avr::periph::usart::{AvrUsart, RXC, RXEN, TXB8, TXEN, U2X, UCSZ2, UDRE, UsartRegister};
use emu_avr::periph::{AvrDrive, AvrLine, AvrSignal, Device};
use emu_core::rng::Rng;

/// Number of words sent.
const WORDS: usize = 40;

/// Configuration of a port: UCSRA, UCSRB, UCSRC, UBRR.
type Setup = (u8, u8, u8, u16);

fn set_up(port: &mut AvrUsart, (a, b, c, ubrr): Setup, out: &mut Vec<AvrSignal>) {
    port.on_line_changed(AvrLine::Rxd, true, 0, out);
    let [high, low] = ubrr.to_be_bytes();
    for (reg, value) in [
        (UsartRegister::UBRRH, high),
        (UsartRegister::UBRRL, low),
        (UsartRegister::UCSRA, a),
        (UsartRegister::UCSRC, c),
        (UsartRegister::UCSRB, b),
    ] {
        port.write(reg, value, 0xFF, 0, out);
    }
}

/// Passes the line changes of `from` at `t` to the other side.
fn carry(from: &mut Vec<AvrSignal>, to: &mut AvrUsart, t: u64, out: &mut Vec<AvrSignal>) {
    for signal in from.drain(..) {
        if let AvrSignal::Drive { t: at, line, drive: AvrDrive::Output(level) | AvrDrive::Value(level) } = signal {
            assert_eq!(at, t, "{signal:?} comes late");
            to.on_line_changed(if line == AvrLine::Txd { AvrLine::Rxd } else { line }, level, t, out);
        }
    }
}

/// Sends words from one port to the other; returns the words sent, and the words received with their errors.
/// `gives` is the index of the port that has XCK as an output.
fn talk(setups: [Setup; 2], gives: usize, seed: u64) -> (Vec<u16>, Vec<(u16, u8)>) {
    let rng = &mut Rng::new(seed);
    let (mut a, mut b, mut of_a, mut of_b) = (AvrUsart::new(0), AvrUsart::new(0), Vec::new(), Vec::new());
    [&mut a, &mut b][gives].on_direction_changed(AvrLine::Xck, true, 0, &mut of_a);
    set_up(&mut a, setups[0], &mut of_a);
    set_up(&mut b, setups[1], &mut of_b);
    carry(&mut of_a, &mut b, 0, &mut of_b);
    of_b.clear();
    let (mut sent, mut got, mut t, mut idle) = (Vec::new(), Vec::new(), 0, 8);
    while got.len() < WORDS && t < 4_000_000 {
        t = a.next_deadline().min(b.next_deadline()).min(t + 1 + rng.below(4)).max(t + 1);
        a.run_due(t, &mut of_a);
        b.run_due(t, &mut of_b);
        carry(&mut of_a, &mut b, t, &mut of_b);
        carry(&mut of_b, &mut a, t, &mut of_a);
        idle -= 1;
        if idle == 0 {
            idle = 4 + rng.below(60);
            if a.peek(UsartRegister::UCSRA, t) & UDRE != 0 && sent.len() < WORDS {
                let nine = setups[0].1 & UCSZ2 != 0;
                let word = rng.next_u64() as u16 & if nine { 0x1FF } else { 0xFF };
                let ninth = if word > 0xFF { TXB8 } else { 0 };
                a.write(UsartRegister::UCSRB, setups[0].1 | ninth, 0xFF, t, &mut of_a);
                a.write(UsartRegister::UDR, word as u8, 0xFF, t, &mut of_a);
                sent.push(word);
            }
        }
        let status = b.peek(UsartRegister::UCSRA, t);
        if status & RXC != 0 && rng.one_in(3) {
            let ninth = b.peek(UsartRegister::UCSRB, t) >> 1 & 1;
            got.push((u16::from(b.read(UsartRegister::UDR, t, &mut of_b)) | u16::from(ninth) << 8, status & 0x1C));
        }
        carry(&mut of_a, &mut b, t, &mut of_b);
        carry(&mut of_b, &mut a, t, &mut of_a);
        of_a.clear();
    }
    (sent, got)
}

fn all_arrive(setups: [Setup; 2], gives: usize) {
    let (sent, got) = talk(setups, gives, 7);
    let ought: Vec<_> = sent.iter().map(|&word| (word, 0)).collect();
    assert_eq!(sent.len(), WORDS);
    assert_eq!(got, ought, "{setups:02X?}");
}

#[test]
fn asynchronous() {
    for u2x in [0, U2X] {
        for c in [0x06, 0x26, 0x36, 0x0E] {
            // Off by 3 % and, at double speed, by 1.5 % (table 20-3).
            let near = if u2x == 0 { 32 } else { 66 };
            for ubrr in [[0, 0], [1, 1], [6, 6], [near, near + 1], [near + 1, near], [300, 300]] {
                all_arrive([(u2x, TXEN, c, ubrr[0]), (u2x, RXEN, c, ubrr[1])], 0);
                all_arrive([(u2x, TXEN | UCSZ2, c, ubrr[0]), (u2x, RXEN | UCSZ2, c, ubrr[1])], 0);
            }
        }
    }
    // A double-speed bit of eight periods equals a bit of sixteen periods of half the length.
    all_arrive([(U2X, TXEN, 6, 9), (0, RXEN, 6, 4)], 0);
}

#[test]
fn eight_percent_off_is_too_much() {
    let (sent, got) = talk([(0, TXEN, 6, 24), (0, RXEN, 6, 26)], 0, 7);
    assert_ne!(got, sent.iter().map(|&word| (word, 0)).collect::<Vec<_>>());
}

#[test]
fn parity_of_the_wrong_kind_is_reported() {
    let (_, got) = talk([(0, TXEN, 0x26, 2), (0, RXEN, 0x36, 2)], 0, 7);
    assert!(got.len() == WORDS && got.iter().all(|word| word.1 == 4), "{got:?}");
}

#[test]
fn synchronous() {
    // A slave needs more than four cycles per bit.
    for ubrr in [2, 3, 11] {
        for c in [0x46, 0x47, 0x6F] {
            for gives in [0, 1] {
                all_arrive([(0, TXEN, c, ubrr), (0, RXEN, c, ubrr)], gives);
                all_arrive([(0, TXEN | UCSZ2, c, ubrr), (0, RXEN | UCSZ2, c, ubrr)], gives);
            }
        }
    }
}

#[test]
fn a_slave_of_spi_follows_the_master_spi_mode() {
    // UCSRC with UCPHA and UCPOL, and the SPCR of the slave with CPHA and CPOL, in both bit orders.
    for (c, spcr) in [(0xC0, 0x40), (0xC2, 0x44), (0xC1, 0x48), (0xC3, 0x4C), (0xC4, 0x60), (0xC7, 0x6C)] {
        let (mut master, mut slave) = (AvrUsart::new(0), AvrSpi::new());
        let (mut of_master, mut of_slave) = (Vec::new(), Vec::new());
        master.on_direction_changed(AvrLine::Xck, true, 0, &mut of_master);
        set_up(&mut master, (0, RXEN | TXEN, c, 1), &mut of_master);
        slave.on_line_changed(AvrLine::Ss, true, 0, &mut of_slave);
        slave.write(spi::SpiRegister::SPCR, spcr, 0xFF, 0, &mut of_slave);
        slave.write(spi::SpiRegister::SPDR, 0x5C, 0xFF, 0, &mut of_slave);
        for t in 0..80 {
            master.run_due(t, &mut of_master);
            slave.run_due(t, &mut of_slave);
            for signal in of_master.drain(..) {
                if let AvrSignal::Drive { line, drive: AvrDrive::Output(level) | AvrDrive::Value(level), .. } = signal {
                    slave.on_line_changed(
                        if line == AvrLine::Txd { AvrLine::Mosi } else { AvrLine::Sck },
                        level,
                        t,
                        &mut of_slave,
                    );
                }
            }
            match t {
                5 => slave.on_line_changed(AvrLine::Ss, false, t, &mut of_slave),
                10 => master.write(UsartRegister::UDR, 0xB2, 0xFF, t, &mut of_master),
                _ => {}
            }
            for signal in of_slave.drain(..) {
                if let AvrSignal::Drive { line: AvrLine::Miso, drive: AvrDrive::Value(level), .. } = signal {
                    master.on_line_changed(AvrLine::Rxd, level, t, &mut of_master);
                }
            }
        }
        let got = (
            master.peek(UsartRegister::UCSRA, 80) & RXC,
            master.peek(UsartRegister::UDR, 80),
            slave.peek(spi::SpiRegister::SPDR, 80),
        );
        assert_eq!(got, (RXC, 0x5C, 0xB2), "UCSRC {c:02X}");
    }
}
