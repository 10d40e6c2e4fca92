//! STATUS, PCL, PCLATH and FSR as destinations, with all their values (DS33023, sections 5.5, 6.2.2 and
//! 6.3.3).

use emu_core::Cpu;

use super::exhaustive::{BYTES, Writes, flags_of, status_of};
use super::rig::TestBench;

/// Mask of TO and PD.
const TO_PD: u8 = 0x18;

/// STATUS as the destination of an instruction without a skip: an instruction with flags leaves all three
/// flags to the arithmetic, whichever of them it writes.
#[test]
fn status_as_destination() {
    for &(name, writes, reference) in BYTES {
        let mut bench = TestBench::new(&format!("{name} 0x03, F"));
        let reads_w = matches!(name, "addwf" | "andwf" | "iorwf" | "subwf" | "xorwf");
        for status in 0..=255u8 {
            for w in 0..=if reads_w { 255 } else { 0 } {
                bench.put(0x03, status);
                bench.set_w(w);
                let result = reference(status, w, flags_of(status));
                let low = if writes == Writes::None { result.value & 7 } else { status_of(result.flags, 0) };
                let wanted = result.value & 0xE0 | status & TO_PD | low;
                let what = format!("{name} STATUS,F: W={w:02x} STATUS={status:02x}");
                assert_eq!(bench.go(), 1 + u64::from(result.skips), "{what}: cycles");
                assert_eq!(bench.get(0x03), wanted, "{what}: wanted {wanted:02x}, found {:02x}", bench.get(0x03));
                assert_eq!(bench.w(), w, "{what}: W");
            }
        }
    }
}

#[test]
fn status_written_by_moves_clears_and_bits() {
    let (mut movwf, mut clrf) = (TestBench::new("movwf 0x03"), TestBench::new("clrf 0x03"));
    for status in 0..=255u8 {
        for w in 0..=255u8 {
            movwf.put(0x03, status);
            movwf.set_w(w);
            movwf.go();
            let found = movwf.get(0x03);
            assert_eq!(found, w & !TO_PD | status & TO_PD, "movwf STATUS: W={w:02x} STATUS={status:02x}");
        }
        clrf.put(0x03, status);
        clrf.go();
        assert_eq!(clrf.get(0x03), status & (TO_PD | 3) | 4, "clrf STATUS: STATUS={status:02x}");
    }
    for bit in 0..8 {
        let mask = 1u8 << bit;
        let changes = mask & !TO_PD;
        let (mut bcf, mut bsf) =
            (TestBench::new(&format!("bcf 0x03, {bit}")), TestBench::new(&format!("bsf 0x03, {bit}")));
        for status in 0..=255u8 {
            for bench in [&mut bcf, &mut bsf] {
                bench.put(0x03, status);
                bench.go();
            }
            assert_eq!(bcf.get(0x03), status & !changes, "bcf STATUS,{bit}: STATUS={status:02x}");
            assert_eq!(bsf.get(0x03), status | changes, "bsf STATUS,{bit}: STATUS={status:02x}");
        }
    }
}

/// A write of PCL jumps to PCLATH and the result, and takes two cycles. Instructions that also skip are not
/// tested: the data sheet does not define them.
#[test]
fn pcl_as_destination() {
    for &(name, _, reference) in BYTES {
        for pc in [0x0000u32, 0x0080, 0x00FF, 0x0234, 0x0FFF, 0x17FE, 0x1FFF] {
            let mut bench = TestBench::new("nop");
            super::rig::put_word(&mut bench.cpu, pc, super::rig::word(&format!("{name} 0x02, F")));
            let pcl = (pc + 1) as u8;
            for w in 0..=255u8 {
                let pclath = w.wrapping_mul(7) & 0x1F;
                let before = w >> 3 & 7;
                bench.put(0x0A, pclath);
                bench.set_w(w);
                bench.put(0x03, 0x18 | before);
                let result = reference(pcl, w, flags_of(before));
                if result.skips {
                    continue;
                }
                let what = format!("{name} PCL,F at {pc:04x}: W={w:02x} PCLATH={pclath:02x}");
                assert_eq!(bench.go_from(pc), 2, "{what}: cycles");
                assert_eq!(bench.cpu.pc(), u32::from(pclath) << 8 | u32::from(result.value), "{what}: PC");
                assert_eq!((bench.get(0x0A), bench.get(0x03)), (pclath, status_of(result.flags, 0x18)), "{what}");
            }
        }
    }
}

/// Five bits of PCLATH can be written; a read of PCL does not change it.
#[test]
fn pclath_as_destination() {
    let (mut movwf, mut read) = (TestBench::new("movwf 0x0A"), TestBench::new("movf 0x02, W"));
    for w in 0..=255u8 {
        movwf.set_w(w);
        assert_eq!(movwf.go(), 1);
        assert_eq!(movwf.get(0x0A), w & 0x1F, "W={w:02x}");
        assert_eq!(movwf.cpu.pc(), TestBench::PC + 1);
        read.put(0x0A, w);
        assert_eq!(read.go(), 1);
        assert_eq!((read.w(), read.get(0x0A)), (0x35, w & 0x1F));
    }
    for &(name, writes, reference) in BYTES {
        let mut bench = TestBench::new(&format!("{name} 0x0A, F"));
        for pclath in 0..0x20u8 {
            for w in (0..=255u8).step_by(5) {
                bench.put(0x0A, pclath);
                bench.set_w(w);
                bench.put(0x03, 0x18);
                let result = reference(pclath, w, [false; 3]);
                bench.go();
                assert_eq!(bench.get(0x0A), result.value & 0x1F, "{name} PCLATH,F: W={w:02x} PCLATH={pclath:02x}");
                // The flags are those of all eight bits.
                let status = if writes == Writes::None { 0x18 } else { status_of(result.flags, 0x18) };
                assert_eq!(bench.get(0x03), status, "{name} PCLATH,F: W={w:02x} PCLATH={pclath:02x}: STATUS");
            }
        }
    }
}
