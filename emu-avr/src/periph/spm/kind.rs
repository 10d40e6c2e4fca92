//! What differs between the program memories of the family, and the bytes that lie beside them.

/// Sizes are in bytes, and powers of two; so is the first byte of a section an address in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SpmKind {
    /// Size of program memory.
    pub flash: u32,
    /// Size of a page, 256 at most.
    pub page: u32,
    /// First byte of the section that cannot be read while it is written (NRWW): the largest boot section. 0 where there is no
    /// other.
    pub nrww: u32,
    /// There is a boot section, and SPM works from there alone. The boot lock bits are only there with it.
    pub boot: bool,
    /// There is SIGRD.
    pub signature_row: bool,
    /// The lock bits that SPM programs.
    pub lock: u8,
}

impl SpmKind {
    /// ATmega88 and its variants (tables 27-9 to 27-11).
    pub const MEGA88: SpmKind =
        SpmKind { flash: 0x2000, page: 64, nrww: 0x1800, boot: true, signature_row: true, lock: 0x3F };
    /// ATmega48 and its variants (section 26): SPM works from anywhere and always halts the core.
    pub const MEGA48: SpmKind = SpmKind { flash: 0x1000, nrww: 0, boot: false, lock: 0x03, ..SpmKind::MEGA88 };
    /// ATmega168 and its variants (tables 27-12 to 27-14).
    pub const MEGA168: SpmKind = SpmKind { flash: 0x4000, page: 128, nrww: 0x3800, ..SpmKind::MEGA88 };
    /// ATmega328 and its variants (tables 27-15 to 27-17).
    pub const MEGA328: SpmKind = SpmKind { flash: 0x8000, page: 128, nrww: 0x7000, ..SpmKind::MEGA88 };
    /// ATmega8 (Atmel 2486, boot loader support).
    pub const MEGA8: SpmKind = SpmKind { signature_row: false, lock: 0x3C, ..SpmKind::MEGA88 };
    /// ATmega16 (Atmel 2466) and ATmega162 (Atmel 2513).
    pub const MEGA16: SpmKind = SpmKind { flash: 0x4000, page: 128, nrww: 0x3800, ..SpmKind::MEGA8 };
    /// ATmega32 (Atmel 2503).
    pub const MEGA32: SpmKind = SpmKind { flash: 0x8000, page: 128, nrww: 0x7000, ..SpmKind::MEGA8 };
    /// ATmega64 (Atmel 2490).
    pub const MEGA64: SpmKind = SpmKind { flash: 0x1_0000, page: 256, nrww: 0xE000, ..SpmKind::MEGA8 };
    /// ATmega128 (Atmel 2467).
    pub const MEGA128: SpmKind = SpmKind { flash: 0x2_0000, page: 256, nrww: 0x1_E000, ..SpmKind::MEGA8 };
}

/// The bytes that a program reads by LPM behind SPMCSR.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConfigBytes {
    /// Lock bits (table 28-1); 0 is programmed.
    pub lock: u8,
    /// Fuse bytes: low, high, extended.
    pub fuses: [u8; 3],
    /// Signature bytes (28.3).
    pub signature: [u8; 3],
    /// Calibration byte of the internal oscillator (28.4).
    pub calibration: u8,
}

emu_core::state! { ConfigBytes { lock } stays { fuses, signature, calibration } }
