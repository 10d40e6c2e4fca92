//! Layout and meaning of the configuration words (data sheets, "Special features of the CPU").

use emu_core::pins::PinId;

/// Layout of a chip's configuration words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConfigLayout {
    /// Word addresses: 2007h, and 2008h on chips with two words.
    pub words: &'static [u16],
    /// Value of erased words, with unimplemented bits as in the data sheet.
    pub erased: &'static [u16],
    /// Mask of FOSC in the first word, and the modes by its value, with the bits gathered.
    pub fosc: (u16, &'static [OscillatorMode]),
    /// Mask of the port A bits that are ports although they share pins with the oscillator, by value of FOSC;
    /// empty if the oscillator has dedicated pins.
    pub osc_ports: &'static [u8],
    /// Mask of FCMEN in the second word, the fail-safe clock monitor; 0 if the chip has none.
    pub fcmen: u16,
    /// Mask of IESO in the second word, two-speed start-up; 0 if the chip has none.
    pub ieso: u16,
    /// Mask of WDTE in the first word.
    pub wdte: u16,
    /// Mask of PWRTE in the first word, and its value if the power-up timer is on.
    pub pwrte: (u16, bool),
    /// Mask of BOREN (BODEN) in the first word; 0 if the chip has none.
    pub boren: u16,
    /// Mask of MCLRE in the first word; 0 if the pin is always a reset input.
    pub mclre: u16,
    /// Mask of LVP in the first word; 0 if the chip has none.
    pub lvp: u16,
    /// Pin that is PGM instead of a port while LVP is 1; [`super::NO_PIN`] if the chip has none.
    pub pgm: PinId,
    /// Mask of CCPMX in the first word, 0 if the chip has none; then the pin of CCP1 if it is 1, and if it is
    /// 0.
    pub ccpmx: (u16, PinId, PinId),
    /// Mask of CPD in the first word; 0 if the chip has none.
    pub cpd: u16,
    /// Mask of the code protection bits in the first word.
    pub cp: u16,
    /// Words that code protection keeps the program itself from writing: mask of the lower of the two equal
    /// CP fields, and the first protected program word for each value (FFFFh: none). Empty if nothing is
    /// protected.
    pub cp_first: (u16, &'static [u16]),
    /// Words that WRT keeps the program itself from writing: mask in the first word, and the first writable
    /// word for each value, with the bits gathered. Empty if all words are writable.
    pub wrt: (u16, &'static [u16]),
}

/// Clock source of the chip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OscillatorMode {
    /// Low-power crystal, with start-up timer.
    Lp,
    /// Crystal, with start-up timer.
    Xt,
    /// Fast crystal, with start-up timer.
    Hs,
    /// External clock.
    Ec,
    /// External resistor and capacitor.
    Rc,
    /// Internal oscillator; [`ConfigLayout::osc_ports`] gives the use of the pins.
    Internal,
}

/// Gathers the bits of `word` under `mask` into adjacent bits.
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
    /// Distributes `value` over the bits of `mask`, lowest bit first.
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

    /// Returns the clock source selected by the first word.
    #[must_use]
    pub fn oscillator_mode(&self, word: u16) -> OscillatorMode {
        self.fosc.1.get(extract_bits(word, self.fosc.0)).copied().unwrap_or(OscillatorMode::Rc)
    }

    /// Returns the port A bits that share pins with the oscillator and that the first word makes ports.
    #[must_use]
    pub fn ports_of_oscillator(&self, word: u16) -> u8 {
        self.osc_ports.get(extract_bits(word, self.fosc.0)).copied().unwrap_or(0)
    }

    /// Reports whether the power-up timer runs at power-on, by the first word: by PWRTE, and always if
    /// brown-out reset is on (DS30292, 12.7; DS39582, 14.6).
    #[must_use]
    pub fn has_power_up_timer(&self, word: u16) -> bool {
        (word & self.pwrte.0 != 0) == self.pwrte.1 || word & self.boren != 0
    }

    /// Returns the pin of CCP1 by the first word, if CCPMX selects it.
    #[must_use]
    pub fn ccp1(&self, word: u16) -> Option<PinId> {
        let (mask, one, zero) = self.ccpmx;
        (mask != 0).then_some(if word & mask != 0 { one } else { zero })
    }

    /// Reports whether the first word allows the program to write the program word at `addr`. Whether it can
    /// write program memory at all depends on [`super::Pic16Part::memory`].
    #[must_use]
    pub fn may_write(&self, word: u16, addr: u16) -> bool {
        let value = |(mask, list): (u16, &'static [u16])| list.get(extract_bits(word, mask)).copied();
        addr >= value(self.wrt).unwrap_or(0) && addr < value(self.cp_first).unwrap_or(u16::MAX)
    }
}
