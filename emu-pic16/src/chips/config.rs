//! Configuration words and what they say (data sheets, "Special features of the CPU").

use emu_core::pins::PinId;

/// Configuration words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConfigLayout {
    /// Word addresses: 2007h, and 2008h where there are two.
    pub words: &'static [u16],
    /// What erased words read: unimplemented bits as the data sheet has them.
    pub erased: &'static [u16],
    /// Mask of FOSC in the first word, and what its values mean, in order of the bits gathered.
    pub fosc: (u16, &'static [OscillatorMode]),
    /// Bits of port A that the oscillator leaves to the port, by the values of FOSC; empty where the oscillator has pins of its
    /// own.
    pub osc_ports: &'static [u8],
    /// FCMEN in the second word: the fail-safe clock monitor; 0 where there is none.
    pub fcmen: u16,
    /// IESO in the second word: two-speed start-up; 0 where there is none.
    pub ieso: u16,
    /// WDTE in the first word.
    pub wdte: u16,
    /// PWRTE in the first word, and its value when the timer is on.
    pub pwrte: (u16, bool),
    /// BOREN (BODEN) in the first word; 0 where there is none.
    pub boren: u16,
    /// MCLRE in the first word; 0 where the pin always resets.
    pub mclre: u16,
    /// LVP in the first word; 0 where there is none.
    pub lvp: u16,
    /// The pin that is PGM, and no port, while LVP is 1; [`super::NO_PIN`] where there is none.
    pub pgm: PinId,
    /// CCPMX in the first word; 0 where there is none. With the pin of CCP1 when it is 1 and when it is 0.
    pub ccpmx: (u16, PinId, PinId),
    /// CPD in the first word; 0 where there is none.
    pub cpd: u16,
    /// Mask of the code protection bits in the first word.
    pub cp: u16,
    /// What code protection keeps the program itself from writing: mask of the lower of the two equal fields of CP, and the
    /// first protected program word for each of its values (FFFFh: none). Empty where it keeps the program from nothing.
    pub cp_first: (u16, &'static [u16]),
    /// What WRT keeps the program itself from writing: mask in the first word, then the first word that it may
    /// write for each value of the bits gathered. An empty list where it may write all.
    pub wrt: (u16, &'static [u16]),
}

/// What clocks the chip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OscillatorMode {
    /// Crystal, low power: start-up timer.
    Lp,
    /// Crystal: start-up timer.
    Xt,
    /// Fast crystal: start-up timer.
    Hs,
    /// Clock from outside.
    Ec,
    /// Resistor and capacitor.
    Rc,
    /// On the chip; what becomes of the pins is in [`ConfigLayout::osc_ports`].
    Internal,
}

/// The bits of `word` under `mask`, side by side.
const fn extract_bits(word: u16, mask: u16) -> usize {
    let (mut value, mut at, mut bit) = (0, 0, 0);
    while bit < 16 {
        if mask >> bit & 1 == 1 {
            value |= ((word >> bit & 1) as usize) << at;
            at += 1;
        }
        bit += 1;
    }
    value
}

impl ConfigLayout {
    /// `value` spread over the bits of `mask`, lowest first.
    #[must_use]
    pub const fn deposit_bits(value: usize, mask: u16) -> u16 {
        let (mut word, mut at, mut bit) = (0, 0, 0);
        while bit < 16 {
            if mask >> bit & 1 == 1 {
                word |= ((value >> at & 1) as u16) << bit;
                at += 1;
            }
            bit += 1;
        }
        word
    }

    /// What clocks the chip by the first word.
    #[must_use]
    pub fn oscillator_mode(&self, word: u16) -> OscillatorMode {
        self.fosc.1.get(extract_bits(word, self.fosc.0)).copied().unwrap_or(OscillatorMode::Rc)
    }

    /// Bits of port A that share their pins with the oscillator and are ports by the first word.
    #[must_use]
    pub fn ports_of_oscillator(&self, word: u16) -> u8 {
        self.osc_ports.get(extract_bits(word, self.fosc.0)).copied().unwrap_or(0)
    }

    /// Whether the power-up timer runs at power-on by the first word: by PWRTE, and always where brown-outs reset (DS30292, 12.7;
    /// DS39582, 14.6).
    #[must_use]
    pub fn has_power_up_timer(&self, word: u16) -> bool {
        (word & self.pwrte.0 != 0) == self.pwrte.1 || word & self.boren != 0
    }

    /// The pin of CCP1 by the first word, where CCPMX moves it.
    #[must_use]
    pub fn ccp1(&self, word: u16) -> Option<PinId> {
        let (mask, one, zero) = self.ccpmx;
        (mask != 0).then_some(if word & mask != 0 { one } else { zero })
    }

    /// Whether the program may write the program word at `addr` by the first word; that it can write program memory at all
    /// is a matter of [`super::Pic16Part::memory`].
    #[must_use]
    pub fn may_write(&self, word: u16, addr: u16) -> bool {
        let value = |(mask, list): (u16, &'static [u16])| list.get(extract_bits(word, mask)).copied();
        addr >= value(self.wrt).unwrap_or(0) && addr < value(self.cp_first).unwrap_or(u16::MAX)
    }
}
