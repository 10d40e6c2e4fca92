//! Emits ANSI C (C89): `PlcInit` to be called once, `PlcCycle` once per scan, and hooks that the user
//! implements.

use std::fmt::Write;

use diag::Diagnostic;
use ladder::LadderProgram;

use super::body::{CellSpelling, StatementWriter, literal};
use super::names::{IdentifierPool, comment_text};
use super::{EmitContext, EmittedSource, helpers, lower_and_optimise, tables};
use crate::ir::{BitRole, Ir, IrPwm};

/// Emits `program` as one self-contained C file.
///
/// # Errors
/// The errors of [`lower_and_optimise`].
pub fn emit(program: &LadderProgram) -> Result<EmittedSource, Vec<Diagnostic>> {
    Ok(emit_ir(program, &lower_and_optimise(program)?))
}

/// Emits intermediate code of `program` as C.
#[must_use]
pub fn emit_ir(program: &LadderProgram, ir: &Ir) -> EmittedSource {
    let plan = EmitContext { program, ir };
    let names = c_spelling(ir);
    let mut scan = String::new();
    for ((bit, name), n) in plan.bits(BitRole::Input).zip(0..) {
        let _ = writeln!(scan, "    {} = PlcReadInput({n}); /* {} */", names.bits[bit.0 as usize], comment_text(name));
    }
    let parts = StatementWriter::new(ir, &names).scan(&plan.texts());
    scan += &parts.begin;
    let mut rungs = String::new();
    // Each rung is a function, because some compilers are very slow on one large function; but jumps stay in
    // one function.
    for (number, rung) in (1..).zip(&parts.rungs) {
        if ir.has_jumps() {
            let _ = write!(scan, "\n    /* Rung {number} */\n{rung}");
            continue;
        }
        let _ = write!(
            rungs,
            "\n/* Rung {number} */\nstatic unsigned char PlcRung{number}(unsigned char rung)\n{{\n{rung}    return rung;\n}}\n"
        );
        let _ = writeln!(scan, "    rung = PlcRung{number}(rung);");
    }
    scan += &parts.end;
    scan += &output_statements(&plan, &names, false);
    let body = format!("{}{}{}", parts.begin, parts.rungs.concat(), parts.end);

    let mut text = file_head(&plan);
    text += helpers::TYPES;
    text += &hook_declarations(&plan);
    text += &tables::table_definitions(ir, &names, &body);
    text += &helpers::called_helpers(&body);
    text += &cell_definitions(ir, &names);
    text += &rungs;
    let _ =
        write!(text, "\n/* Once, before the first scan: everything is as after power-up. */\nvoid PlcInit(void)\n{{\n");
    for (cell, name) in ir.bits.iter().zip(&names.bits) {
        let _ = writeln!(text, "    {name} = {};", u8::from(cell.initial));
    }
    for (cell, name) in ir.words.iter().zip(&names.words) {
        let _ = writeln!(text, "    {name} = {};", literal(cell.initial));
    }
    text += &output_statements(&plan, &names, true);
    text += "}\n\n/* One scan. */\nvoid PlcCycle(void)\n{\n    unsigned char rung = 1;\n    (void)rung;\n";
    text += &scan;
    text += "}\n";
    plan.source(
        text,
        |bit| (bit.0, names.bits.get(bit.0 as usize).cloned().unwrap_or_default()),
        |word| (word.0, names.words.get(word.0 as usize).cloned().unwrap_or_default()),
    )
}

fn c_spelling(ir: &Ir) -> CellSpelling {
    let mut names = IdentifierPool::new(&[]);
    CellSpelling {
        bits: ir.bits.iter().map(|cell| names.unique_identifier("b_", &cell.name)).collect(),
        words: ir.words.iter().map(|cell| names.unique_identifier("i_", &cell.name)).collect(),
        tables: ir.tables.iter().map(|table| names.unique_identifier("t_", &table.name)).collect(),
    }
}

fn file_head(plan: &EmitContext<'_>) -> String {
    let settings = &plan.program.settings;
    let mut text = format!("/* {}, as a C program. */\n\n", comment_text(&plan.program.file));
    let _ = writeln!(
        text,
        "/* Call PlcCycle every so many microseconds. */\n#define PLC_CYCLE_US {}UL\n",
        settings.cycle_us
    );
    text
}

/// Declarations of the hooks that the user implements, as far as the program needs them.
fn hook_declarations(plan: &EmitContext<'_>) -> String {
    let ir = plan.ir;
    let mut text = String::new();
    let mut group = |what: &str, hook: &str, prefix: &str, members: Vec<&str>| {
        if members.is_empty() {
            return;
        }
        let _ = write!(text, "\n/* {what} */\n{hook}\n");
        let mut names = IdentifierPool::new(&[]);
        for (name, n) in members.into_iter().zip(0..) {
            let _ = writeln!(text, "#define {} {n}", names.unique_identifier(prefix, name));
        }
    };
    let of = |role| plan.bits(role).map(|(_, name)| name).collect::<Vec<_>>();
    group(
        "You write this: the level of an input now, 0 or 1.",
        "unsigned char PlcReadInput(unsigned input);",
        "PLC_INPUT_",
        of(BitRole::Input),
    );
    group(
        "You write this: an output becomes 0 or 1.",
        "void PlcWriteOutput(unsigned output, unsigned char on);",
        "PLC_OUTPUT_",
        of(BitRole::Output),
    );
    group(
        "You write this: the conversion of an analog input now, 0 to 1023.",
        "int PlcReadAdc(unsigned input);",
        "PLC_ADC_",
        ir.adcs.iter().map(String::as_str).collect(),
    );
    if ir.pwms.len() > 1 {
        group(
            "You write this: the duty of a PWM output, 0 to 100 percent; low until the first call.",
            "void PlcSetPwmOutput(unsigned output, unsigned char percent);",
            "PLC_PWM_",
            ir.pwms.iter().map(|output| output.name.as_deref().unwrap_or("")).collect(),
        );
        text += "/* The frequencies of the PWM outputs in Hz. */\n";
        for (number, output) in ir.pwms.iter().enumerate() {
            let _ = writeln!(text, "#define PLC_PWM_HZ_{number} {}UL", output.hertz);
        }
    } else if let Some(IrPwm { hertz: hz, .. }) = ir.pwms.first() {
        let _ = write!(
            text,
            "\n/* You write this: the duty of the PWM output, 0 to 100 percent, at this frequency in Hz; low until the \
             first call. */\nvoid PlcSetPwm(unsigned char percent);\n#define PLC_PWM_HZ {hz}UL\n"
        );
    }
    if ir.uart.send || ir.uart.receive {
        let _ = write!(text, "\n/* The serial line, in bits per second. */\n#define PLC_BAUD {}UL\n", {
            plan.program.settings.baud.unwrap_or(0)
        });
    }
    if ir.uart.send {
        text += "/* You write this: a byte goes out; the one before it has had its time. */\n";
        text += "void PlcSendByte(unsigned char byte);\n";
    }
    if ir.uart.waits {
        text += "/* You write this: returns when the last byte has gone. */\n";
        text += "void PlcWaitSent(void);\n";
    }
    if ir.uart.receive {
        text += "/* You write this: takes the byte that has been received, 0 to 255; -1 when there is none. */\n";
        text += "int PlcReceiveByte(void);\n";
    }
    if let Some(hz) = ir.buses.i2c {
        let _ = write!(
            text,
            "\n/* You write these: a register of a device on the I2C bus, at this rate in Hz; FFh if none answers. */\n\
             #define PLC_I2C_HZ {hz}UL\nvoid PlcI2cWrite(unsigned char device, unsigned char reg, unsigned char byte);\n\
             unsigned char PlcI2cRead(unsigned char device, unsigned char reg);\n"
        );
    }
    if let Some(hz) = ir.buses.spi {
        let _ = write!(
            text,
            "\n/* You write this: a byte goes out on the SPI bus, at this rate in Hz, and one comes in. */\n\
             #define PLC_SPI_HZ {hz}UL\nunsigned char PlcSpi(unsigned char byte);\n"
        );
    }
    if ir.eeprom_bytes > 0 {
        let _ = write!(
            text,
            "\n/* You write these: a cell of EEPROM, from 0; a write begins and has some ms to end before the next. */\n\
             unsigned char PlcReadEeprom(unsigned cell);\nvoid PlcWriteEeprom(unsigned cell, unsigned char byte);\n\
             #define PLC_EEPROM_CELLS {}\n",
            ir.eeprom_bytes
        );
    }
    text
}

fn cell_definitions(ir: &Ir, names: &CellSpelling) -> String {
    let mut text = "\
\n#ifndef PLC_BIT
#if defined(__SDCC_mcs51)
#define PLC_BIT __bit
#else
#define PLC_BIT unsigned char
#endif
#endif
"
    .to_owned();
    for name in &names.bits {
        let _ = writeln!(text, "static PLC_BIT {name};");
    }
    for (cell, name) in ir.words.iter().zip(&names.words) {
        let kind = match cell.bytes {
            1 => "plc8",
            2 => "plc16",
            _ => "plc32",
        };
        let _ = writeln!(text, "static {kind} {name};");
    }
    text
}

fn output_statements(plan: &EmitContext<'_>, names: &CellSpelling, before_first_scan: bool) -> String {
    let write = |((bit, name), n): ((crate::ir::BitId, &str), u32)| {
        let begins_true = plan.ir.bits.get(bit.0 as usize).is_some_and(|cell| cell.initial);
        let cell = match names.bits.get(bit.0 as usize) {
            Some(_) if before_first_scan && begins_true => "0",
            cell => cell.map_or("", String::as_str),
        };
        format!("    PlcWriteOutput({n}, {cell}); /* {} */\n", comment_text(name))
    };
    plan.bits(BitRole::Output).zip(0..).map(write).collect()
}
