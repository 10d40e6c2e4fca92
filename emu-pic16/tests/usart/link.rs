//! Two ports that are connected to each other.

use emu_core::rng::Rng;
use emu_pic16::periph::map::{Pic16Line, Sfr};
use emu_pic16::periph::usart::{ADDEN, BRGH, CREN, CSRC, Pic16Usart, RX9, SPEN, SYNC, TX9, TX9D, TXEN};
use emu_pic16::periph::{Device, Pic16Drive, Pic16Signal};

/// Number of words sent.
const WORDS: usize = 40;

/// Passes the line changes of `from` at `t` to the other side.
fn carry(
    from: &mut Vec<Pic16Signal>,
    lines: &[(Pic16Line, Pic16Line)],
    to: &mut Pic16Usart,
    t: u64,
    out: &mut Vec<Pic16Signal>,
) {
    for signal in from.drain(..) {
        if let Pic16Signal::Drive { t: at, line, drive } = signal {
            assert_eq!(at, t, "{signal:?} comes late");
            for &(_, end) in lines.iter().filter(|wire| wire.0 == line) {
                to.on_line_changed(end, drive != Pic16Drive::Low, t, out);
            }
        }
    }
}

/// Sends words from one port to the other; returns the expected words and the received ones, with FERR and
/// RX9D.
fn talk(txsta: [u8; 2], rcsta: [u8; 2], spbrg: [u8; 2], seed: u64) -> (Vec<u16>, Vec<(u16, bool)>) {
    let rng = &mut Rng::new(seed);
    let (mut a, mut b, mut of_a, mut of_b) = (Pic16Usart::new(), Pic16Usart::new(), Vec::new(), Vec::new());
    let lines: &[(Pic16Line, Pic16Line)] = if txsta[0] & SYNC != 0 {
        &[(Pic16Line::Tx, Pic16Line::Tx), (Pic16Line::Rx, Pic16Line::Rx)]
    } else {
        &[(Pic16Line::Tx, Pic16Line::Rx)]
    };
    b.on_line_changed(Pic16Line::Rx, true, 0, &mut of_b);
    for n in 0..2 {
        let (port, out) = if n == 0 { (&mut a, &mut of_a) } else { (&mut b, &mut of_b) };
        port.write(Sfr::SPBRG, spbrg[n], 0xFF, 0, out);
        port.write(Sfr::TXSTA, txsta[n], 0xFF, 0, out);
        port.write(Sfr::RCSTA, rcsta[n], 0xFF, 0, out);
    }
    carry(&mut of_a, lines, &mut b, 0, &mut of_b);
    let (mut sent, mut got, mut t, mut idle) = (Vec::new(), Vec::new(), 0, 8);
    while got.len() < WORDS && t < 1_500_000 {
        let next = a.next_deadline().min(b.next_deadline()).min(t / 4 * 4 + 4);
        assert!(next > t, "clock {t}");
        t = next;
        a.run_due(t, &mut of_a);
        b.run_due(t, &mut of_b);
        if t % 4 == 0 {
            idle -= 1;
            if idle == 0 {
                idle = 4 + rng.below(60);
                if a.txif(t) && sent.len() < WORDS {
                    let word = rng.next_u64() as u16 & if txsta[0] & TX9 != 0 { 0x1FF } else { 0xFF };
                    let ninth = if word > 0xFF { TX9D } else { 0 };
                    a.write(Sfr::TXSTA, txsta[0] | ninth, 0xFF, t, &mut of_a);
                    a.write(Sfr::TXREG, word as u8, 0xFF, t, &mut of_a);
                    sent.push(word);
                }
            }
            if b.rcif() && rng.one_in(3) {
                let status = b.peek(Sfr::RCSTA, t);
                let word = u16::from(b.read(Sfr::RCREG, t, &mut of_b)) | u16::from(status & 1) << 8;
                got.push((word, status & 4 != 0));
            }
        }
        carry(&mut of_a, lines, &mut b, t, &mut of_b);
        of_b.clear();
    }
    (sent, got)
}

fn all_arrive(txsta: [u8; 2], rcsta: [u8; 2], spbrg: [u8; 2]) {
    let (sent, got) = talk(txsta, rcsta, spbrg, 7);
    let ought: Vec<_> = sent.iter().map(|&word| (word, false)).collect();
    assert_eq!(sent.len(), WORDS);
    assert_eq!(got, ought, "{txsta:02X?} {rcsta:02X?} {spbrg:?}");
}

#[test]
fn asynchronous() {
    let on = [SPEN, SPEN | CREN];
    let nine = [SPEN, SPEN | CREN | RX9];
    for brgh in [0, BRGH] {
        for spbrg in [[0, 0], [1, 1], [6, 6], [32, 33], [33, 32], [32, 32]] {
            all_arrive([TXEN | brgh, brgh], on, spbrg);
            all_arrive([TXEN | TX9 | brgh, brgh], nine, spbrg);
        }
    }
    // Four periods of one are sixteen of a quarter of its length.
    all_arrive([TXEN | BRGH, 0], on, [19, 4]);
}

#[test]
fn eight_percent_off_is_too_much() {
    let (sent, got) = talk([TXEN | BRGH, BRGH], [SPEN, SPEN | CREN], [24, 26], 7);
    assert_ne!(got, sent.iter().map(|&word| (word, false)).collect::<Vec<_>>());
}

#[test]
fn synchronous() {
    for spbrg in [0, 1, 5] {
        all_arrive([SYNC | CSRC | TXEN, SYNC], [SPEN, SPEN | CREN], [spbrg, 0]);
        all_arrive([SYNC | CSRC | TXEN | TX9, SYNC], [SPEN, SPEN | CREN | RX9], [spbrg, 0]);
    }
}

#[test]
fn addresses_alone_arrive() {
    let (sent, got) = {
        let rcsta = [SPEN, SPEN | CREN | RX9 | ADDEN];
        talk([TXEN | TX9 | BRGH, BRGH], rcsta, [1, 1], 3)
    };
    let ought: Vec<_> = sent.iter().filter(|&&word| word > 0xFF).map(|&word| (word, false)).collect();
    assert!(ought.len() > 10);
    assert_eq!(got, ought);
}
