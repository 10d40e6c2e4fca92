//! Ports that communicate on one bus.

use emu_pic16::periph::map::{InterruptFlag, Sfr};
use emu_pic16::periph::ssp::Pic16Ssp;

use crate::bus::Bus;

const MASTER: usize = 0;
const SLAVE: usize = 1;
const LIMIT: u64 = 2_000;

/// Returns a master with TBRG = 20 clocks, and a slave.
fn bus(slave_con: u8, slave_add: u8, stretch: bool) -> Bus {
    let mut bus = Bus::new(vec![Pic16Ssp::new(true), Pic16Ssp::new(true).with_stretch(stretch)]);
    bus.to(4);
    bus.write(MASTER, Sfr::SSPADD, 9);
    bus.write(MASTER, Sfr::SSPCON, 0x28);
    bus.write(SLAVE, Sfr::SSPADD, slave_add);
    bus.write(SLAVE, Sfr::SSPCON, slave_con);
    bus
}

/// Makes the master execute a command to its end; returns the clocks it took.
fn master(bus: &mut Bus, reg: Sfr, value: u8) -> u64 {
    let from = bus.t;
    bus.write(MASTER, reg, value);
    bus.until_flag(MASTER, LIMIT);
    assert_eq!(bus.rigs[MASTER].flags.last().map(|f| f.1), Some(InterruptFlag::SSPIF), "{reg:?} {value:02X} at {from}");
    bus.rigs[MASTER].flags.last().map_or(0, |f| f.0) - from
}

/// SEN, RSEN, PEN, RCEN, and ACKEN with 0 and with 1.
const START: u8 = 0x01;
const AGAIN: u8 = 0x02;
const STOP: u8 = 0x04;
const RECEIVE: u8 = 0x08;
const ACK: u8 = 0x10;
const NACK: u8 = 0x30;

fn refused(bus: &Bus) -> bool {
    bus.peek(MASTER, Sfr::SSPCON2) & 0x40 != 0
}

/// Returns SSPSTAT of the slave without its upper two bits.
fn stat(bus: &Bus) -> u8 {
    bus.peek(SLAVE, Sfr::SSPSTAT) & 0x3F
}

#[test]
fn a_write_then_a_read() {
    let mut bus = bus(0x36, 0x50, false);
    assert_eq!(master(&mut bus, Sfr::SSPCON2, START), 40, "two TBRG");
    assert_eq!(master(&mut bus, Sfr::SSPBUF, 0x50), 18 * 20, "18 TBRG");
    assert!(!refused(&bus));
    // State 1 of the slave: a write, the last byte was an address. S, BF.
    assert_eq!((stat(&bus), bus.read(SLAVE, Sfr::SSPBUF)), (0x09, 0x50));
    master(&mut bus, Sfr::SSPBUF, 0xC3);
    assert!(!refused(&bus));
    // State 2: the last byte was data. D/A, S, BF.
    assert_eq!((stat(&bus), bus.read(SLAVE, Sfr::SSPBUF)), (0x29, 0xC3));
    assert_eq!(master(&mut bus, Sfr::SSPCON2, AGAIN), 60, "three TBRG");
    master(&mut bus, Sfr::SSPBUF, 0x51);
    assert!(!refused(&bus));
    // State 3: a read. S, R/W; BF is clear, and the clock is held.
    assert_eq!((stat(&bus), bus.peek(SLAVE, Sfr::SSPCON)), (0x0C, 0x26));
    bus.write(MASTER, Sfr::SSPCON2, RECEIVE);
    bus.to(bus.t + 400);
    assert!(!bus.wires[0], "held");
    bus.write(SLAVE, Sfr::SSPBUF, 0x9A);
    assert_eq!(stat(&bus), 0x0D);
    bus.write(SLAVE, Sfr::SSPBUF, 0x77);
    assert_eq!(bus.peek(SLAVE, Sfr::SSPCON), 0xA6, "WCOL");
    let from = bus.t;
    bus.write(SLAVE, Sfr::SSPCON, 0x36);
    bus.until_flag(MASTER, LIMIT);
    // The clock was released at once; 8 high times and 7 low ones remain.
    assert_eq!(bus.rigs[MASTER].flags.last(), Some(&(from + 15 * 20, InterruptFlag::SSPIF)));
    assert_eq!(bus.read(MASTER, Sfr::SSPBUF), 0x9A);
    assert_eq!(master(&mut bus, Sfr::SSPCON2, ACK), 40, "two TBRG");
    // State 4: data was sent and more is requested. D/A, S, R/W.
    assert_eq!((stat(&bus), bus.peek(SLAVE, Sfr::SSPCON)), (0x2C, 0x26));
    bus.write(SLAVE, Sfr::SSPBUF, 0x3C);
    bus.write(SLAVE, Sfr::SSPCON, 0x36);
    master(&mut bus, Sfr::SSPCON2, RECEIVE);
    assert_eq!(bus.read(MASTER, Sfr::SSPBUF), 0x3C);
    let flags = bus.rigs[SLAVE].flags.len();
    master(&mut bus, Sfr::SSPCON2, NACK);
    // State 5: no acknowledge. D/A, S; the clock is not held.
    assert_eq!((stat(&bus), bus.peek(SLAVE, Sfr::SSPCON), bus.rigs[SLAVE].flags.len()), (0x28, 0x36, flags + 1));
    assert_eq!(master(&mut bus, Sfr::SSPCON2, STOP), 60, "three TBRG");
    assert_eq!((stat(&bus), bus.wires), (0x30, [true, true]));
}

#[test]
fn bytes_that_are_not_taken() {
    let mut bus = bus(0x36, 0x50, false);
    master(&mut bus, Sfr::SSPCON2, START);
    master(&mut bus, Sfr::SSPBUF, 0x52);
    assert!(refused(&bus), "another address");
    assert_eq!((stat(&bus), bus.rigs[SLAVE].flags.len()), (0x08, 0));
    master(&mut bus, Sfr::SSPCON2, AGAIN);
    master(&mut bus, Sfr::SSPBUF, 0x50);
    assert!(!refused(&bus));
    master(&mut bus, Sfr::SSPBUF, 0x11);
    assert!(refused(&bus), "SSPBUF holds the address");
    assert_eq!((bus.peek(SLAVE, Sfr::SSPCON), bus.rigs[SLAVE].flags.len()), (0x76, 2));
    assert_eq!(bus.read(SLAVE, Sfr::SSPBUF), 0x50);
    master(&mut bus, Sfr::SSPBUF, 0x22);
    assert!(refused(&bus), "SSPOV is set");
    assert_eq!((bus.read(SLAVE, Sfr::SSPBUF), bus.rigs[SLAVE].flags.len()), (0x22, 3));
    bus.write(SLAVE, Sfr::SSPCON, 0x36);
    master(&mut bus, Sfr::SSPBUF, 0x33);
    assert!(!refused(&bus));
    assert_eq!(bus.read(SLAVE, Sfr::SSPBUF), 0x33);
}

#[test]
fn the_basic_port_keeps_sspbuf_while_sspov_is_set() {
    let mut bus = Bus::new(vec![Pic16Ssp::new(true), Pic16Ssp::new(false)]);
    bus.to(4);
    bus.write(MASTER, Sfr::SSPADD, 9);
    bus.write(MASTER, Sfr::SSPCON, 0x28);
    bus.write(SLAVE, Sfr::SSPADD, 0x50);
    bus.write(SLAVE, Sfr::SSPCON, 0x76);
    bus.write(SLAVE, Sfr::SSPBUF, 0x99);
    master(&mut bus, Sfr::SSPCON2, START);
    master(&mut bus, Sfr::SSPBUF, 0x50);
    assert!(refused(&bus));
    assert_eq!((stat(&bus), bus.peek(SLAVE, Sfr::SSPBUF), bus.rigs[SLAVE].flags.len()), (0x08, 0x99, 1));
}

#[test]
fn sen_stretches_after_received_bytes() {
    let mut bus = bus(0x36, 0x50, true);
    bus.write(SLAVE, Sfr::SSPCON2, 0x01);
    master(&mut bus, Sfr::SSPCON2, START);
    master(&mut bus, Sfr::SSPBUF, 0x50);
    assert_eq!(bus.peek(SLAVE, Sfr::SSPCON), 0x26);
    bus.write(MASTER, Sfr::SSPBUF, 0xA7);
    bus.to(bus.t + 1000);
    assert!(!bus.wires[0], "held");
    assert_eq!(bus.read(SLAVE, Sfr::SSPBUF), 0x50);
    bus.write(SLAVE, Sfr::SSPCON, 0x36);
    bus.until_flag(MASTER, LIMIT);
    assert!(!refused(&bus));
    assert_eq!((bus.read(SLAVE, Sfr::SSPBUF), bus.peek(SLAVE, Sfr::SSPCON)), (0xA7, 0x26));
}

#[test]
fn general_call() {
    for (con2, con, answers) in [(0x80, 0x36, true), (0x80, 0x37, true), (0, 0x36, false)] {
        let mut bus = bus(con, 0x50, false);
        bus.write(SLAVE, Sfr::SSPCON2, con2);
        master(&mut bus, Sfr::SSPCON2, START);
        master(&mut bus, Sfr::SSPBUF, 0x00);
        assert_eq!(!refused(&bus), answers, "{con2:02X} {con:02X}");
        assert_eq!(stat(&bus), if answers { 0x09 } else { 0x08 }, "no UA either");
        if answers {
            bus.read(SLAVE, Sfr::SSPBUF);
            master(&mut bus, Sfr::SSPBUF, 0x6B);
            assert_eq!((refused(&bus), bus.read(SLAVE, Sfr::SSPBUF)), (false, 0x6B));
        }
    }
}

#[test]
fn ten_bits() {
    let mut bus = bus(0x37, 0xF4, false);
    master(&mut bus, Sfr::SSPCON2, START);
    bus.write(MASTER, Sfr::SSPBUF, 0xF4);
    bus.until_flag(SLAVE, LIMIT);
    // S, UA, BF: the clock is held until the low byte is in SSPADD.
    assert_eq!((stat(&bus), bus.read(SLAVE, Sfr::SSPBUF)), (0x0B, 0xF4));
    bus.write(MASTER, Sfr::SSPBUF, 0x31);
    bus.to(bus.t + 500);
    assert!(!bus.wires[0], "held");
    bus.write(SLAVE, Sfr::SSPADD, 0x31);
    assert_eq!(stat(&bus), 0x08);
    bus.until_flag(MASTER, LIMIT);
    assert!(!refused(&bus));
    assert_eq!((stat(&bus), bus.read(SLAVE, Sfr::SSPBUF)), (0x0B, 0x31));
    bus.write(SLAVE, Sfr::SSPADD, 0xF4);
    master(&mut bus, Sfr::SSPBUF, 0x55);
    assert_eq!((stat(&bus), bus.read(SLAVE, Sfr::SSPBUF)), (0x29, 0x55));
    master(&mut bus, Sfr::SSPCON2, AGAIN);
    master(&mut bus, Sfr::SSPBUF, 0xF5);
    assert!(!refused(&bus), "a read, the address having matched before");
    assert_eq!((stat(&bus), bus.peek(SLAVE, Sfr::SSPCON)), (0x0C, 0x27));
    bus.write(SLAVE, Sfr::SSPBUF, 0xE1);
    bus.write(SLAVE, Sfr::SSPCON, 0x37);
    master(&mut bus, Sfr::SSPCON2, RECEIVE);
    assert_eq!(bus.read(MASTER, Sfr::SSPBUF), 0xE1);
    master(&mut bus, Sfr::SSPCON2, NACK);
    master(&mut bus, Sfr::SSPCON2, STOP);
    master(&mut bus, Sfr::SSPCON2, START);
    master(&mut bus, Sfr::SSPBUF, 0xF5);
    assert!(refused(&bus), "a read out of the blue");
}

#[test]
fn start_and_stop_interrupt_where_asked_for() {
    for (con, flags) in [(0x36, 0), (0x3E, 3), (0x3F, 3), (0x2B, 3)] {
        let mut bus = bus(con, 0x50, false);
        master(&mut bus, Sfr::SSPCON2, START);
        master(&mut bus, Sfr::SSPCON2, AGAIN);
        master(&mut bus, Sfr::SSPCON2, STOP);
        assert_eq!(bus.rigs[SLAVE].count(InterruptFlag::SSPIF), flags, "{con:02X}");
    }
}

/// Returns two masters and a slave; the second master counts `add` in TBRG.
fn masters(add: u8) -> Bus {
    let mut bus = Bus::new(vec![Pic16Ssp::new(true), Pic16Ssp::new(false), Pic16Ssp::new(true)]);
    bus.to(4);
    bus.write(SLAVE, Sfr::SSPADD, 0x50);
    bus.write(SLAVE, Sfr::SSPCON, 0x36);
    for (who, add) in [(MASTER, 9), (2, add)] {
        bus.write(who, Sfr::SSPADD, add);
        bus.write(who, Sfr::SSPCON, 0x28);
    }
    bus
}

#[test]
fn the_lower_address_wins() {
    for add in [2, 5, 8, 9, 10, 17, 60] {
        let mut bus = masters(add);
        bus.write(MASTER, Sfr::SSPCON2, START);
        bus.write(2, Sfr::SSPCON2, START);
        // Both complete the Start; the faster one waits for the other with SCL low.
        bus.to(bus.t + 1000);
        assert_eq!(
            (bus.rigs[MASTER].count(InterruptFlag::BCLIF), bus.rigs[2].count(InterruptFlag::BCLIF)),
            (0, 0),
            "{add}"
        );
        bus.write(MASTER, Sfr::SSPBUF, 0x50);
        bus.write(2, Sfr::SSPBUF, 0x54);
        bus.to(bus.t + 8000);
        assert_eq!(
            (bus.rigs[MASTER].count(InterruptFlag::BCLIF), bus.rigs[2].count(InterruptFlag::BCLIF)),
            (0, 1),
            "{add}"
        );
        assert_eq!(bus.rigs[2].pulls(), [false; 2]);
        assert_eq!(bus.peek(2, Sfr::SSPSTAT) & 0x05, 0, "BF and R/W are gone");
        assert!(!refused(&bus), "{add}");
        assert_eq!((stat(&bus), bus.read(SLAVE, Sfr::SSPBUF)), (0x09, 0x50), "{add}");
        master(&mut bus, Sfr::SSPBUF, 0x12);
        assert_eq!(bus.read(SLAVE, Sfr::SSPBUF), 0x12);
        let before = bus.rigs[2].count(InterruptFlag::SSPIF);
        master(&mut bus, Sfr::SSPCON2, STOP);
        assert_eq!(bus.rigs[2].count(InterruptFlag::SSPIF), before + 1, "the loser hears of the Stop");
        assert_eq!(bus.peek(2, Sfr::SSPSTAT) & 0x18, 0x10);
    }
}

#[test]
fn no_start_on_a_bus_that_is_taken() {
    let mut bus = masters(9);
    master(&mut bus, Sfr::SSPCON2, START);
    assert_eq!(
        (bus.rigs[2].count(InterruptFlag::SSPIF), bus.peek(2, Sfr::SSPSTAT)),
        (1, 0x08),
        "it hears of the Start"
    );
    bus.write(2, Sfr::SSPCON2, START);
    assert_eq!((bus.rigs[2].count(InterruptFlag::BCLIF), bus.peek(2, Sfr::SSPCON2)), (1, 0));
    master(&mut bus, Sfr::SSPBUF, 0x50);
    assert!(!refused(&bus));
}

#[test]
fn spi_master_and_slave_swap_bytes() {
    for ckp in [0, 0x10] {
        for cke in [0, 0x40] {
            for rate in 0..3 {
                let mut rigs = [Pic16Ssp::new(true), Pic16Ssp::new(false)].map(crate::rig::TestBench::new);
                rigs[0].write(Sfr::SSPSTAT, cke, 4);
                rigs[0].write(Sfr::SSPCON, 0x20 | ckp | rate, 4);
                crate::spi::wire(&mut rigs, 4);
                rigs[1].write(Sfr::SSPSTAT, cke, 8);
                rigs[1].write(Sfr::SSPCON, 0x25 | ckp, 8);
                rigs[1].write(Sfr::SSPBUF, 0x3A, 8);
                rigs[0].write(Sfr::SSPBUF, 0xC5, 12);
                for t in 12..700 {
                    for bench in &mut rigs {
                        bench.tick(t);
                    }
                    crate::spi::wire(&mut rigs, t);
                }
                let got = rigs.each_mut().map(|bench| bench.read(Sfr::SSPBUF, 700));
                assert_eq!(got, [0x3A, 0xC5], "{ckp:02X} {cke:02X} {rate}");
                assert_eq!(rigs.each_ref().map(|bench| bench.count(InterruptFlag::SSPIF)), [1, 1]);
            }
        }
    }
}
