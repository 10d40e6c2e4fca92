//! The status register as raw results, packed only when it is read.
//!
//! Each flag is kept as the byte that decides it: bit 7 of `carries`, `n` and `v`, bit 3 of `carries` for H,
//! a zero byte for Z. An instruction therefore stores whole results, and no bit is extracted unless something
//! reads it.

/// The flags of SREG by their letters in the data sheet, numbered as the bits of SREG.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum SregFlag {
    C,
    Z,
    N,
    V,
    S,
    H,
    T,
    I,
}

/// A byte that decides a flag, in a word of its own. The compiler would pack adjacent bytes into one host
/// register, and every write would have to mask and shift.
type RawFlag = u32;

/// SREG as one raw value per flag.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SregFlags {
    /// Carry: bit 7. Half carry: bit 3.
    pub carries: RawFlag,
    /// Negative: bit 7.
    pub n: RawFlag,
    /// Zero: set when this byte is 0.
    pub z: RawFlag,
    /// Overflow: bit 7.
    pub v: RawFlag,
    /// Sign: bit 7 of `n ^ v ^ s`. It is nonzero only after an instruction wrote S, N or V alone.
    pub s: RawFlag,
    /// Bit copy: bit 7.
    pub t: RawFlag,
    /// Interrupts enabled: bit 7.
    pub i: RawFlag,
}

/// Bit 7 set if `condition` is true.
const fn bit(condition: bool) -> RawFlag {
    (condition as RawFlag) << 7
}

impl SregFlags {
    /// Converts from the bits of SREG.
    #[inline]
    pub const fn unpack(sreg: u8) -> SregFlags {
        let (n, v) = (bit(sreg & 1 << 2 != 0), bit(sreg & 1 << 3 != 0));
        SregFlags {
            carries: bit(sreg & 1 != 0) | bit(sreg & 1 << 5 != 0) >> 4,
            z: (sreg & 1 << 1 == 0) as RawFlag,
            n,
            v,
            s: n ^ v ^ bit(sreg & 1 << 4 != 0),
            t: bit(sreg & 1 << 6 != 0),
            i: bit(sreg & 1 << 7 != 0),
        }
    }

    /// Converts to the bits of SREG.
    #[inline]
    pub const fn pack(self) -> u8 {
        (self.get(SregFlag::C) as u8)
            | (self.get(SregFlag::Z) as u8) << 1
            | (self.get(SregFlag::N) as u8) << 2
            | (self.get(SregFlag::V) as u8) << 3
            | (self.get(SregFlag::S) as u8) << 4
            | (self.get(SregFlag::H) as u8) << 5
            | (self.get(SregFlag::T) as u8) << 6
            | (self.get(SregFlag::I) as u8) << 7
    }

    /// Sets C to bit 7 of `carry`; H does not change.
    #[inline(always)]
    pub const fn set_c(&mut self, carry: RawFlag) {
        self.carries = (self.carries & 0x08) | (carry & 0x80);
    }

    /// Reads one flag.
    #[inline(always)]
    pub const fn get(&self, flag: SregFlag) -> bool {
        match flag {
            SregFlag::C => self.carries & 0x80 != 0,
            SregFlag::Z => self.z == 0,
            SregFlag::N => self.n & 0x80 != 0,
            SregFlag::V => self.v & 0x80 != 0,
            SregFlag::S => (self.n ^ self.v ^ self.s) & 0x80 != 0,
            SregFlag::H => self.carries & 0x08 != 0,
            SregFlag::T => self.t & 0x80 != 0,
            SregFlag::I => self.i & 0x80 != 0,
        }
    }

    /// Writes one flag and no other: S keeps its value when N or V alone is written.
    #[inline(always)]
    pub const fn set(&mut self, flag: SregFlag, on: bool) {
        let changed = bit(on != self.get(flag));
        match flag {
            SregFlag::C => self.carries ^= changed,
            SregFlag::Z => self.z = !on as RawFlag,
            SregFlag::N => (self.n, self.s) = (self.n ^ changed, self.s ^ changed),
            SregFlag::V => (self.v, self.s) = (self.v ^ changed, self.s ^ changed),
            SregFlag::S => self.s ^= changed,
            SregFlag::H => self.carries ^= changed >> 4,
            SregFlag::T => self.t = bit(on),
            SregFlag::I => self.i = bit(on),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{SregFlag, SregFlags};

    #[test]
    fn every_sreg_packs_back_and_every_flag_writes_only_itself() {
        let flags =
            [SregFlag::C, SregFlag::Z, SregFlag::N, SregFlag::V, SregFlag::S, SregFlag::H, SregFlag::T, SregFlag::I];
        for sreg in 0..=255u8 {
            assert_eq!(SregFlags::unpack(sreg).pack(), sreg);
            for flag in flags {
                for on in [false, true] {
                    let mut f = SregFlags::unpack(sreg);
                    f.set(flag, on);
                    let mask = 1 << flag as u8;
                    assert_eq!(f.pack(), sreg & !mask | if on { mask } else { 0 }, "{sreg:02x} {flag:?} {on}");
                    assert_eq!(f.get(flag), on);
                }
            }
        }
    }
}
