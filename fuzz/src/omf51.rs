//! Initial object files of MCS-51, made by the writer that also tests their reader.

/// The writer of the reader's tests.
#[path = "../../emu-core/tests/omf51/write.rs"]
pub mod write;

pub use write::right;
use write::{Item, Module};

/// A program in the format of Intel's linker, and one with the additional records of Keil's linker.
pub fn seeds() -> Vec<Vec<u8>> {
    let mut intel = Module::new("PUMP");
    intel.scope(0, "PUMP");
    intel.items(1, &[Item::new(0x00, 0x40, "_run"), Item::new(0x42, 0x08, "speed"), Item::new(0x05, 0x64, "LIMIT")]);
    intel.scope(2, "_RUN");
    intel.content(0x40, &[0x8F, 0x08, 0x80, 0xFE]);
    intel.scope(1, "");
    intel.items(0, &[Item::new(0x42, 0x21, "step"), Item::new(0x44, 0x93, "LAMP")]);
    intel.scope(4, "");
    intel.lines(&[(0x40, 12), (0x42, 13)]);
    intel.scope(5, "_RUN");
    intel.scope(3, "PUMP");
    let mut keil = Module::new("TICK");
    keil.push(0x24, b"\0\0\0\0tick.c\0");
    keil.scope(0, "TICK");
    keil.keil(0, 1, &[Item::new(0x00, 0x80, "again"), Item::new(0x41, 0x1234, "log")]);
    keil.keil(1, 2, &[Item::new(0x43, 0x81, "deep")]);
    keil.content(0, &[0x02, 0x00, 0x80]);
    keil.push(0x22, &[3, 0, 0x80, 0, 8, 0]);
    keil.scope(3, "TICK");
    vec![intel.finish(), keil.finish()]
}
