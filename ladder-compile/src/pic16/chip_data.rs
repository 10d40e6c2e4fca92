//! What the back end asks of a chip's row: registers and bits by name, and from which banks a byte can be reached.

use emu_pic16::chips::{FileSlot, Pic16Part};
use emu_pic16::periph::map::Sfr;

/// A set of banks, bit n for bank n.
pub type BankSet = u8;

/// All banks.
pub const ANY_BANK: BankSet = 0b1111;

/// A chip.
#[derive(Debug)]
pub struct Pic16ChipData {
    /// Its row.
    pub part: &'static Pic16Part,
    reach: [BankSet; 0x200],
}

impl Pic16ChipData {
    /// Looks at every address once.
    #[must_use]
    pub fn new(part: &'static Pic16Part) -> Self {
        let places = part.file_slots();
        let mut reach = [0; 0x200];
        for (addr, banks) in reach.iter_mut().enumerate() {
            let same = |bank: usize| match (places.get(addr), places.get(bank << 7 | addr & 0x7F)) {
                (Some(FileSlot::None), _) | (_, None) | (None, _) => bank == addr >> 7,
                (here, there) => here == there,
            };
            *banks = (0..4).filter(|&bank| same(bank)).fold(0, |set, bank| set | 1 << bank);
        }
        Pic16ChipData { part, reach }
    }

    /// The banks from which the byte at a data address is reached.
    #[must_use]
    pub fn reachable_banks(&self, addr: u16) -> BankSet {
        self.reach.get(usize::from(addr)).copied().unwrap_or(1)
    }

    /// Address of a register that the chip has.
    #[must_use]
    pub fn reg(&self, sfr: Sfr) -> u16 {
        self.part.addr(sfr).unwrap_or(0)
    }

    /// Address and number of a register's bit, by its name.
    #[must_use]
    pub fn bit(&self, name: &str) -> (u16, u8) {
        let found = self.part.bits.iter().find(|(_, bit, _)| *bit == name);
        found.map_or((0, 0), |&(sfr, _, bit)| (self.reg(sfr), bit))
    }

    /// Several bits of one register as a mask.
    #[must_use]
    pub fn mask(&self, names: &[&str]) -> u8 {
        names.iter().fold(0, |mask, name| mask | 1 << self.bit(name).1)
    }

    /// Whether a register has such a bit.
    #[must_use]
    pub fn has_bit(&self, name: &str) -> bool {
        self.part.bits.iter().any(|(_, bit, _)| *bit == name)
    }
}
