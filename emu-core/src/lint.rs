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
    UnintendedLatchChange {
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
    PageNotSelected {
        /// Target of the jump, in program words.
        target: u16,
    },
    /// A service routine returned with a changed value in a register.
    NotSaved {
        /// The register.
        register: &'static str,
    },
    /// The program read RAM that was never written since power-up (machines that only observe reads).
    UnwrittenRead {
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
    UnwrittenUse {
        /// The memory, as named in the chip row.
        space: &'static str,
        /// Address in that memory, also of a register where registers have addresses there.
        addr: u16,
    },
    /// The stack grew down over other data: static data, the heap, or the start of RAM.
    StackCollision {
        /// The lowest address that the stack may use.
        limit: u16,
    },
    /// The program wrote to an address of data memory where nothing is implemented.
    UnimplementedAddress {
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
    TakenWithoutHandler {
        /// Number of its vector.
        vector: u8,
    },
    /// An interrupt is enabled that has no service routine.
    EnabledWithoutHandler {
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
    MissingBit {
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
    UnusedFieldSet {
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
    WokenByEdge {
        /// The number of the input INT.
        int: u8,
    },
    /// The converter is set to a channel whose pin does not exist in the chosen package.
    MissingChannel {
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
        explain: "A pin that is an analog input reads 0 at any level. After power-up most pins with an analog function are analog. \
                  For BTFSC and BTFSS only the tested pin matters, for other instructions that read the port all of its \
                  pins. Fix: make the pins digital first with ADCON1, ANSEL or CMCON, depending on the chip." },
    DiagnosticCode { code: "LINT002", title: "an instruction changes other bits of a port's latch",
        explain: "BSF, BCF, IORWF, ANDWF and XORWF read all pins of a port and write all of its latch. If the level of a pin differs \
                  from its latch, the instruction changes that latch, which shows when the pin becomes an output. Such pins are \
                  inputs, analog pins, pins with a load, and pins that were written just before. Fix: keep a copy of the port in \
                  RAM, change the copy and write it to the port." },
    DiagnosticCode { code: "LINT003", title: "the stack is full",
        explain: "The stack of a PIC16 has eight entries, and each call or interrupt uses one. The ninth overwrites the oldest \
                  return address, and no flag reports it. Fix: nest fewer calls, and leave an entry for the interrupt." },
    DiagnosticCode { code: "LINT004", title: "a return without a call",
        explain: "RETURN, RETLW or RETFIE with an empty stack jumps to the address in an unused entry, often an old return address. \
                  Fix: use GOTO to leave code that was reached by GOTO." },
    DiagnosticCode { code: "LINT005", title: "a jump or call into a page that this code did not select",
        explain: "GOTO and CALL take the upper bits of their target from PCLATH. This one left its page, but code in another page \
                  wrote PCLATH last: a called routine, or the caller. Fix: set PCLATH before the \
                  jump or call (pagesel), and again after a call into another page." },
    DiagnosticCode { code: "LINT006", title: "a service routine changes a register of the interrupted code",
        explain: "After RETFIE a register has another value than at the interrupt, so the interrupted code continues \
                  with a wrong W, wrong flags or bank, or a wrong page. Fix: save W, STATUS and PCLATH first in the service \
                  routine and restore them last, with SWAPF, which does not change the flags." },
    DiagnosticCode { code: "LINT007", title: "RAM or a register is read that was never written",
        explain: "After power-up the contents of RAM are undefined and differ from chip to chip, and so are the registers of an AVR. The \
                  emulator fills them with zeros unless --ram selects another fill, so such a program may work here and fail on \
                  a board. Bytes that the image fills count as written. Each byte is reported once. On AVR the emulator tracks \
                  each bit, and reports where an unwritten bit first has an effect: in a branch, an address, or a register \
                  of the chip. Fix: write the byte or register first." },
    DiagnosticCode { code: "LINT008", title: "SLEEP does nothing",
        explain: "SLEEP is a NOP while an interrupt flag and its enable bit are set. With GIE clear nothing else shows it. \
                  A flag that the program never clears makes every SLEEP a NOP. Fix: clear the flag before SLEEP." },
    DiagnosticCode { code: "LINT009", title: "the stack grows over data below it",
        explain: "The stack grows down, static data and the heap grow up. If a push, a call, an interrupt or a frame reaches \
                  below the end of static data (or of the heap, after malloc), variables and return addresses \
                  overwrite each other. Without symbols only the start of RAM is known. For a stack that the program places in \
                  static data, such as the stack of a task, the limit is the start of RAM. Fix: use smaller buffers and frames, \
                  and less recursion." },
    DiagnosticCode { code: "LINT010", title: "a write to an unimplemented address",
        explain: "The address is reserved, or beyond the end of RAM. The data sheet forbids writes to reserved \
                  addresses. Often the image is for another chip, or a pointer is wrong. Fix: check the address." },
    DiagnosticCode { code: "LINT011", title: "reserved bits are written as ones",
        explain: "The data sheet requires zeros in reserved bits, because later chips use them. Often the \
                  number of a bit is wrong, or the image is for another chip. The lint excludes absent pins of a port, and flags \
                  that a one clears. Fix: write zeros there." },
    DiagnosticCode { code: "LINT012", title: "a baud rate is more than 2.5 % off",
        explain: "Sender and receiver of an asynchronous line may differ by a few percent in total before bits are read wrongly, so each \
                  should be within about 2 % of the rate. An error of 2.1 %, as for 115200 baud at 16 MHz, is usual and accepted. \
                  The emulator computes the rate from the clock after CLKPR, UBRR and U2X, and compares it \
                  with the nearest usual one (300 to 2000000 baud). Fix: use U2X, another UBRR, or a crystal with a suitable frequency." },
    DiagnosticCode { code: "LINT013", title: "an interrupt is taken that has no service routine",
        explain: "Its vector is erased, or jumps to the start of the program, as avr-libc does for vectors without a routine. The \
                  program starts over without a reset. Fix: write an ISR for it, or do not enable it. An ISR with a misspelt \
                  vector name does not count." },
    DiagnosticCode { code: "LINT014", title: "an interrupt is enabled that has no service routine",
        explain: "Its enable bit and I in SREG are set. When its flag is set, the program jumps into an erased vector or \
                  to its start. Fix: write an ISR for it, or do not enable it." },
    DiagnosticCode { code: "LINT015", title: "a pin is read that nothing drives",
        explain: "The pin is an input without pull-up, and nothing outside drives it. On a board it reads an undefined level and picks up \
                  noise. The report is where the bit has an effect, once per pin: a program may read the whole port if it masks the \
                  bits of such pins. Fix: enable the pull-up, or drive the pin (--set PD2=1, --set PD2=pullup)." },
    DiagnosticCode { code: "LINT016", title: "a bit that the controller does not have",
        explain: "The address has no channel or module. E 256 to 511 and R 384 to 511 never have one. The configuration sets the \
                  number of inputs and outputs, and the modules set the addresses of R. Such a bit reads 0, and a write has no effect. \
                  For an indexed operand the address includes the index. Fix: configure the channel or module, or check the address." },
    DiagnosticCode { code: "LINT017", title: "an input is written",
        explain: "STO and STOC to an input change its latch until the next sampling of the inputs. If inputs are read live there is no \
                  latch, and nothing happens. STC and RTC are only for outputs, timers and memory; a raw word that names an \
                  input has the same effect. Fix: write an output or a bit of M." },
    DiagnosticCode { code: "LINT018", title: "a preset port is misused",
        explain: "R256 to R383 take the presets of modules 0 to 127: STO to the port, then a NOP with bit 11 clear, whose field is \
                  the preset. Any other write does nothing, and the port reads 0. Fix: write TIM Rn,#d, which generates both words." },
    DiagnosticCode { code: "LINT019", title: "the operand field of an instruction without operand is not 0",
        explain: "NOT and CLR have no operand, and execute with any value of their lower twelve bits. The words B000h and C000h are the \
                  normal ones. Other words are often data that the program executes by mistake. Fix: check the address." },
    DiagnosticCode { code: "LINT020", title: "a program relies on silicon that differs from its data sheet",
        explain: "The program writes ICR1 or ICR3 in a mode in which it is not TOP, or an edge on INT0 or INT1 wakes it from a sleep \
                  in which the I/O clock is stopped. The data sheet says that the write has no effect and that only a low level wakes \
                  the chip. Real chips do both, and so does the emulator. --reading icr-write=top and --reading int-wake=level \
                  select the data sheet. Fix: select the mode before you write ICR; wake by a level or a pin change." },
    DiagnosticCode { code: "LINT021", title: "a channel of the converter has no pin in this package",
        explain: "ADC6 and ADC7 of ATmega8 and ATmega48 to 328 exist only in packages with 32 pins. In the package of \
                  --package the channel converts to 0 here, and to an undefined value on a board. Fix: choose another channel, or \
                  the package of the board. Without --package the chip has the pins of all packages." },
    DiagnosticCode { code: "LINT022", title: "a conversion starts before the acquisition time has passed",
        explain: "The holding capacitor of the converter charges through the source of the selected channel. When GO is set, the \
                  converter converts the voltage of the capacitor. The time starts at the write that turns the converter on or selects \
                  the channel, and after a conversion 2 TAD after its end. It is 19.7 us with the 10 bits of most chips and 12 us \
                  with 8 bits, by the equation of the data sheet for a source of 10 kilohms at 50 degrees Celsius. Before that, the result is \
                  near the voltage of the previous channel. Fix: wait between the selection and GO." },
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
            Lint::UnintendedLatchChange { .. } => 1,
            Lint::StackOverflow => 2,
            Lint::StackUnderflow => 3,
            Lint::PageNotSelected { .. } => 4,
            Lint::NotSaved { .. } => 5,
            Lint::UnwrittenRead { .. } | Lint::UnwrittenUse { .. } => 6,
            Lint::SleepIgnored => 7,
            Lint::StackCollision { .. } => 8,
            Lint::UnimplementedAddress { .. } => 9,
            Lint::ReservedBits { .. } => 10,
            Lint::Baud { .. } => 11,
            Lint::TakenWithoutHandler { .. } => 12,
            Lint::EnabledWithoutHandler { .. } => 13,
            Lint::FloatingRead { .. } => 14,
            Lint::MissingBit { .. } => 15,
            Lint::InputWritten { .. } => 16,
            Lint::PresetPort { .. } => 17,
            Lint::UnusedFieldSet { .. } => 18,
            Lint::CaptureWritten { .. } | Lint::WokenByEdge { .. } => 19,
            Lint::MissingChannel { .. } => 20,
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
            Lint::UnintendedLatchChange { .. } => {
                "keep a copy of the port in RAM, change the copy and write it to the port"
            }
            Lint::StackOverflow => "the stack has eight entries, including those of interrupts; nest fewer calls",
            Lint::StackUnderflow => "use a return only in a routine that was called",
            Lint::PageNotSelected { .. } => {
                "set PCLATH before the jump or call, and again after a call into another page"
            }
            Lint::NotSaved { .. } => "save W, STATUS and PCLATH first in the service routine and restore them last",
            Lint::UnwrittenRead { .. } => "write the cell first; after power-up RAM is undefined",
            Lint::SleepIgnored => "clear the flag before SLEEP",
            Lint::UnwrittenUse { .. } => "write it first; after power-up it is undefined",
            Lint::StackCollision { .. } => "use smaller buffers and frames, and less recursion",
            Lint::UnimplementedAddress { .. } => "check the address, and that the image is for this chip",
            Lint::ReservedBits { .. } => "write reserved bits as zeros, and check that the image is for this chip",
            Lint::Baud { .. } => "try U2X, another UBRR, or another crystal; --clock sets its frequency",
            Lint::TakenWithoutHandler { .. } | Lint::EnabledWithoutHandler { .. } => {
                "write a service routine for it, or do not enable it"
            }
            Lint::FloatingRead { .. } => "enable the pull-up, or drive the pin (--set PIN=LEVEL)",
            Lint::MissingBit { .. } => "configure the channel or module, or check the address",
            Lint::InputWritten { .. } => "write an output or a bit of M",
            Lint::PresetPort { .. } => "write STO to the port and after it a NOP with the preset: TIM Rn,#d",
            Lint::UnusedFieldSet { .. } => "check the address: the program may execute data",
            Lint::CaptureWritten { .. } => {
                "select the mode first: then silicon (--reading icr-write=any) and data sheet (top) agree"
            }
            Lint::WokenByEdge { .. } => {
                "wake by a low level or a pin change; --reading int-wake=level selects the data sheet"
            }
            Lint::MissingChannel { .. } => "choose another channel, or the package of the board (--package)",
            Lint::EarlyConversion { .. } => {
                "wait about 20 us after the selection of the channel, and 2 TAD more after a conversion, before you set GO"
            }
        }
    }
}

impl fmt::Display for Lint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Lint::AnalogRead { port, bits } => {
                write!(f, "the port at 0x{port:02x} is read; its bits 0x{bits:02x} are analog inputs and read 0")
            }
            Lint::UnintendedLatchChange { port, bits } => {
                write!(f, "the instruction also changes the bits 0x{bits:02x} of the latch of the port at 0x{port:02x}")
            }
            Lint::StackOverflow => f.write_str("the stack is full: the oldest return address is overwritten"),
            Lint::StackUnderflow => f.write_str("a return without a call"),
            Lint::PageNotSelected { target } => {
                write!(f, "the jump goes to 0x{target:04x}, in another page, and this page did not set PCLATH")
            }
            Lint::NotSaved { register } => write!(f, "the service routine returns with a changed value in {register}"),
            Lint::UnwrittenRead { space, addr } => write!(f, "{space}:0x{addr:02x} is read before it was written"),
            Lint::SleepIgnored => f.write_str("SLEEP does nothing: a wake-up flag is already set"),
            Lint::UnwrittenUse { space, addr } => write!(f, "{space}:0x{addr:02x} is used before it was written"),
            Lint::StackCollision { limit } => write!(f, "the stack grows below 0x{limit:04x}"),
            Lint::UnimplementedAddress { addr } => write!(f, "0x{addr:02x} is written, but is not implemented"),
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
            Lint::TakenWithoutHandler { vector } => {
                write!(f, "the interrupt of vector {vector} is taken, but has no service routine")
            }
            Lint::EnabledWithoutHandler { vector } => {
                write!(f, "the interrupt of vector {vector} is enabled, but has no service routine")
            }
            Lint::FloatingRead { port, bits } => {
                write!(f, "the bits 0x{bits:02x} of the port at 0x{port:02x} are read, but nothing drives their pins")
            }
            Lint::MissingBit { space, addr } => {
                write!(f, "{}{addr} is used, but the controller does not have it", space.to_ascii_uppercase())
            }
            Lint::InputWritten { addr } => write!(f, "the input I{addr} is written"),
            Lint::PresetPort { module, why } => write!(f, "the preset port of R{module}: {why}"),
            Lint::UnusedFieldSet { word } => write!(f, "the operand field of 0x{word:04x} is not 0"),
            Lint::CaptureWritten { addr } => {
                write!(f, "the capture register at 0x{addr:02x} is written in a mode in which it is not TOP")
            }
            Lint::WokenByEdge { int } => {
                write!(f, "an edge on INT{int} ends the sleep; by the data sheet only a low level does that")
            }
            Lint::MissingChannel { channel } => {
                write!(f, "the converter is set to ADC{channel}, which the package does not have")
            }
            Lint::EarlyConversion { channel } => {
                write!(f, "GO is set before the acquisition time of AN{channel} has passed")
            }
        }
    }
}
