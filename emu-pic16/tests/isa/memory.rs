//! Data memory: which addresses are the same byte, and which are unimplemented, by the register file maps of
//! the data sheets.

use emu_core::Cpu;

use super::rig::{TestBench, machine, put_word, word};

/// RAM of a chip: blocks of bytes, each with all its start addresses.
struct Map {
    chip: &'static str,
    /// Blocks: the start addresses of a block, and its length in bytes.
    blocks: &'static [(&'static [u16], u16)],
    /// Unimplemented addresses.
    nothing: &'static [(u16, u16)],
}

/// Maps from DS30292 figures 2-3 and 2-4, DS39582 figures 2-3 and 2-4, DS35007 figure 2-2, DS40044 figure
/// 4-2.
const MAPS: &[Map] = &[
    Map {
        chip: "pic16f873",
        blocks: &[(&[0x20, 0x120], 0x60), (&[0xA0, 0x1A0], 0x60)],
        nothing: &[
            (0x08, 0x09),
            (0x88, 0x89),
            (0x8F, 0x90),
            (0x95, 0x97),
            (0x9A, 0x9D),
            (0x105, 0x105),
            (0x107, 0x109),
            (0x110, 0x11F),
            (0x185, 0x185),
            (0x187, 0x189),
            (0x190, 0x19F),
        ],
    },
    Map {
        chip: "pic16f877",
        blocks: &[
            (&[0x20], 0x50),
            (&[0xA0], 0x50),
            (&[0x110], 0x60),
            (&[0x190], 0x60),
            (&[0x70, 0xF0, 0x170, 0x1F0], 0x10),
        ],
        nothing: &[
            (0x8F, 0x90),
            (0x95, 0x97),
            (0x9A, 0x9D),
            (0x105, 0x105),
            (0x107, 0x109),
            (0x185, 0x185),
            (0x187, 0x189),
        ],
    },
    Map {
        chip: "pic16f873a",
        blocks: &[(&[0x20, 0x120], 0x60), (&[0xA0, 0x1A0], 0x60)],
        nothing: &[
            (0x08, 0x09),
            (0x88, 0x89),
            (0x8F, 0x90),
            (0x95, 0x97),
            (0x9A, 0x9B),
            (0x110, 0x11F),
            (0x190, 0x19F),
        ],
    },
    Map {
        chip: "pic16f84a",
        blocks: &[(&[0x0C, 0x8C], 0x44)],
        nothing: &[(0x07, 0x07), (0x50, 0x7F), (0x87, 0x87), (0xD0, 0xFF)],
    },
    Map {
        chip: "pic16f628a",
        blocks: &[(&[0x20], 0x50), (&[0xA0], 0x50), (&[0x120], 0x30), (&[0x70, 0xF0, 0x170, 0x1F0], 0x10)],
        nothing: &[(0x07, 0x09), (0x0D, 0x0D), (0x1B, 0x1E), (0x150, 0x16F), (0x1A0, 0x1EF)],
    },
];

/// A chip, with functions that read and write one byte as a program does: directly, and through INDF.
struct Reach {
    bench: TestBench,
}

impl Reach {
    fn new(chip: &str) -> Reach {
        Reach { bench: TestBench { cpu: machine(chip, 0x33) } }
    }

    /// Places the instruction, and sets the banks and FSR for it.
    fn aim(&mut self, name: &str, rest: &str, addr: u16, indirect: bool) {
        let banks = if indirect { u32::from(addr >> 8) << 7 } else { u32::from(addr >> 7) << 5 };
        self.bench.cpu.set_reg("STATUS", 0x18 | banks);
        if indirect {
            self.bench.cpu.set_reg("FSR", u32::from(addr & 0xFF));
        }
        let f = if indirect { 0 } else { addr & 0x7F };
        put_word(&mut self.bench.cpu, TestBench::PC, word(&format!("{name} {f}{rest}")));
    }

    fn write(&mut self, addr: u16, value: u8, indirect: bool) {
        self.bench.set_w(value);
        self.aim("movwf", "", addr, indirect);
        assert_eq!(self.bench.go(), 1);
    }

    fn read(&mut self, addr: u16, indirect: bool) -> u8 {
        self.bench.set_w(0xEE);
        self.aim("movf", ", W", addr, indirect);
        assert_eq!(self.bench.go(), 1);
        self.bench.w()
    }
}

/// Every byte is written at one address and read at all others, in both ways; bytes of other blocks do not
/// change.
#[test]
fn the_same_byte_at_all_its_addresses() {
    for map in MAPS {
        let mut reach = Reach::new(map.chip);
        for (turn, &(firsts, len)) in (0u8..).zip(map.blocks) {
            for offset in 0..len {
                for (n, &first) in (0u8..).zip(firsts) {
                    let value = (offset as u8).wrapping_mul(37) ^ turn << 6 ^ n;
                    reach.write(first + offset, value, n % 2 == 1);
                    for &other in firsts {
                        let found = [false, true].map(|indirect| reach.read(other + offset, indirect));
                        assert_eq!(found, [value; 2], "{}: {:03x} at {other:03x}", map.chip, first + offset);
                    }
                }
            }
        }
        // All blocks together: none has overwritten another.
        for (turn, &(firsts, len)) in (0u8..).zip(map.blocks) {
            for offset in 0..len {
                let last = firsts.len() as u8 - 1;
                let value = (offset as u8).wrapping_mul(37) ^ turn << 6 ^ last;
                assert_eq!(reach.read(firsts[0] + offset, false), value, "{}: {:03x}", map.chip, firsts[0] + offset);
            }
        }
        let bytes: u32 = map.blocks.iter().map(|block| u32::from(block.1)).sum();
        assert_eq!(bytes, u32::from(reach.bench.cpu.chip().ram_len), "{}: bytes of RAM", map.chip);
    }
}

/// Unimplemented addresses read 0 and cannot be written.
#[test]
fn nothing_reads_0() {
    for map in MAPS {
        let mut reach = Reach::new(map.chip);
        for addr in map.nothing.iter().flat_map(|&(first, last)| first..=last) {
            for indirect in [false, true] {
                reach.write(addr, 0xA5, indirect);
                assert_eq!(reach.read(addr, indirect), 0, "{}: {addr:03x}", map.chip);
                assert_eq!(reach.bench.cpu.peek("data", addr.into()), Some(0), "{}: {addr:03x}", map.chip);
            }
        }
    }
}

/// PCL, STATUS, FSR, PCLATH and INTCON are in every bank; INDF reads 0 and ignores writes if FSR points to
/// it.
#[test]
fn the_core_in_every_bank() {
    for map in MAPS {
        let mut reach = Reach::new(map.chip);
        for bank in 0..4 {
            for other in 0..4 {
                for (low, value) in [(0x04u16, 0x5A), (0x0A, 0x15), (0x0B, 0x48)] {
                    let value = value ^ bank as u8;
                    reach.write(0x80 * bank + low, value, false);
                    let found = reach.read(0x80 * other + low, false);
                    assert_eq!(found, value, "{}: {low:02x} in banks {bank}, {other}", map.chip);
                }
            }
            assert_eq!(reach.read(0x80 * bank + 2, false), (TestBench::PC + 1) as u8, "{}: PCL", map.chip);
            assert_eq!(reach.read(0x80 * bank + 3, false) & 0x60, (bank as u8) << 5, "{}: STATUS", map.chip);
            reach.write(0x80 * bank, 0xFF, true);
            assert_eq!(reach.read(0x80 * bank, true), 0, "{}: INDF in bank {bank}", map.chip);
        }
    }
}
