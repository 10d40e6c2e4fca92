//! Emits a sketch for Arduino boards with an ATmega328P.
//!
//! The sketch has objects for inputs, outputs, flags, timers, counters and numbers, and a loop that executes
//! one scan per iteration, paced by `micros()`. Its style follows a compiler described in a thesis of the PUC
//! Minas, but it does not share that compiler's debouncing, counters and timers: here debouncing works, and
//! the elements keep their meaning.

use std::fmt::Write;

use diag::{Diagnostic, Pos, Severity};
use emu_avr::chips::{ATMEGA328, ATMEGA328P};
use emu_core::chip::Chip;
use ladder::{LadderProgram, SymbolKind};

use super::body::{CellSpelling, StatementWriter, literal};
use super::names::{IdentifierPool, comment_text};
use super::{EmitContext, EmittedSource, helpers, lower_and_optimise, refuse_further_pwm, tables};
use crate::CodegenError;
use crate::codes;
use crate::ir::{BitRole, Ir, WordRole};
use crate::pins::{self, AssignedPin, PinAssignment, PinPlan};
use crate::target::{BuildRefusal, CompileJob, CompileTarget, PwmPin};

/// The board: an ATmega328P with its pins in the order of their board numbers, those of the serial line last.
///
/// The Arduino core uses timer 0 for its clock, so PWM uses timer 1, which reaches any frequency.
pub const ARDUINO_BOARD: CompileTarget = CompileTarget {
    chip: &ATMEGA328P,
    pins: &[
        "PD2", "PD3", "PD4", "PD5", "PD6", "PD7", "PB0", "PB1", "PB2", "PB3", "PB4", "PB5", "PC0", "PC1", "PC2", "PC3",
        "PC4", "PC5", "PD0", "PD1",
    ],
    uart: Some(("PD1", "PD0")),
    pwm: &[PwmPin::new("PB1", 1, 0)],
    adc: &[("PC0", 0), ("PC1", 1), ("PC2", 2), ("PC3", 3), ("PC4", 4), ("PC5", 5)],
    eeprom: 1024,
    i2c: Some(("PC4", "PC5")),
    spi: Some(["PB2", "PB5", "PB3", "PB4"]),
    build: refuse_image,
};

fn refuse_image(_: &CompileJob<'_>) -> Result<crate::target::BuiltImage, BuildRefusal> {
    Err(BuildRefusal::Internal(CodegenError::SketchIsNoImage))
}

/// The board, with a static lifetime.
static BOARD_TARGET: CompileTarget = ARDUINO_BOARD;

/// Clock frequency of the boards in Hz.
const CLOCK_HZ: u64 = 16_000_000;

/// Options of a sketch.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct SketchOptions {
    /// Pins by symbol, such as (`Xstart`, `PD2`); they override those of `IO LIST`.
    pub pins: Vec<PinAssignment>,
    /// Time in milliseconds for which an input must be stable, rounded up to whole scans; 0 disables
    /// debouncing.
    pub debounce_ms: u32,
}

/// A sketch and its pin assignment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ArduinoSketch {
    /// The text and its cells.
    pub source: EmittedSource,
    /// Inputs, outputs and analog inputs with their pins of the chip.
    pub pins: Vec<AssignedPin>,
    /// Notes about pins that were assigned automatically.
    pub notes: Vec<Diagnostic>,
}

/// Emits `program` as one sketch.
///
/// # Errors
/// The errors of [`lower_and_optimise`]; pins that the board lacks or that are assigned twice; a PWM
/// frequency that the board cannot generate.
pub fn emit(program: &LadderProgram, options: &SketchOptions) -> Result<ArduinoSketch, Vec<Diagnostic>> {
    if let Some(refusal) = refuse_further_pwm(program, "a sketch") {
        return Err(vec![refusal]);
    }
    let mut ir = lower_and_optimise(program)?;
    ir.set_bits_in_first_scan();
    let mut notes = Vec::new();
    let PinPlan { pins, .. } = pins::assign_pins(program, &options.pins, &BOARD_TARGET, &mut notes);
    if let Some(hz) = ir.pwms.iter().map(|output| output.hertz).find(|hz| u64::from(*hz) * 20 > CLOCK_HZ) {
        let cause = format!("SET_PWM requests {hz} Hz, a board of 16 MHz makes at most {} Hz", CLOCK_HZ / 20);
        let at = Pos::default();
        notes.push(Diagnostic::new(Severity::Error, codes::PWM, &program.file, at, cause, "choose a lower frequency"));
    }
    if notes.iter().any(Diagnostic::is_error) {
        notes.retain(Diagnostic::is_error);
        return Err(notes);
    }
    Ok(ArduinoSketch { source: emit_ir(program, &ir, &pins, options.debounce_ms), pins, notes })
}

/// Returns an error if no Arduino board has `chip`; `file` is the file name of the program.
///
/// Boards have the ATmega328P. The ATmega328 is accepted too, because programs see no difference.
#[must_use]
pub fn refuse_chip(file: &str, chip: &Chip) -> Option<Diagnostic> {
    if [ATMEGA328P.name, ATMEGA328.name].contains(&chip.name) {
        return None;
    }
    let cause =
        format!("a sketch is for Arduino boards with an ATmega328P, and none of them has the chip {}", chip.name);
    let hint = "leave --mcu out, or write an image for the chip with --emit hex";
    Some(Diagnostic::new(Severity::Error, codes::UNKNOWN_CHIP, file, Pos::default(), cause, hint))
}

/// Arduino number of a pin of the chip.
#[must_use]
pub fn board_pin_number(pin: &str) -> Option<u8> {
    let bit = pin.get(2..)?.parse::<u8>().ok().filter(|bit| *bit < 8)?;
    match pin.get(..2)? {
        "PD" => Some(bit),
        "PB" if bit < 6 => Some(8 + bit),
        "PC" if bit < 6 => Some(14 + bit),
        _ => None,
    }
}

/// Emits intermediate code of `program` as a sketch, with a pin for each input, output and analog input.
#[must_use]
pub fn emit_ir(program: &LadderProgram, ir: &Ir, pins: &[AssignedPin], debounce_ms: u32) -> EmittedSource {
    let plan = EmitContext { program, ir };
    let objects = object_spelling(ir);
    let member = |names: &[String], member: &str| names.iter().map(|name| format!("{name}.{member}")).collect();
    let names = CellSpelling {
        bits: member(&objects.bits, "on"),
        words: member(&objects.words, "value"),
        tables: objects.tables.clone(),
    };
    let scan = StatementWriter::new(ir, &names).scan(&plan.texts()).concatenated();
    let each = |role, call: &str| -> String {
        let of = plan.bits(role).filter_map(|(bit, _)| objects.bits.get(bit.0 as usize));
        of.map(|name| format!("    {name}.{call}();\n")).collect()
    };
    let cycle_us = program.settings.cycle_us;
    let scans = (u64::from(debounce_ms) * 1000).div_ceil(cycle_us.max(1));
    let mut text = format!("/* {}, as a sketch for boards with an ATmega328P. */\n\n", comment_text(&program.file));
    if ir.eeprom_bytes > 0 {
        text += "#include <avr/eeprom.h>\n";
    }
    text += helpers::TYPES;
    let _ = write!(
        text,
        "\n/* One scan in so many microseconds. */\nconst unsigned long CYCLE_US = {cycle_us}UL;\n\
         /* An input counts when it has been steady for so many scans besides the one that sees it change. */\n\
         const unsigned long DEBOUNCE_SCANS = {scans}UL;\n"
    );
    text += CLASSES;
    text += &peripheral_functions(&plan, pins);
    text += &tables::table_definitions(ir, &names, &scan);
    text += &helpers::called_helpers(&scan);
    text += &object_declarations(&plan, pins, &objects);
    text += "\n/* When the next scan begins. */\nunsigned long due;\n\nvoid setup()\n{\n";
    text += &each(BitRole::Input, "setup");
    text += &each(BitRole::Output, "setup");
    if !ir.pwms.is_empty() {
        text += "    PlcSetupPwm();\n";
    }
    if ir.uart.send || ir.uart.receive {
        let _ = writeln!(text, "    Serial.begin({}UL);", program.settings.baud.unwrap_or(0));
    }
    if ir.buses.i2c.is_some() {
        text += "    PlcSetupI2c();\n";
    }
    if ir.buses.spi.is_some() {
        text += "    PlcSetupSpi();\n";
    }
    text += "    due = micros();\n}\n\nvoid loop()\n{\n    while (micros() - due < CYCLE_US)\n        ;\n    due += CYCLE_US;\n\n";
    text += &each(BitRole::Input, "read");
    if ir.uart.receive {
        text += "    PlcLatchByte();\n";
    }
    text += "    unsigned char rung = 1;\n    (void)rung;\n";
    text += &scan;
    text.push('\n');
    text += &each(BitRole::Output, "write");
    text += "}\n";
    let of = |names: &[String], n: u32| (n, names.get(n as usize).cloned().unwrap_or_default());
    plan.source(text, |bit| of(&objects.bits, bit.0), |word| of(&objects.words, word.0))
}

/// Names that the Arduino core and the sketch itself use for other purposes.
const RESERVED: &[&str] = &["Client", "Counter", "CYCLE_US", "Timer", "Tone", "X", "Y", "R", "T", "C"];

/// Names of the objects: the symbol's own name if it is certainly free, otherwise with a trailing underscore.
fn object_spelling(ir: &Ir) -> CellSpelling {
    let mut names = IdentifierPool::new(RESERVED);
    let mut give = |name: &str, kept_letters: &[char]| {
        let keeps_name = name.chars().next().is_some_and(|c| kept_letters.contains(&c))
            && name.chars().nth(1).is_some_and(|c| c.is_ascii_lowercase())
            && !RESERVED.contains(&name);
        if keeps_name { names.unique_identifier("", name) } else { names.unique_identifier("", &format!("{name}_")) }
    };
    CellSpelling {
        bits: ir.bits.iter().map(|cell| give(&cell.name, &['X', 'Y', 'R'])).collect(),
        words: ir.words.iter().map(|cell| give(&cell.name, &['T', 'C'])).collect(),
        tables: ir.tables.iter().map(|table| give(&table.name, &[])).collect(),
    }
}

const CLASSES: &str = "
/* An input, on while its pin is high; the pull-up is on. A change counts when it has lasted for `steady` scans more. */
class Input {
  public:
    bool on;
    Input(byte pin, unsigned long steady) : on(false), pin(pin), steady(steady), changing(0) {}
    void setup() { pinMode(pin, INPUT_PULLUP); }
    void read()
    {
        bool level = digitalRead(pin) == HIGH;
        if (level == on)
            changing = 0;
        else if (changing < steady)
            changing++;
        else {
            on = level;
            changing = 0;
        }
    }
  private:
    byte pin;
    unsigned long steady, changing;
};

/* An output; its pin follows at the end of a scan. */
class Output {
  public:
    bool on;
    Output(byte pin) : on(false), pin(pin) {}
    void setup()
    {
        digitalWrite(pin, LOW);
        pinMode(pin, OUTPUT);
    }
    void write() { digitalWrite(pin, on ? HIGH : LOW); }
  private:
    byte pin;
};

/* A relay, or what an element remembers. */
class Flag {
  public:
    bool on;
    Flag() : on(false) {}
};

/* Timers count scans, counters edges, numbers whatever is put into them. */
template <typename T> class Number {
  public:
    T value;
    Number(T start) : value(start) {}
};
template <typename T> class Timer : public Number<T> {
  public:
    Timer(T start) : Number<T>(start) {}
};
template <typename T> class Counter : public Number<T> {
  public:
    Counter(T start) : Number<T>(start) {}
};
";

const PWM_FUNCTIONS: &str = "
/* The PWM output is pin 9, driven by timer 1: it counts from 0 to TOP, and the pin is high for as many of its ticks as the duty
   is of all. */
#if F_CPU / PWM_HZ <= 65536
#define PWM_SELECT _BV(CS10)
#define PWM_TOP ((F_CPU + PWM_HZ / 2) / PWM_HZ - 1)
#elif F_CPU / 8 / PWM_HZ <= 65536
#define PWM_SELECT _BV(CS11)
#define PWM_TOP ((F_CPU / 8 + PWM_HZ / 2) / PWM_HZ - 1)
#elif F_CPU / 64 / PWM_HZ <= 65536
#define PWM_SELECT (_BV(CS11) | _BV(CS10))
#define PWM_TOP ((F_CPU / 64 + PWM_HZ / 2) / PWM_HZ - 1)
#else
#define PWM_SELECT _BV(CS12)
#define PWM_TOP ((F_CPU / 256 + PWM_HZ / 2) / PWM_HZ - 1)
#endif
static void PlcSetupPwm()
{
    digitalWrite(9, LOW);
    pinMode(9, OUTPUT);
    /* ICR1 can be written only where the mode makes it the top. */
    TCCR1A = _BV(WGM11);
    TCCR1B = _BV(WGM13) | _BV(WGM12) | PWM_SELECT;
    ICR1 = (unsigned int)(PWM_TOP > 65535UL ? 65535UL : PWM_TOP);
}
static inline void PlcSetPwm(unsigned char percent)
{
    unsigned long high = ((ICR1 + 1UL) * percent + 50) / 100;
    if (high == 0) {
        TCCR1A = _BV(WGM11);
        return;
    }
    OCR1A = (unsigned int)(high - 1);
    TCCR1A = _BV(COM1A1) | _BV(WGM11);
}
";

const I2C_FUNCTIONS: &str = "
/* The I2C bus at A4 (SDA) and A5 (SCL). A device that does not answer is ignored, and FFh is read from it. */
#define I2C_COUNT (F_CPU / I2C_HZ < 36 ? 10 : (F_CPU / I2C_HZ - 15) / 2)
static void PlcSetupI2c()
{
    TWSR = 0;
    TWBR = I2C_COUNT > 255 ? 255 : I2C_COUNT;
}
static unsigned char PlcI2cStep(unsigned char bits)
{
    TWCR = _BV(TWINT) | _BV(TWEN) | bits;
    while (!(TWCR & _BV(TWINT)))
        ;
    return TWSR & 0xF8;
}
static unsigned char PlcI2cByte(unsigned char byte)
{
    TWDR = byte;
    return PlcI2cStep(0);
}
static void PlcI2cStop()
{
    TWCR = _BV(TWINT) | _BV(TWEN) | _BV(TWSTO);
    while (TWCR & _BV(TWSTO))
        ;
}
static inline void PlcI2cWrite(unsigned char device, unsigned char reg, unsigned char byte)
{
    PlcI2cStep(_BV(TWSTA));
    PlcI2cByte(device << 1);
    PlcI2cByte(reg);
    PlcI2cByte(byte);
    PlcI2cStop();
}
static inline unsigned char PlcI2cRead(unsigned char device, unsigned char reg)
{
    unsigned char byte = 0xFF;
    PlcI2cStep(_BV(TWSTA));
    PlcI2cByte(device << 1);
    PlcI2cByte(reg);
    PlcI2cStep(_BV(TWSTA));
    if (PlcI2cByte(device << 1 | 1) == 0x40) {
        PlcI2cStep(0);
        byte = TWDR;
    }
    PlcI2cStop();
    return byte;
}
";

const SPI_FUNCTIONS: &str = "
/* The SPI bus: 10 selects the device, 11 is data out, 12 data in, 13 the clock. */
#if F_CPU / SPI_HZ <= 4
#define SPI_RATE 0
#elif F_CPU / SPI_HZ <= 16
#define SPI_RATE _BV(SPR0)
#elif F_CPU / SPI_HZ <= 64
#define SPI_RATE _BV(SPR1)
#else
#define SPI_RATE (_BV(SPR1) | _BV(SPR0))
#endif
static void PlcSetupSpi()
{
    digitalWrite(10, HIGH);
    pinMode(10, OUTPUT);
    pinMode(11, OUTPUT);
    pinMode(13, OUTPUT);
    SPCR = _BV(SPE) | _BV(MSTR) | SPI_RATE;
}
static inline unsigned char PlcSpi(unsigned char byte)
{
    digitalWrite(10, LOW);
    SPDR = byte;
    while (!(SPSR & _BV(SPIF)))
        ;
    digitalWrite(10, HIGH);
    return SPDR;
}
";

/// Functions for the peripherals that the program uses. Those that the scan calls are `inline`: a call that
/// can never happen is left out of the scan, and gcc does not warn of an unused inline function.
fn peripheral_functions(plan: &EmitContext<'_>, pins: &[AssignedPin]) -> String {
    let ir = plan.ir;
    let mut text = String::new();
    if !ir.adcs.is_empty() {
        text += "\n/* Analog inputs, 0 to 1023. */\nstatic inline int PlcReadAdc(unsigned input)\n{\n    switch (input) {\n";
        for (name, n) in ir.adcs.iter().zip(0..) {
            let pin = pins.iter().find(|pin| pin.name == *name).and_then(|pin| board_pin_number(pin.pin)).unwrap_or(14);
            let reference = match ir.adc_references.get(n).copied().unwrap_or(0) {
                0 | 1 => "DEFAULT",
                _ => "INTERNAL",
            };
            let select = if ir.adc_references.iter().any(|refs| *refs > 1) {
                format!("analogReference({reference}); ")
            } else {
                String::new()
            };
            let _ = writeln!(text, "    case {n}: {select}return analogRead({pin}); /* {} */", comment_text(name));
        }
        text += "    default: return 0;\n    }\n}\n";
    }
    if let Some(hz) = ir.pwms.first().map(|output| output.hertz) {
        let _ = write!(text, "\n#define PWM_HZ {hz}UL{PWM_FUNCTIONS}");
    }
    if let Some(hz) = ir.buses.i2c {
        let _ = write!(text, "\n#define I2C_HZ {hz}UL{I2C_FUNCTIONS}");
    }
    if let Some(hz) = ir.buses.spi {
        let _ = write!(text, "\n#define SPI_HZ {hz}UL{SPI_FUNCTIONS}");
    }
    if ir.uart.send {
        text += "\nstatic inline void PlcSendByte(unsigned char byte) { Serial.write(byte); }\n";
    }
    if ir.uart.waits {
        text += "\nstatic inline void PlcWaitSent() { Serial.flush(); }\n";
    }
    if ir.uart.receive {
        text += "
/* The byte that waits at the start of a scan, or -1. */
static int waiting = -1;
static void PlcLatchByte()
{
    if (waiting < 0)
        waiting = Serial.read();
}
static inline int PlcReceiveByte()
{
    int byte = waiting;
    waiting = -1;
    return byte;
}
";
    }
    if ir.eeprom_bytes > 0 {
        text += "
static inline unsigned char PlcReadEeprom(unsigned cell) { return eeprom_read_byte((const uint8_t *)cell); }
static inline void PlcWriteEeprom(unsigned cell, unsigned char byte) { eeprom_write_byte((uint8_t *)cell, byte); }
";
    }
    text
}

/// Declarations of the objects, grouped by kind.
fn object_declarations(plan: &EmitContext<'_>, pins: &[AssignedPin], objects: &CellSpelling) -> String {
    let mut text = String::new();
    let pin =
        |name: &str| pins.iter().find(|pin| pin.name == name).and_then(|pin| board_pin_number(pin.pin)).unwrap_or(0);
    let mut kind = |title: &str, lines: Vec<String>| {
        if !lines.is_empty() {
            let _ = write!(text, "\n/* {title} */\n{}", lines.concat());
        }
    };
    let bits = |role, of: fn(&str, u8) -> String| -> Vec<String> {
        let of = |(bit, name): (crate::ir::BitId, &str)| Some(of(objects.bits.get(bit.0 as usize)?, pin(name)));
        plan.bits(role).filter_map(of).collect()
    };
    kind("Inputs", bits(BitRole::Input, |name, pin| format!("Input {name}({pin}, DEBOUNCE_SCANS);\n")));
    kind("Outputs", bits(BitRole::Output, |name, pin| format!("Output {name}({pin});\n")));
    kind("Relays", bits(BitRole::Relay, |name, _| format!("Flag {name};\n")));
    let words = |class: &str, wanted: fn(WordRole) -> bool| -> Vec<String> {
        let cells = plan.ir.words.iter().zip(&objects.words).filter(|(cell, _)| wanted(cell.role));
        let line = |(cell, name): (&crate::ir::WordCell, &String)| {
            let kind = match cell.bytes {
                1 => "plc8",
                2 => "plc16",
                _ => "plc32",
            };
            format!("{class}<{kind}> {name}({});\n", literal(cell.initial))
        };
        cells.map(line).collect()
    };
    kind("Timers", words("Timer", |role| role == WordRole::Symbol(SymbolKind::Timer)));
    kind("Counters", words("Counter", |role| role == WordRole::Symbol(SymbolKind::Counter)));
    kind(
        "Numbers",
        words(
            "Number",
            |role| matches!(role, WordRole::Symbol(kind) if !matches!(kind, SymbolKind::Timer | SymbolKind::Counter)),
        ),
    );
    kind("What elements remember", bits(BitRole::Memory, |name, _| format!("Flag {name};\n")));
    kind("Memory in numbers", words("Number", |role| role == WordRole::Memory));
    kind("Within a scan", bits(BitRole::Temporary, |name, _| format!("Flag {name};\n")));
    kind("Numbers within a scan", words("Number", |role| role == WordRole::Temporary));
    text
}
