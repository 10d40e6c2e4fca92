//! Chip data for the back end: registers and bits by name, and the banks from which a byte can be accessed.

use emu_pic16::chips::{FileSlot, Pic16Part, SfrBit};
use emu_pic16::periph::map::Sfr;

/// A set of banks: bit n represents bank n.
pub type BankSet = u8;

/// All banks.
pub const ANY_BANK: BankSet = 0b1111;

/// Chip data with the reachability of each address.
#[derive(Debug)]
pub struct Pic16ChipData {
    /// Description of the chip.
    pub part: &'static Pic16Part,
    /// Reachable banks of each data address.
    reach: [BankSet; 0x200],
}

impl Pic16ChipData {
    /// Computes the reachable banks of every address.
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

    /// Banks from which the byte at a data address can be accessed.
    #[must_use]
    pub fn reachable_banks(&self, addr: u16) -> BankSet {
        self.reach.get(usize::from(addr)).copied().unwrap_or(1)
    }

    /// Address of a register that the chip has.
    #[must_use]
    pub fn reg(&self, sfr: Sfr) -> u16 {
        self.part.addr(sfr).unwrap_or(0)
    }

    /// Address and bit number of a register bit, by its name.
    #[must_use]
    pub fn bit(&self, name: &str) -> (u16, u8) {
        let found = self.part.bits.iter().find(|SfrBit { name: bit, .. }| *bit == name);
        found.map_or((0, 0), |&SfrBit { sfr, bit, .. }| (self.reg(sfr), bit))
    }

    /// Mask of several bits of one register.
    #[must_use]
    pub fn mask(&self, names: &[&str]) -> u8 {
        names.iter().fold(0, |mask, name| mask | 1 << self.bit(name).1)
    }

    /// True if a register has a bit with this name.
    #[must_use]
    pub fn has_bit(&self, name: &str) -> bool {
        self.part.bits.iter().any(|SfrBit { name: bit, .. }| *bit == name)
    }
}
