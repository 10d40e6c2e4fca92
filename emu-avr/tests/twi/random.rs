//! Random programs on two interfaces that share a bus, each compared with its model in every cycle.

use emu_avr::periph::twi::TwiRegister;
use emu_core::rng::Rng;

use crate::bus::{Node, Wires};

/// Counts of each status, by TWSR<7:3>.
type Seen = [u64; 32];

/// The software: usually responds to TWINT, sometimes does something else.
fn act(node: &mut Node, t: u64, rng: &mut Rng, seen: &mut Seen) {
    let any = rng.next_u64() as u8;
    if node.asleep {
        if node.model.requests() != 0 || rng.one_in(6) {
            node.wake(t);
        }
        return;
    }
    if rng.one_in(80) {
        return node.sleep(t);
    }
    let control = node.model.peek(TwiRegister::TWCR);
    if control & 0x80 != 0 && rng.below(8) != 0 {
        let status = node.model.peek(TwiRegister::TWSR);
        seen[usize::from(status >> 3)] += 1;
        if rng.below(3) != 0 {
            // The address of the other interface, of this one, the general call, or any; often the same in
            // both.
            let sla = [0x20, 0x21, 0x20, 0x21, 0x00, 0x01, any][rng.below(7) as usize];
            node.write(TwiRegister::TWDR, if matches!(status >> 3, 1 | 2) { sla } else { any }, t);
        }
        let stop = if rng.one_in(5) { 0x10 } else { 0 };
        let start = if rng.one_in(4) { 0x20 } else { 0 };
        let ack = if rng.below(4) != 0 { 0x40 } else { 0 };
        node.write(TwiRegister::TWCR, 0x84 | any & 1 | stop | start | ack, t);
        return;
    }
    match rng.below(60) {
        0 => node.write(TwiRegister::TWCR, any, t),
        1 => node.write(TwiRegister::TWDR, any, t),
        2 => node.write(TwiRegister::TWBR, rng.below(6) as u8, t),
        3 => node.write(TwiRegister::TWSR, any & 1, t),
        4 => node.write(TwiRegister::TWAR, 0x20 | any & 1, t),
        5 => node.write(TwiRegister::TWAMR, any & any >> 2 & 0x1E, t),
        6 if rng.one_in(8) => node.reset(t),
        7..20 if control & 0x20 == 0 => node.write(TwiRegister::TWCR, control & 0x45 | 0x24, t),
        20..26 => node.write(TwiRegister::TWCR, control & 0x25 | 0x44, t),
        _ => {}
    }
}

fn compare(seed: u64, clocks: u64, seen: &mut Seen) {
    let rng = &mut Rng::new(seed);
    let ctx = format!("seed {seed}");
    let mut nodes = [Node::new(), Node::new()];
    let mut wires = Wires::default();
    let noisy = rng.one_in(4);
    wires.settle(&mut nodes, 0, &ctx);
    for node in &mut nodes {
        node.write(TwiRegister::TWBR, (rng.below(3) * rng.below(3)) as u8, 0);
        node.write(TwiRegister::TWAR, [0x20, 0x21, 0x30, 0x31][rng.below(4) as usize], 0);
        node.write(TwiRegister::TWCR, if rng.one_in(2) { 0x44 } else { 0x64 }, 0);
    }
    wires.settle(&mut nodes, 0, &ctx);
    let together = rng.one_in(3);
    let mut quiet = [3; 2];
    for t in 1..clocks {
        for (node, quiet) in nodes.iter_mut().zip(&mut quiet) {
            node.tick(t);
            *quiet -= 1;
            if *quiet == 0 {
                act(node, t, rng, seen);
                *quiet = if together { 20 } else { 1 + rng.below(30) };
            }
        }
        if noisy && rng.one_in(25) {
            let wire = rng.below(2) as usize;
            wires.pulled[wire] = !wires.pulled[wire] && rng.one_in(4);
        }
        wires.settle(&mut nodes, t, &ctx);
    }
}

#[test]
fn agrees_with_the_model() {
    let lives = if cfg!(debug_assertions) { 1_000 } else { 100_000 };
    let mut seen = [0; 32];
    for seed in 0..lives {
        compare(seed, 150 + seed % 9 * 50, &mut seen);
    }
    // Each status of tables 22-2 to 22-6.
    let rare: Vec<_> = [
        0x00, 0x08, 0x10, 0x18, 0x20, 0x28, 0x30, 0x38, 0x40, 0x48, 0x50, 0x58, 0x60, 0x68, 0x70, 0x78, 0x80, 0x88,
        0x90, 0x98, 0xA0, 0xA8, 0xB0, 0xB8, 0xC0, 0xC8,
    ]
    .into_iter()
    .map(|status| (status, seen[status >> 3]))
    .filter(|&(_, n)| n < lives / 5000)
    .collect();
    assert!(rare.is_empty(), "{rare:02X?} of {seen:?}");
}
