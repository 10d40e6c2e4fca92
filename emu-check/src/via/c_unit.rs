//! Generates C units around an emitted program, so that a checker can run it scan by scan.

use std::fmt::Write;

use ladder_compile::emit::EmittedSource;

const SERVE: &str = include_str!("serve.c");
const PORTS: &str = include_str!("ports.c");

/// Functions whose names a unit and its program share; a unit among several gets names of its own for them.
const SHARED: [&str; 15] = [
    "PlcInit",
    "PlcCycle",
    "PlcReadInput",
    "PlcWriteOutput",
    "PlcReadAdc",
    "PlcSetPwm",
    "PlcSetPwmOutput",
    "PlcI2cWrite",
    "PlcI2cRead",
    "PlcSpi",
    "PlcSendByte",
    "PlcWaitSent",
    "PlcReceiveByte",
    "PlcReadEeprom",
    "PlcWriteEeprom",
];

fn push_counts(text: &mut String, source: &EmittedSource) {
    let counts = [
        ("INPUTS", source.inputs.len()),
        ("OUTPUTS", source.outputs.len()),
        ("ANALOG", source.analog.len()),
        ("EEPROM_CELLS", source.eeprom.into()),
    ];
    for (name, count) in counts {
        let _ = writeln!(text, "#define {name} {count}\n#define MOST_{name} {}", count.max(1));
    }
}

/// A unit with one program, served from `main`.
pub(super) fn standalone_unit(source: &EmittedSource) -> String {
    let mut text = format!("{}{PORTS}", source.text);
    push_counts(&mut text, source);
    push_slots(&mut text, source);
    text += SERVE;
    text += "int main(void)\n{\n    serve();\n    for (;;)\n        ;\n}\n";
    text
}

/// A unit with program `number` of several, served from its function `ServeN`.
pub(super) fn member_unit(source: &EmittedSource, number: usize) -> String {
    let mut text = String::new();
    for name in SHARED {
        let _ = writeln!(text, "#define {name} {name}{number}");
    }
    text += &source.text;
    text += PORTS;
    push_counts(&mut text, source);
    push_slots(&mut text, source);
    text += SERVE;
    let _ = write!(text, "void Serve{number}(void);\nvoid Serve{number}(void) {{ serve(); }}\n");
    text
}

/// A unit whose `main` calls one of `count` members: `L lo hi` starts one, which gets all following commands
/// until `U`.
pub(super) fn switchboard(count: usize) -> String {
    let mut text = PORTS.to_owned();
    (0..count).for_each(|n| text += &format!("void Serve{n}(void);\n"));
    text +=
        "int main(void)\n{\n    for (;;) {\n        unsigned n;\n        if (get() != 'L')\n            return 1;\n";
    text += "        n = get();\n        n |= (unsigned)get() << 8;\n        switch (n) {\n";
    (0..count).for_each(|n| text += &format!("        case {n}: Serve{n}(); break;\n"));
    text += "        default: return 2;\n        }\n        put('U');\n    }\n}\n";
    text
}

/// A unit with the interpreter and one image, served from `main`; the file `plc.c` is compiled with it.
pub(super) fn interpreted_unit(source: &EmittedSource) -> String {
    let mut text =
        "#include \"plc.h\"\n#if defined(__AVR__)\n#include <avr/pgmspace.h>\n#else\n#define PROGMEM\n#endif\n\
                    static const unsigned char image[] PROGMEM = {\n"
            .to_owned();
    text += &source.text;
    text += "};\n";
    text += PORTS;
    push_counts(&mut text, source);
    text += INTERPRETER_SLOTS;
    text += SERVE;
    text += "int main(void)\n{\n    if (PlcLoad(image))\n        put('!');\n    else\n        serve();\n    for (;;)\n        ;\n}\n";
    text
}

/// A unit with the interpreter, for one image after another: `L`, four bytes of length, the image, and then
/// commands until `U`.
pub(super) fn interpreter_unit() -> String {
    let mut text = format!("#include \"plc.h\"\n{PORTS}");
    text += "#define OUTPUTS PlcOutputs\n#define EEPROM_CELLS PlcCells\n#define MOST_INPUTS 256\n#define MOST_OUTPUTS 256\n";
    text += "#define MOST_ANALOG 256\n#define MOST_EEPROM_CELLS 65536\n";
    text += INTERPRETER_SLOTS;
    text += SERVE;
    text += "static unsigned char image[1 << 20];\nint main(void)\n{\n    for (;;) {\n        long n, length;\n";
    text += "        if (get() != 'L')\n            return 1;\n        length = get_four();\n";
    text += "        for (n = 0; n < length; n++)\n            image[n] = get();\n";
    text += "        if (PlcLoad(image))\n            return 2;\n        serve();\n        put('U');\n    }\n}\n";
    text
}

/// The interpreter's slots: its bits, followed by its integers.
const INTERPRETER_SLOTS: &str = "
#define SLOTS (PlcBits + PlcWords)
static long look(unsigned n) { return n < PlcBits ? PlcGetBit(n) : PlcGetWord(n - PlcBits); }
static void poke(unsigned n, long v)
{
    if (n < PlcBits)
        PlcSetBit(n, v != 0);
    else
        PlcSetWord(n - PlcBits, v);
}
";

/// Writes the functions for a program's slots, which are its cells in the order of the source. Written values
/// wrap like the conversions of the compilers used here.
fn push_slots(text: &mut String, source: &EmittedSource) {
    let _ = writeln!(text, "#define SLOTS {}", source.cells.len());
    *text += "static long look(unsigned n)\n{\n    switch (n) {\n";
    for (cell, n) in source.cells.iter().zip(0..) {
        let _ = writeln!(text, "    case {n}: return {};", cell.text);
    }
    *text += "    default: return 0;\n    }\n}\nstatic void poke(unsigned n, long v)\n{\n    switch (n) {\n";
    for (cell, n) in source.cells.iter().zip(0..) {
        let value = match cell.bytes {
            None => "v != 0",
            Some(1) => "(signed char)v",
            Some(2) => "(short)v",
            Some(_) => "v",
        };
        let _ = writeln!(text, "    case {n}: {} = {value}; break;", cell.text);
    }
    *text += "    default: break;\n    }\n}\n";
}
