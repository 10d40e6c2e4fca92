//! What a chip family is, as data: one [`FamilyTraits`] for each [`ChipFamily`]. Tools read it instead of
//! naming families, so that a new family does not compile until its row is written.

use crate::chip::{Chip, ChipFamily};
use crate::image::{AVR_DATA, SymbolSpaces};
use crate::pins::PinLevel;

/// Properties that all chips of a family share.
#[derive(Debug)]
pub struct FamilyTraits {
    /// Name in JSON documents and in gdb's description of the target.
    pub id: &'static str,
    /// Name in messages.
    pub title: &'static str,
    /// Name of the supply in the data sheets.
    pub supply: &'static str,
    /// Name of the reset pin, and the level that holds the chip in reset.
    pub reset_pin: (&'static str, PinLevel),
    /// How a chip that its reset pin stops is described.
    pub reset_state: &'static str,
    /// True if the chip waits for its oscillator after power-up.
    pub has_start_up: bool,
    /// True if a pin can have a voltage between low and high.
    pub has_analog_levels: bool,
    /// True if the family is a controller that processes single bits, with latched inputs and a fixed period.
    pub is_bit_controller: bool,
    /// Number of addresses at the start of data memory that are registers of the core.
    pub registers_in_ram: u32,
    /// Address in ELF files of the first byte of data memory, where the files name that memory by an address.
    pub linked_data: Option<u32>,
    /// Memories for symbols from separate files of a linker; `None` if an image contains its symbols.
    pub symbol_spaces: Option<SymbolSpaces>,
    /// Mnemonics of the instructions that call a subroutine.
    pub calls: &'static [&'static str],
    /// Mnemonics of the instructions that return.
    pub returns: &'static [&'static str],
    /// gdb's base addresses of the memories; program memory is the first.
    pub gdb_memories: &'static [(&'static str, u32)],
    /// gdb's names for the architecture of chips without and with CALL and JMP; `None` if gdb does not know
    /// the family.
    pub gdb_architectures: Option<[&'static str; 2]>,
    /// True if C programs come from SDCC: a pointer names its memory, and registers are cells of RAM.
    pub has_sdcc_pointers: bool,
    /// Word of an instruction that calls the next one, which compilers use to allocate space on the stack.
    pub stack_allocation: Option<u16>,
    /// Directives of the family's assembly language.
    pub assembly: AssemblyWords,
    /// Beginnings of the names of the registers of timers.
    pub timer_registers: &'static [&'static str],
    /// Beginnings of the names of the registers of serial ports.
    pub uart_registers: &'static [&'static str],
    /// Beginnings of the names of the registers of interrupts.
    pub interrupt_registers: &'static [&'static str],
}

/// Directives of an assembly language.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AssemblyWords {
    /// Directive that places a program word.
    pub data: &'static str,
    /// Directive that sets the address.
    pub org: &'static str,
    /// What skipped bytes are filled with: the second argument of `.org` with its comma, or nothing.
    pub filler: &'static str,
    /// True if a source names its chip without `pic` in `list`, and ends with `end`.
    pub is_mpasm: bool,
}

const AVR: FamilyTraits = FamilyTraits {
    id: "avr",
    title: "AVR",
    supply: "VCC",
    reset_pin: ("RESET", PinLevel::Low),
    reset_state: "held in reset",
    has_start_up: true,
    has_analog_levels: true,
    is_bit_controller: false,
    registers_in_ram: 32,
    linked_data: Some(AVR_DATA),
    symbol_spaces: None,
    calls: &["call", "rcall", "icall", "eicall"],
    returns: &["ret", "reti"],
    gdb_memories: &[("flash", 0), ("data", 0x80_0000), ("eeprom", 0x81_0000), ("fuse", 0x82_0000), ("lock", 0x83_0000)],
    gdb_architectures: Some(["avr:4", "avr:5"]),
    has_sdcc_pointers: false,
    // `rcall .+0`.
    stack_allocation: Some(0xD000),
    assembly: AssemblyWords { data: ".word", org: ".org", filler: ", 0xFF", is_mpasm: false },
    timer_registers: &["TCCR", "TCNT", "OCR", "ICR", "TIMSK", "TIFR", "ETIMSK", "ETIFR", "ASSR", "GTCCR", "SFIOR"],
    uart_registers: &["UDR", "UCSR", "UBRR"],
    interrupt_registers: &["EIMSK", "EIFR", "EICR", "PCICR", "PCIFR", "PCMSK", "GICR", "GIFR", "TIMSK", "TIFR"],
};

const MCS51: FamilyTraits = FamilyTraits {
    id: "mcs51",
    title: "8051",
    supply: "VDD",
    reset_pin: ("RST", PinLevel::High),
    reset_state: "held in reset",
    has_start_up: false,
    has_analog_levels: false,
    is_bit_controller: false,
    registers_in_ram: 0,
    linked_data: None,
    symbol_spaces: Some(SymbolSpaces::MCS51),
    calls: &["lcall", "acall"],
    returns: &["ret", "reti"],
    gdb_memories: &[("code", 0), ("idata", 0x80_0000), ("sfr", 0x81_0000), ("xdata", 0x82_0000), ("bit", 0x83_0000)],
    gdb_architectures: None,
    has_sdcc_pointers: true,
    stack_allocation: None,
    assembly: AssemblyWords { data: ".db", org: ".org", filler: "", is_mpasm: false },
    timer_registers: &["TCON", "TMOD", "TL", "TH", "T2CON", "T2MOD", "RCAP2"],
    uart_registers: &["SCON", "SBUF", "PCON"],
    interrupt_registers: &["IE", "IP", "TCON", "SCON"],
};

const PIC16: FamilyTraits = FamilyTraits {
    id: "pic16",
    title: "PIC16",
    supply: "VDD",
    reset_pin: ("MCLR", PinLevel::Low),
    reset_state: "held in reset",
    has_start_up: true,
    has_analog_levels: true,
    is_bit_controller: false,
    registers_in_ram: 0,
    linked_data: None,
    symbol_spaces: Some(SymbolSpaces::PIC16),
    calls: &["call"],
    returns: &["return", "retlw", "retfie"],
    gdb_memories: &[("flash", 0), ("data", 0x80_0000), ("eeprom", 0x81_0000), ("config", 0x82_0000)],
    gdb_architectures: None,
    has_sdcc_pointers: false,
    stack_allocation: None,
    assembly: AssemblyWords { data: "dw", org: "org", filler: "", is_mpasm: true },
    timer_registers: &["OPTION_REG", "TMR", "T1CON", "T2CON", "PR2", "CCP"],
    uart_registers: &["TXSTA", "RCSTA", "TXREG", "RCREG", "SPBRG"],
    interrupt_registers: &["INTCON", "PIE", "PIR"],
};

const AP101: FamilyTraits = FamilyTraits {
    id: "ap101",
    title: "AP101",
    supply: "VDD",
    reset_pin: ("POWER", PinLevel::Low),
    reset_state: "without supply",
    has_start_up: false,
    has_analog_levels: false,
    is_bit_controller: true,
    registers_in_ram: 0,
    linked_data: None,
    symbol_spaces: None,
    calls: &[],
    returns: &[],
    gdb_memories: &[
        ("code", 0),
        ("m", 0x80_0000),
        ("i", 0x81_0000),
        ("e", 0x82_0000),
        ("r", 0x83_0000),
        ("preset", 0x84_0000),
        ("value", 0x85_0000),
    ],
    gdb_architectures: None,
    has_sdcc_pointers: false,
    stack_allocation: None,
    assembly: AssemblyWords { data: ".word", org: ".org", filler: "", is_mpasm: false },
    timer_registers: &[],
    uart_registers: &[],
    interrupt_registers: &[],
};

impl ChipFamily {
    /// The properties of the family.
    #[must_use]
    pub const fn traits(self) -> &'static FamilyTraits {
        match self {
            ChipFamily::Avr => &AVR,
            ChipFamily::Mcs51 => &MCS51,
            ChipFamily::Pic16 => &PIC16,
            ChipFamily::Ap101 => &AP101,
        }
    }
}

impl Chip {
    /// The properties of the chip's family.
    #[must_use]
    pub const fn family_traits(&self) -> &'static FamilyTraits {
        self.family.traits()
    }

    /// Returns true if the chip is a controller that processes single bits.
    #[must_use]
    pub const fn is_bit_controller(&self) -> bool {
        self.family.traits().is_bit_controller
    }

    /// Returns true if gdb knows the chips, so that its users expect values as it prints them.
    #[must_use]
    pub const fn is_known_to_gdb(&self) -> bool {
        self.family.traits().gdb_architectures.is_some()
    }

    /// Returns true if C programs for the chip come from SDCC: a pointer names its memory.
    #[must_use]
    pub const fn has_sdcc_pointers(&self) -> bool {
        self.family.traits().has_sdcc_pointers
    }

    /// The address that ELF files and gdb use for an address of data memory; `None` for other memories, and
    /// for families whose files name the memory itself.
    #[must_use]
    pub fn linked_address(&self, space: &str, addr: u32) -> Option<u32> {
        self.family.traits().linked_data.filter(|_| space == self.ram_space).map(|base| base + addr)
    }
}
