//! Variants of program memory in the AVR family, and the configuration bytes.

/// Variant of program memory and self-programming of a chip. Sizes are in bytes and powers of two; section
/// starts are byte addresses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SpmKind {
    /// Size of program memory.
    pub flash: u32,
    /// Size of a page, at most 256.
    pub page: u32,
    /// First byte address of the no-read-while-write section (NRWW), which is the largest boot section; 0 if
    /// all of program memory is NRWW.
    pub nrww: u32,
    /// True if the chip has a boot section: then SPM works only from there, and the boot lock bits exist.
    pub boot: bool,
    /// True if SIGRD exists.
    pub signature_row: bool,
    /// Mask of the lock bits that SPM can program.
    pub lock: u8,
}

impl SpmKind {
    /// ATmega88 and its variants (tables 27-9 to 27-11).
    pub const MEGA88: SpmKind =
        SpmKind { flash: 0x2000, page: 64, nrww: 0x1800, boot: true, signature_row: true, lock: 0x3F };
    /// ATmega48 and its variants (section 26): SPM works from anywhere and always halts the core.
    pub const MEGA48: SpmKind = SpmKind { flash: 0x1000, nrww: 0, boot: false, lock: 0x03, ..SpmKind::MEGA88 };
    /// ATmega168 and its variants (tables 27-12 to 27-14), ATmega164 (Atmel 8272).
    pub const MEGA168: SpmKind = SpmKind { flash: 0x4000, page: 128, nrww: 0x3800, ..SpmKind::MEGA88 };
    /// ATmega328 and its variants (tables 27-15 to 27-17), ATmega324 (Atmel 8272).
    pub const MEGA328: SpmKind = SpmKind { flash: 0x8000, page: 128, nrww: 0x7000, ..SpmKind::MEGA88 };
    /// ATmega644 and its variants (Atmel 8272, boot loader parameters).
    pub const MEGA644: SpmKind = SpmKind { flash: 0x1_0000, page: 256, nrww: 0xE000, ..SpmKind::MEGA88 };
    /// ATmega1284 and 1284P (Atmel 8272, boot loader parameters).
    pub const MEGA1284: SpmKind = SpmKind { flash: 0x2_0000, page: 256, nrww: 0x1_E000, ..SpmKind::MEGA88 };
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

/// Bytes outside program memory that a program reads by LPM after a write of SPMCSR.
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
