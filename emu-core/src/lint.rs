//! Lints: reports of suspicious but legal behaviour of a program, which a [`Probe`](crate::cpu::Probe) can
//! request.

use std::fmt;

use diag::DiagnosticCode;

/// A suspicious but legal action of a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Lint {
    /// The program read a port with pins that are analog inputs. These read 0 at any level.
    AnalogRead {
        /// Address of the port.
        port: u16,
        /// The pins, one bit each.
        bits: u8,
    },
    /// A read-modify-write instruction changed bits of a port's latch that it does not name, because their
    /// pins did not have the level of the latch.
    ForeignLatch {
        /// Address of the port.
        port: u16,
        /// The changed bits.
        bits: u8,
    },
    /// A call or an interrupt overwrote the oldest return address of the stack.
    StackOverflow,
    /// A return used an address that no call had pushed.
    StackUnderflow,
    /// A jump or call left its page with upper address bits that code in another page had set.
    Page {
        /// Target of the jump, in program words.
        target: u16,
    },
    /// A service routine returned with a changed value in a register.
    NotSaved {
        /// The register.
        register: &'static str,
    },
    /// The program read RAM that was never written since power-up (machines that only observe reads).
    UnknownRead {
        /// The memory, as named in the chip row.
        space: &'static str,
        /// Address in that memory.
        addr: u16,
    },
    /// A sleep instruction did nothing, because a wake-up flag was already set and no interrupt follows from
    /// it.
    SleepIgnored,
    /// The value of a RAM byte or register that was never written since power-up had an effect (machines that
    /// track values).
    UnknownUse {
        /// The memory, as named in the chip row.
        space: &'static str,
        /// Address in that memory, also of a register where registers have addresses there.
        addr: u16,
    },
    /// The stack grew down over other data: static data, the heap, or the start of RAM.
    StackMeets {
        /// The lowest address that the stack may use.
        limit: u16,
    },
    /// The program wrote to an address of data memory where nothing is implemented.
    NothingThere {
        /// The address.
        addr: u16,
    },
    /// The program wrote ones to reserved bits of a register.
    ReservedBits {
        /// Address of the register.
        addr: u16,
        /// The reserved bits that were written as ones.
        bits: u8,
    },
    /// A serial port sends or receives at a rate more than 2.5 % off the nearest standard baud rate.
    Baud {
        /// Number of the port, from 0.
        uart: u8,
        /// Its baud rate.
        baud: u32,
    },
    /// An interrupt was taken that has no service routine.
    NoHandler {
        /// Number of its vector.
        vector: u8,
    },
    /// An interrupt is enabled that has no service routine.
    Unhandled {
        /// Number of its vector.
        vector: u8,
    },
    /// The level of pins that nothing drives had an effect.
    FloatingRead {
        /// Address of the port.
        port: u16,
        /// The pins, one bit each.
        bits: u8,
    },
    /// An instruction accesses a bit that the controller does not have: reads give 0, writes do nothing.
    NoSuchBit {
        /// The zone, as its memory is named in the chip row.
        space: &'static str,
        /// Address in that zone.
        addr: u16,
    },
    /// The program writes an input. The value is lost at the next sampling, or is never stored.
    InputWritten {
        /// Address of the input.
        addr: u16,
    },
    /// The preset port of a timer or counter is used for something else than writing a preset.
    PresetPort {
        /// Number of the module.
        module: u16,
        /// What is wrong.
        why: &'static str,
    },
    /// An instruction without an operand has a nonzero operand field.
    OddField {
        /// The instruction word.
        word: u16,
    },
    /// A capture register was written in a mode in which it is not TOP. Silicon accepts that, contrary to the
    /// data sheet.
    CaptureWritten {
        /// Address of its low byte.
        addr: u16,
    },
    /// An edge on an external interrupt ended a sleep. Silicon does that, contrary to the data sheet.
    EdgeWoke {
        /// The number of the input INT.
        int: u8,
    },
    /// The converter is set to a channel whose pin does not exist in the chosen package.
    ChannelAbsent {
        /// Number of the channel.
        channel: u8,
    },
    /// A conversion starts before the holding capacitor of the converter has had time to charge.
    EarlyConversion {
        /// Number of the analog input.
        channel: u8,
    },
}

/// The codes of all lints.
#[rustfmt::skip]
pub const LINT_CODES: &[DiagnosticCode] = &[
    DiagnosticCode { code: "LINT001", title: "a port is read whose pins are analog inputs",
        explain: "A pin that is an analog input reads 0 whatever its level. After power-up most pins that can be analog are. \
                  BTFSC and BTFSS are held to the pin that they test, other instructions that read the port to all of its \
                  pins. Mend: make the pins digital first: ADCON1, ANSEL or CMCON, by chip." },
    DiagnosticCode { code: "LINT002", title: "bits of a port's latch are changed along with others",
        explain: "BSF, BCF, IORWF, ANDWF and XORWF read all pins of a port and write all of its latch. A pin that is not at the \
                  level of its latch (an input, a pin with a load, one that was written just before, an analog one) changes its \
                  latch so, which shows when it becomes an output. Mend: keep a copy of the port in RAM, change that and write \
                  it whole." },
    DiagnosticCode { code: "LINT003", title: "the stack is full",
        explain: "The stack of a PIC16 has eight places, and a call or an interrupt takes one. The ninth overwrites the oldest \
                  return address, and nothing tells the program. Mend: nest fewer calls, and leave a place for the interrupt." },
    DiagnosticCode { code: "LINT004", title: "a return without a call",
        explain: "RETURN, RETLW or RETFIE with an empty stack goes to whatever address its place holds: often an old one. Mend: \
                  leave by GOTO what was reached by GOTO." },
    DiagnosticCode { code: "LINT005", title: "a jump or call into a page that was not chosen here",
        explain: "GOTO and CALL take the upper bits of their target from PCLATH. This one left its page, but PCLATH was last \
                  written by code in another page: by a routine that was called, or by the caller. Mend: set PCLATH before the \
                  jump or call (pagesel), and again after a call into another page." },
    DiagnosticCode { code: "LINT006", title: "a service routine changes what it interrupts",
        explain: "After RETFIE a register holds something else than when the interrupt came, so the interrupted code goes on \
                  with a wrong W, wrong flags or bank, or a wrong page. Mend: save W, STATUS and PCLATH first in the service \
                  routine and restore them last, with SWAPF, which leaves the flags alone." },
    DiagnosticCode { code: "LINT007", title: "RAM or a register is read that was never written",
        explain: "After power-up RAM holds anything, and something else on the next chip; so do the registers of an AVR. The \
                  emulator fills them with zeros unless --ram says otherwise, so such a program may run well here and fail on \
                  the desk. Bytes that the image fills count as written; every byte is told of once. On AVR values are \
                  followed bit by bit, and it is told where they first make a difference: in a branch, an address, a register \
                  of the chip. Mend: write it first." },
    DiagnosticCode { code: "LINT008", title: "SLEEP does nothing",
        explain: "SLEEP is a NOP while an interrupt flag and its enable bit are set, and with GIE clear nothing else tells of it. \
                  A flag that nothing clears makes every SLEEP a NOP. Mend: clear the flag before SLEEP." },
    DiagnosticCode { code: "LINT009", title: "the stack grows over what lies below it",
        explain: "The stack grows down, and static data and the heap up. Where a push, a call, an interrupt or a frame reaches \
                  below the end of static data (of the heap, where malloc has grown it), variables and return addresses \
                  overwrite each other. Without symbols only the beginning of RAM is known. A stack that a program places in \
                  static data itself, as those of tasks, is held to the beginning of RAM. Mend: smaller buffers and frames, \
                  less recursion." },
    DiagnosticCode { code: "LINT010", title: "a write to an address where nothing is",
        explain: "The address is reserved, or beyond the end of RAM. Reserved addresses are never to be written, says the data \
                  sheet. Often the image is for another chip, or a pointer is wild. Mend: look at the address." },
    DiagnosticCode { code: "LINT011", title: "reserved bits are written as ones",
        explain: "Reserved bits are to be written as zeros, says the data sheet, for later chips give them a meaning. Often the \
                  number of a bit is wrong, or the image is for another chip. Not told of absent pins of a port, and of flags \
                  that ones clear. Mend: write zeros there." },
    DiagnosticCode { code: "LINT012", title: "a baud rate is more than 2.5 % off",
        explain: "Both sides of an asynchronous line may differ by a few percent in all before bits are read wrong, so each \
                  should be within some 2 % of the rate; 2.1 %, as 115200 baud has at 16 MHz, is usual and accepted. The rate is worked out from the clock after CLKPR, UBRR and U2X, and held \
                  against the nearest usual one (300 to 2000000 baud). Mend: U2X, another UBRR, or a crystal that divides well." },
    DiagnosticCode { code: "LINT013", title: "an interrupt is taken that has no service routine",
        explain: "Its vector is erased, or jumps back to the beginning, as avr-libc has it where a program defines no routine: the \
                  program starts over without a reset. Mend: write an ISR for it (a misspelt name of a vector makes none), or do \
                  not enable it." },
    DiagnosticCode { code: "LINT014", title: "an interrupt is enabled that has no service routine",
        explain: "Its enable bit is set, and so is I in SREG; when its flag comes, the program jumps into an erased vector or \
                  back to the beginning. Mend: write an ISR for it, or do not enable it." },
    DiagnosticCode { code: "LINT015", title: "a pin is read on which nothing stands",
        explain: "The pin is an input without pull-up, and nothing outside drives it: on the desk it reads anything, and picks up \
                  what is near it. Told where the bit makes a difference, once a pin: a port may be read whole if bits of such \
                  pins are masked out. Mend: turn on its pull-up, or drive it (--set PD2=1, --set PD2=pullup)." },
    DiagnosticCode { code: "LINT016", title: "a bit that the controller does not have",
        explain: "The address has no channel or no module behind it: E 256 to 511 and R 384 to 511 never have, inputs and outputs \
                  only as many as the configuration says, R as it has modules. It reads 0, and what is written is lost. With an \
                  index the address is meant that it leads to. Mend: configure the channel or module, or look at the address." },
    DiagnosticCode { code: "LINT017", title: "an input is written",
        explain: "STO and STOC to an input change its latch until inputs are sampled again; where inputs are read live there is no \
                  latch, and nothing happens. STC and RTC are for outputs, timers and memory only; a raw word that names an \
                  input does the same. Mend: write an output or a bit of M." },
    DiagnosticCode { code: "LINT018", title: "a preset port is misused",
        explain: "R256 to R383 take the presets of modules 0 to 127: STO to the port, then a NOP with bit 11 clear, whose field is \
                  the preset. Any other write does nothing, and the port reads 0. Mend: write TIM Rn,#d, which makes both words." },
    DiagnosticCode { code: "LINT019", title: "a field of an instruction is not empty",
        explain: "NOT and CLR have no operand, and execute whatever their lower twelve bits are. The words B000h and C000h are the \
                  plain ones; others are often data that the program runs into. Mend: look at the address." },
    DiagnosticCode { code: "LINT020", title: "a program relies on silicon against its data sheet",
        explain: "It writes ICR1 or ICR3 in a mode that does not have that as TOP, or an edge on INT0 or INT1 wakes it from a sleep \
                  in which the I/O clock stands. The data sheet says that the one has no effect and that only a low level does \
                  the other; boards do both, and so does the emulator. --reading icr-write=top and --reading int-wake=level \
                  take the sheet by its letter. Mend: choose the mode before ICR is written; wake by a level or a pin change." },
    DiagnosticCode { code: "LINT021", title: "a channel of the converter has no pin in this package",
        explain: "ADC6 and ADC7 of ATmega8 and ATmega48 to 328 are pins of the packages with 32 pins alone. In the package that \
                  --package names the channel converts to 0 here, and to anything on a board. Mend: choose another channel, or \
                  the package of the board; without --package the chip has the pins of all." },
    DiagnosticCode { code: "LINT022", title: "a conversion begins before the acquisition time has passed",
        explain: "The holding capacitor of the converter charges through the source of the selected channel, and what it holds as \
                  GO is set is converted. The time runs from the write that turns the converter on or selects the channel, and \
                  after a conversion from 2 TAD behind its end: 19.7 us with the 10 bits of most chips and 12 us with 8, by the \
                  equation of the data sheet for a source of 10 kilohms at 50 degrees. Earlier the result leans to the channel \
                  before. Fix: wait between the selection and GO." },
];

/// The usual baud rates of serial lines, and those of MIDI, S.BUS and DMX512.
const STANDARD_BAUDS: [u32; 26] = [
    110, 150, 300, 600, 1_200, 2_400, 4_800, 9_600, 14_400, 19_200, 28_800, 31_250, 38_400, 57_600, 76_800, 100_000,
    115_200, 128_000, 230_400, 250_000, 256_000, 460_800, 500_000, 921_600, 1_000_000, 2_000_000,
];

/// Returns the standard baud rate with the smallest relative distance to `baud`.
#[must_use]
pub fn nearest_standard_baud(baud: u32) -> u32 {
    let off = |usual: u32| u64::from(baud.abs_diff(usual)) * 1_000_000 / u64::from(usual);
    STANDARD_BAUDS.into_iter().min_by_key(|&usual| off(usual)).unwrap_or(baud)
}

impl Lint {
    /// The row of this lint in [`LINT_CODES`].
    #[must_use]
    pub const fn code_row(&self) -> &'static DiagnosticCode {
        let row = match self {
            Lint::AnalogRead { .. } => 0,
            Lint::ForeignLatch { .. } => 1,
            Lint::StackOverflow => 2,
            Lint::StackUnderflow => 3,
            Lint::Page { .. } => 4,
            Lint::NotSaved { .. } => 5,
            Lint::UnknownRead { .. } | Lint::UnknownUse { .. } => 6,
            Lint::SleepIgnored => 7,
            Lint::StackMeets { .. } => 8,
            Lint::NothingThere { .. } => 9,
            Lint::ReservedBits { .. } => 10,
            Lint::Baud { .. } => 11,
            Lint::NoHandler { .. } => 12,
            Lint::Unhandled { .. } => 13,
            Lint::FloatingRead { .. } => 14,
            Lint::NoSuchBit { .. } => 15,
            Lint::InputWritten { .. } => 16,
            Lint::PresetPort { .. } => 17,
            Lint::OddField { .. } => 18,
            Lint::CaptureWritten { .. } | Lint::EdgeWoke { .. } => 19,
            Lint::ChannelAbsent { .. } => 20,
            Lint::EarlyConversion { .. } => 21,
        };
        &LINT_CODES[row]
    }

    /// The stable code.
    #[must_use]
    pub const fn code(&self) -> &'static str {
        self.code_row().code
    }

    /// What to do about it: one sentence.
    #[must_use]
    pub const fn hint(&self) -> &'static str {
        match self {
            Lint::AnalogRead { .. } => "make the pins digital first (ADCON1, ANSEL, CMCON)",
            Lint::ForeignLatch { .. } => "keep a copy of the port in RAM, change that and write it whole",
            Lint::StackOverflow => "the stack has eight places, interrupts included; nest fewer calls",
            Lint::StackUnderflow => "return only from what was called",
            Lint::Page { .. } => "set PCLATH before the jump or call, and again after a call into another page",
            Lint::NotSaved { .. } => "save W, STATUS and PCLATH first in the service routine and restore them last",
            Lint::UnknownRead { .. } => "write the cell first; after power-up RAM holds anything",
            Lint::SleepIgnored => "clear the flag before SLEEP",
            Lint::UnknownUse { .. } => "write it first; after power-up it holds anything",
            Lint::StackMeets { .. } => "smaller buffers and frames, less recursion",
            Lint::NothingThere { .. } => "look at the address; is the image for this chip?",
            Lint::ReservedBits { .. } => "write reserved bits as zeros; is the image for this chip?",
            Lint::Baud { .. } => "try U2X, another UBRR, or a crystal that divides well; --clock gives its frequency",
            Lint::NoHandler { .. } | Lint::Unhandled { .. } => "write a service routine for it, or do not enable it",
            Lint::FloatingRead { .. } => "turn on the pull-up, or drive the pin (--set PIN=LEVEL)",
            Lint::NoSuchBit { .. } => "configure the channel or module, or look at the address",
            Lint::InputWritten { .. } => "write an output or a bit of M",
            Lint::PresetPort { .. } => "write STO to the port and behind it a NOP with the preset: TIM Rn,#d",
            Lint::OddField { .. } => "look at the address: the program may run into data",
            Lint::CaptureWritten { .. } => {
                "choose the mode first: then silicon (--reading icr-write=any) and data sheet (top) agree"
            }
            Lint::EdgeWoke { .. } => {
                "wake by a low level or a pin change; --reading int-wake=level does as the data sheet says"
            }
            Lint::ChannelAbsent { .. } => "choose another channel, or the package of the board (--package)",
            Lint::EarlyConversion { .. } => {
                "wait some 20 us after the channel is selected, and 2 TAD more after a conversion, before GO is set"
            }
        }
    }
}

impl fmt::Display for Lint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Lint::AnalogRead { port, bits } => {
                write!(
                    f,
                    "the port at 0x{port:02x} is read, of which the bits 0x{bits:02x} are analog inputs and read 0"
                )
            }
            Lint::ForeignLatch { port, bits } => {
                write!(
                    f,
                    "the bits 0x{bits:02x} of the latch of the port at 0x{port:02x} are changed along with others"
                )
            }
            Lint::StackOverflow => f.write_str("the stack is full: the oldest return address is overwritten"),
            Lint::StackUnderflow => f.write_str("a return without a call"),
            Lint::Page { target } => {
                write!(f, "goes to 0x{target:04x}, in a page that PCLATH was not set for in this one")
            }
            Lint::NotSaved { register } => write!(f, "the service routine returns with another value in {register}"),
            Lint::UnknownRead { space, addr } => write!(f, "{space}:0x{addr:02x} is read before it was written"),
            Lint::SleepIgnored => f.write_str("SLEEP does nothing: a flag that would end it is set already"),
            Lint::UnknownUse { space, addr } => write!(f, "{space}:0x{addr:02x} is used before it was written"),
            Lint::StackMeets { limit } => write!(f, "the stack grows below 0x{limit:04x}"),
            Lint::NothingThere { addr } => write!(f, "0x{addr:02x} is written, where nothing is"),
            Lint::ReservedBits { addr, bits } => {
                write!(f, "the reserved bits 0x{bits:02x} of the register at 0x{addr:02x} are written as ones")
            }
            Lint::Baud { uart, baud } => {
                let usual = nearest_standard_baud(*baud);
                let tenths = (i64::from(*baud) - i64::from(usual)) * 1000;
                let (sign, tenths) = (if tenths < 0 { '-' } else { '+' }, tenths.unsigned_abs() + u64::from(usual) / 2);
                let tenths = tenths / u64::from(usual.max(1));
                let off = format!("{sign}{}.{}", tenths / 10, tenths % 10);
                write!(f, "serial port {uart} runs at {baud} baud, {off} % off {usual}")
            }
            Lint::NoHandler { vector } => {
                write!(f, "the interrupt of vector {vector} is taken, and has no service routine")
            }
            Lint::Unhandled { vector } => {
                write!(f, "the interrupt of vector {vector} is enabled, and has no service routine")
            }
            Lint::FloatingRead { port, bits } => {
                write!(f, "the bits 0x{bits:02x} of the port at 0x{port:02x} are read, and nothing drives their pins")
            }
            Lint::NoSuchBit { space, addr } => {
                write!(f, "{}{addr} is used, and the controller does not have it", space.to_ascii_uppercase())
            }
            Lint::InputWritten { addr } => write!(f, "the input I{addr} is written"),
            Lint::PresetPort { module, why } => write!(f, "the preset port of R{module}: {why}"),
            Lint::OddField { word } => write!(f, "0x{word:04x} has something in its field"),
            Lint::CaptureWritten { addr } => {
                write!(f, "the capture register at 0x{addr:02x} is written in a mode that does not have it as TOP")
            }
            Lint::EdgeWoke { int } => {
                write!(f, "an edge on INT{int} ends the sleep, where the data sheet has a low level alone do that")
            }
            Lint::ChannelAbsent { channel } => {
                write!(f, "the converter is set to ADC{channel}, which the package does not have")
            }
            Lint::EarlyConversion { channel } => {
                write!(f, "GO is set before the acquisition time of AN{channel} has passed")
            }
        }
    }
}
