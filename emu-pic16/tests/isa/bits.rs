//! Bit instructions with all bits and bytes: in RAM, in a core register, in a chip register, and through
//! INDF.

use emu_core::Cpu;

use super::rig::TestBench;

/// Text of the operand, address of the byte, FSR for it; the bank is 0, or 1 for TRISB.
const PLACES: &[(&str, u16, Option<u8>, u8)] =
    &[("0x25", 0x25, None, 0), ("0x04", 0x04, None, 0), ("0x06", 0x86, None, 0x20), ("0x00", 0x33, Some(0x33), 0)];

#[test]
fn bits_are_set_cleared_and_tested() {
    for &(text, addr, fsr, bank) in PLACES {
        for bit in 0..8 {
            let mask = 1u8 << bit;
            let [mut bcf, mut bsf, mut btfsc, mut btfss] =
                ["bcf", "bsf", "btfsc", "btfss"].map(|name| TestBench::new(&format!("{name} {text}, {bit}")));
            for byte in 0..=255u8 {
                for (bench, wanted, skips) in [
                    (&mut bcf, byte & !mask, false),
                    (&mut bsf, byte | mask, false),
                    (&mut btfsc, byte, byte & mask == 0),
                    (&mut btfss, byte, byte & mask != 0),
                ] {
                    let status = 0x18 | bank | byte & 7;
                    bench.put(0x03, status);
                    bench.set_w(!byte);
                    if let Some(fsr) = fsr {
                        bench.put(0x04, fsr);
                    }
                    bench.put(addr, byte);
                    assert_eq!(bench.go(), 1 + u64::from(skips), "{text},{bit} of {byte:02x}: cycles");
                    assert_eq!(bench.get(addr), wanted, "{text},{bit} of {byte:02x}");
                    assert_eq!(bench.cpu.pc(), TestBench::PC + 1 + u32::from(skips), "{text},{bit} of {byte:02x}: PC");
                    assert_eq!((bench.get(0x03), bench.w()), (status, !byte), "{text},{bit} of {byte:02x}: STATUS, W");
                }
            }
        }
    }
}
