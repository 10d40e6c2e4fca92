//! Devices at the pins: each compared with a plain list of bytes, and the board with the cycles of its
//! answers.

use emu_avr::{Avr, chips::ATMEGA328P};
use emu_core::cpu::{Cpu, Probe, RamInit, StopReason};
use emu_core::image::{ElfMachine, load};
use emu_core::pins::{ChipEvent, PinId, PinLevel};
use emu_core::rng::Rng;
use emu_debug::devices::ExternalDevice;
use emu_debug::devices::eeprom24::Eeprom24;
use emu_debug::devices::flash25::Flash25;
use emu_debug::{AttachedDevices, CycleClock, WiredDevice};

/// Clocks per second in the tests of single devices.
const HZ: u64 = 1_000_000;

/// An SPI master with one clock per half bit.
struct Spi(Flash25, u64);

impl Spi {
    /// Executes one transfer; returns the received bytes.
    fn transfer(&mut self, bytes: &[u8]) -> Vec<u8> {
        self.bits(bytes, 8 * bytes.len())
    }

    fn bits(&mut self, bytes: &[u8], count: usize) -> Vec<u8> {
        let mut back = vec![0; bytes.len()];
        self.0.on_pin_change(0, false, self.1, HZ);
        for bit in 0..count {
            self.0.on_pin_change(2, bytes[bit / 8] >> (7 - bit % 8) & 1 == 1, self.1, HZ);
            back[bit / 8] = back[bit / 8] << 1 | u8::from(self.0.out.unwrap_or(true));
            self.0.on_pin_change(1, true, self.1 + 1, HZ);
            self.0.on_pin_change(1, false, self.1 + 2, HZ);
            self.1 += 2;
        }
        self.0.on_pin_change(0, true, self.1, HZ);
        back
    }
}

/// Random transfers compared with a list of bytes. Transfers during a write are lost, and so are those that
/// end within a byte.
#[test]
fn flash_keeps_what_is_programmed() {
    let seed = 0x25_0F;
    let mut rng = Rng::new(seed);
    let mut spi = Spi(Flash25::new("25q80").expect("a name"), 0);
    let mut cells = vec![0xFFu8; 1 << 20];
    let (mut enabled, mut busy, mut done) = (false, 0u64, [0; 6]);
    assert_eq!(spi.transfer(&[0x9F, 0, 0, 0]), [0xFF, 0xEF, 0x40, 0x14]);
    for turn in 0..3_000 {
        // Few addresses, so that accesses overlap.
        let at = (rng.below(3) as usize) << 16 | (rng.below(2) as usize) << 12 | (0xF8 + rng.below(8) as usize);
        let [_, a, b, c] = (at as u32).to_be_bytes();
        let long = rng.below(8) == 0;
        spi.1 += rng.below(if long { 200_000 } else { 300 });
        let whole = rng.below(8) != 0;
        let cut = |bytes: &[u8]| 8 * bytes.len() - if whole { 0 } else { 3 };
        let kind = rng.below(6) as usize;
        let now = spi.1;
        match kind {
            0 | 1 => {
                let bytes = [0x06];
                spi.bits(&bytes, cut(&bytes));
                enabled |= whole && now + 15 >= busy;
            }
            2 => {
                let data: Vec<u8> = (0..1 + rng.below(300)).map(|_| rng.below(256) as u8).collect();
                let bytes = [&[0x02, a, b, c], &data[..]].concat();
                let (ready, bits) = (now + 15 >= busy, cut(&bytes));
                spi.bits(&bytes, bits);
                if ready && whole && enabled {
                    let mut page = vec![None; 256];
                    data.iter().enumerate().for_each(|(i, &byte)| page[(at + i) % 256] = Some(byte));
                    let first = at / 256 * 256;
                    page.iter().enumerate().for_each(|(i, byte)| cells[first + i] &= byte.unwrap_or(0xFF));
                    (enabled, busy) = (false, spi.1 + 700);
                    done[2] += 1;
                }
            }
            3 => {
                let (code, size, us) =
                    [(0x20, 0x1000, 30_000), (0x52, 0x8000, 120_000), (0xD8, 0x10000, 150_000)][rng.below(3) as usize];
                let bytes = [code, a, b, c];
                let ready = now + 15 >= busy;
                spi.bits(&bytes, cut(&bytes));
                if ready && whole && enabled {
                    let first = at / size * size;
                    cells[first..first + size].fill(0xFF);
                    (enabled, busy) = (false, spi.1 + us);
                    done[3] += 1;
                }
            }
            4 => {
                let back = spi.transfer(&[0x05, 0, 0])[1];
                // The byte is prepared with the last bit of the previous one.
                let wanted = if now + 15 < busy { 3 } else { u8::from(enabled) << 1 };
                assert_eq!(back, wanted, "seed {seed:#x} turn {turn}: status");
                done[4] += 1;
            }
            _ => {
                let ready = now + 15 >= busy;
                let fast = rng.below(2) == 0;
                let head = if fast { vec![0x0B, a, b, c, 0] } else { vec![0x03, a, b, c] };
                let back = spi.transfer(&[&head[..], &[0; 20]].concat());
                for (i, &byte) in back[head.len()..].iter().enumerate() {
                    let wanted = if ready { cells[at + i] } else { 0xFF };
                    assert_eq!(byte, wanted, "seed {seed:#x} turn {turn}: {at:#x} + {i}");
                }
                done[5] += usize::from(ready);
            }
        }
    }
    assert!(done[2..].iter().all(|&n| n > 20), "{done:?}");
    assert!(spi.0.cells.bytes() == cells, "seed {seed:#x}");
}

/// A two-wire bus master; every call gives its time.
struct I2c(Eeprom24);

impl I2c {
    fn lines(&mut self, t: u64, lines: &[(usize, bool)]) {
        for &(pin, high) in lines {
            let high = high && (pin != 0 || !self.0.pulls_sda);
            self.0.on_pin_change(pin, high, t, HZ);
        }
    }

    fn start(&mut self, t: u64) {
        self.lines(t, &[(1, false), (0, true), (1, true), (0, false), (1, false)]);
    }

    fn stop(&mut self, t: u64) {
        self.lines(t, &[(1, false), (0, false), (1, true), (0, true)]);
    }

    /// Sends a byte; returns whether it is acknowledged.
    fn send(&mut self, byte: u8, t: u64) -> bool {
        for bit in (0..8).rev() {
            self.lines(t, &[(0, byte >> bit & 1 == 1), (1, true), (1, false)]);
        }
        let acknowledged = self.0.pulls_sda;
        self.lines(t, &[(0, true), (1, true), (1, false)]);
        acknowledged
    }
}

/// The write cycle begins with the stop, takes 5 ms, and is the only time without an acknowledge. A start
/// instead of the stop, or a protected chip, writes nothing.
#[test]
fn eeproms_take_their_time() {
    let mut bus = I2c(Eeprom24::new("24c64").expect("a name"));
    assert!(bus.0.tie_address(0x53) && !bus.0.clone().tie_address(0x58));
    let mut write = |t: u64, addr: u8, byte: u8| {
        bus.start(t);
        let taken = bus.send(0xA6, t) && bus.send(0, t) && bus.send(addr, t) && bus.send(byte, t);
        bus.stop(t);
        taken
    };
    assert!(write(100, 0x1F, 0x12));
    assert!(!write(5_099, 0x20, 0x34), "the cycle goes on");
    assert!(write(5_100, 0x20, 0x56), "it is over");
    // An address without data is not a write.
    bus.start(20_000);
    assert!(bus.send(0xA6, 20_000) && bus.send(0, 20_000) && bus.send(0, 20_000));
    bus.stop(20_000);
    bus.start(20_001);
    assert!(bus.send(0xA6, 20_001) && bus.send(0, 20_001) && bus.send(0x21, 20_001) && bus.send(0x78, 20_001));
    bus.start(20_002);
    assert!(!bus.send(0xA4, 20_002), "another chip");
    bus.0.on_pin_change(5, true, 20_002, HZ);
    bus.start(20_003);
    assert!(bus.send(0xA6, 20_003) && bus.send(0, 20_003) && bus.send(0x22, 20_003) && bus.send(0x9A, 20_003));
    bus.stop(20_003);
    let cells = bus.0.cells.bytes();
    assert_eq!(cells.len(), 0x2000);
    assert_eq!(cells[0x1F..0x23], [0x12, 0x56, 0xFF, 0xFF]);
}

/// All edges with their cycles.
#[derive(Default)]
struct Edges(Vec<(u64, PinId, bool)>);

impl Probe for Edges {
    const EVENTS: bool = true;

    fn on_event(&mut self, event: ChipEvent) -> bool {
        if let ChipEvent::Edge { at, pin, level } = event {
            self.0.push((at.cycle, pin, level == PinLevel::High));
        }
        false
    }
}

const CLOCK: CycleClock = CycleClock { hz: 16_000_000, clocks_per_cycle: 1 };

/// Runs a program of the transcripts with a device, in stretches that `until` returns.
fn board(
    hex: &[u8],
    device: ExternalDevice,
    wires: &[Option<PinId>],
    until: &mut dyn FnMut(u64) -> u64,
) -> (Avr, AttachedDevices, Edges) {
    let chip = &ATMEGA328P;
    let image =
        load("image", hex, chip.hex_spaces, chip.elf_spaces, ElfMachine(chip.elf_machine)).expect("an image").image;
    let mut cpu = Avr::new(chip, &image, RamInit::Zero);
    let mut board = AttachedDevices::new(vec![WiredDevice { device, wires: wires.to_vec() }], CLOCK);
    let mut edges = Edges::default();
    board.connect(&mut cpu);
    loop {
        let limit = until(cpu.cycle()).min(1_000_000);
        if board.run(&mut cpu, limit, &mut edges) == StopReason::Halted {
            break;
        }
        assert!(cpu.cycle() < 1_000_000, "the program never ends");
    }
    (cpu, board, edges)
}

/// On SPI at half the clock, every answer is at the cycle of its falling edge, two cycles before the next
/// one.
#[test]
fn answers_of_flash_come_with_the_edge() {
    const CS: PinId = 2;
    const SCK: PinId = 5;
    const MISO: PinId = 4;
    let hex = include_bytes!("../../tests/cli/in/flash25.hex");
    let flash = || ExternalDevice::Flash(Flash25::new("25q32").expect("a name"));
    let wires = [CS, SCK, 3, MISO].map(Some);
    let (cpu, at_once, edges) = board(hex, flash(), &wires, &mut |_| u64::MAX);
    let falls: Vec<u64> = edges.0.iter().filter(|edge| edge.1 == SCK && !edge.2).map(|edge| edge.0).collect();
    assert!(falls.windows(2).any(|two| two[1] - two[0] == 2), "half the clock");
    let answers: Vec<u64> = edges.0.iter().filter(|edge| edge.1 == MISO).map(|edge| edge.0).collect();
    assert!(answers.len() > 40, "{}", answers.len());
    // It releases the line when it is deselected.
    let ends: Vec<u64> = edges.0.iter().filter(|edge| edge.1 == CS && edge.2).map(|edge| edge.0).collect();
    assert!(answers.iter().filter(|at| falls.contains(at)).count() > 40);
    assert!(answers.iter().all(|at| falls.contains(at) || ends.contains(at)), "{answers:?}");
    // Any slicing of the run gives the same run.
    let mut rng = Rng::new(0xB0A2);
    let (sliced, slices, again) = board(hex, flash(), &wires, &mut |now| now + 1 + rng.below(3_000));
    assert_eq!((sliced.cycle(), sliced.instructions()), (cpu.cycle(), cpu.instructions()));
    assert_eq!(again.0, edges.0);
    let cells = |board: &AttachedDevices| board.devices().next().expect("a device").cells().bytes();
    assert!(cells(&at_once) == cells(&slices));
    assert_eq!(cells(&slices)[0x12_34FE..0x12_3500], *b"Pa");
}

/// On the two-wire bus, the device changes SDA 300 ns, which is 5 cycles at 16 MHz, after a falling edge of
/// SCL.
#[test]
fn answers_of_eeproms_come_after_the_edge() {
    const SDA: PinId = 12;
    const SCL: PinId = 13;
    let hex = include_bytes!("../../tests/cli/in/ee24.hex");
    let eeprom = || {
        let mut eeprom = Eeprom24::new("24c64").expect("a name");
        assert!(eeprom.tie_address(0x50));
        ExternalDevice::Eeprom(eeprom)
    };
    let wires = [Some(SDA), Some(SCL), None, None, None, None];
    let (cpu, _, edges) = board(hex, eeprom(), &wires, &mut |_| u64::MAX);
    let falls: Vec<u64> = edges.0.iter().filter(|edge| edge.1 == SCL && !edge.2).map(|edge| edge.0).collect();
    let after: Vec<u64> = edges
        .0
        .iter()
        .filter(|edge| edge.1 == SDA)
        .filter_map(|edge| Some(edge.0 - falls.iter().rev().find(|&&fall| fall <= edge.0)?))
        .collect();
    assert!(after.iter().filter(|&&cycles| cycles == 5).count() > 20, "{after:?}");
    let mut rng = Rng::new(0x12C);
    let (sliced, _, again) = board(hex, eeprom(), &wires, &mut |now| now + 1 + rng.below(3_000));
    assert_eq!((sliced.cycle(), sliced.instructions()), (cpu.cycle(), cpu.instructions()));
    assert_eq!(again.0, edges.0);
}
