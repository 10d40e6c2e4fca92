//! The status register, kept as raw results and packed only when read.
//!
//! Each flag is the byte that decides it: bit 7 of `c`, `n` and `v`, bit 3 of `h`, a zero byte for Z. So an instruction
//! writes whole results and nobody normalises what nobody reads.

/// The flags of SREG by their data-sheet letters, numbered as its bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Flag {
    C,
    Z,
    N,
    V,
    S,
    H,
    T,
    I,
}

/// SREG taken apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Flags {
    /// Carry: bit 7.
    pub c: u8,
    /// Half carry: bit 3.
    pub h: u8,
    /// Negative: bit 7.
    pub n: u8,
    /// Zero: set when this byte is 0.
    pub z: u8,
    /// Overflow: bit 7.
    pub v: u8,
    /// Sign, unlike N xor V only after an instruction wrote it alone: bit 7 is xored in.
    pub s: u8,
    /// Bit copy: bit 7.
    pub t: u8,
    /// Interrupts enabled: bit 7.
    pub i: u8,
}

const fn bit(condition: bool) -> u8 {
    if condition { 0x80 } else { 0 }
}

impl Flags {
    /// From the bits of SREG.
    #[inline]
    pub const fn unpack(sreg: u8) -> Flags {
        let n = sreg << 5;
        let v = sreg << 4;
        Flags { c: sreg << 7, z: !sreg & 2, n, v, s: (n ^ v ^ (sreg << 3)) & 0x80, h: sreg >> 2, t: sreg << 1, i: sreg }
    }

    /// The bits of SREG.
    #[inline]
    pub const fn pack(self) -> u8 {
        (self.c >> 7)
            | ((self.z == 0) as u8) << 1
            | (self.n >> 7) << 2
            | (self.v >> 7) << 3
            | ((self.n ^ self.v ^ self.s) >> 7) << 4
            | ((self.h >> 3) & 1) << 5
            | (self.t >> 7) << 6
            | (self.i & 0x80)
    }

    /// One flag.
    #[inline(always)]
    pub const fn get(&self, flag: Flag) -> bool {
        match flag {
            Flag::C => self.c & 0x80 != 0,
            Flag::Z => self.z == 0,
            Flag::N => self.n & 0x80 != 0,
            Flag::V => self.v & 0x80 != 0,
            Flag::S => (self.n ^ self.v ^ self.s) & 0x80 != 0,
            Flag::H => self.h & 0x08 != 0,
            Flag::T => self.t & 0x80 != 0,
            Flag::I => self.i & 0x80 != 0,
        }
    }

    /// Writes one flag and no other: S keeps its value when N or V alone change.
    #[inline(always)]
    pub const fn set(&mut self, flag: Flag, on: bool) {
        let s = self.n ^ self.v ^ self.s;
        match flag {
            Flag::C => self.c = bit(on),
            Flag::Z => self.z = !on as u8,
            Flag::N => self.n = bit(on),
            Flag::V => self.v = bit(on),
            Flag::H => self.h = (on as u8) << 3,
            Flag::T => self.t = bit(on),
            Flag::I => self.i = bit(on),
            Flag::S => {}
        }
        let s = if matches!(flag, Flag::S) { bit(on) } else { s };
        self.s = (self.n ^ self.v ^ s) & 0x80;
    }
}

#[cfg(test)]
mod tests {
    use super::{Flag, Flags};

    #[test]
    fn every_sreg_packs_back_and_every_flag_writes_only_itself() {
        let flags = [Flag::C, Flag::Z, Flag::N, Flag::V, Flag::S, Flag::H, Flag::T, Flag::I];
        for sreg in 0..=255u8 {
            assert_eq!(Flags::unpack(sreg).pack(), sreg);
            for flag in flags {
                for on in [false, true] {
                    let mut f = Flags::unpack(sreg);
                    f.set(flag, on);
                    let mask = 1 << flag as u8;
                    assert_eq!(f.pack(), sreg & !mask | if on { mask } else { 0 }, "{sreg:02x} {flag:?} {on}");
                    assert_eq!(f.get(flag), on);
                }
            }
        }
    }
}
