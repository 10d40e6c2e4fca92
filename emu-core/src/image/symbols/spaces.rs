//! The memories of symbols, by family.

/// The family of a file of symbols, which determines how the emulated chip names its memories.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SymbolSpaces {
    /// SDCC for MCS-51: `code` (program memory, bytes 0 to 0xFFFF), `idata` (internal RAM by indirect
    /// address, 0 to 0xFF: SDCC's `data`, `idata`, overlays, banks and stack), `sfr` (0x80 to 0xFF), `xdata`
    /// (0 to 0xFFFF, including SDCC's `pdata`), `bit` (bit addresses 0 to 0xFF).
    Mcs51,
    /// gputils for mid-range PICs: `flash` (byte addresses, two per word, 0 to 0x3FFF), `data` (0 to 0x1FF),
    /// `eeprom` (bytes, from the word address 0x2100 on), `config` (bytes, from the word address 0x2000 on).
    Pic16,
}

impl SymbolSpaces {
    /// The memories of the emulated 8051.
    pub const MCS51: Self = SymbolSpaces::Mcs51;
    /// The memories of the emulated mid-range PICs.
    pub const PIC16: Self = SymbolSpaces::Pic16;
}

/// The memories of both families, in the order in which symbols are listed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(in crate::image) enum MemorySpace {
    Code,
    Idata,
    Sfr,
    Xdata,
    Bit,
    Flash,
    Data,
    Eeprom,
    Config,
}

impl MemorySpace {
    /// The name of the memory in the chip rows.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            MemorySpace::Code => "code",
            MemorySpace::Idata => "idata",
            MemorySpace::Sfr => "sfr",
            MemorySpace::Xdata => "xdata",
            MemorySpace::Bit => "bit",
            MemorySpace::Flash => "flash",
            MemorySpace::Data => "data",
            MemorySpace::Eeprom => "eeprom",
            MemorySpace::Config => "config",
        }
    }

    /// The last address of the memory.
    pub(crate) const fn last_address(self) -> u32 {
        match self {
            MemorySpace::Code | MemorySpace::Xdata => 0xFFFF,
            MemorySpace::Idata | MemorySpace::Sfr | MemorySpace::Bit | MemorySpace::Eeprom => 0xFF,
            MemorySpace::Flash => 0x3FFF,
            MemorySpace::Data | MemorySpace::Config => 0x1FF,
        }
    }
}
