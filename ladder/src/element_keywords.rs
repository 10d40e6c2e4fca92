//! Keywords of the elements, with the number and syntax of their arguments.

/// A row: keyword, minimum and maximum number of arguments, syntax.
pub(crate) type ElementKeyword = (&'static str, usize, usize, &'static str);

/// Maximum of a row whose number of arguments has no limit.
pub(crate) const ANY_COUNT: usize = usize::MAX;

/// All elements that the reader accepts.
#[rustfmt::skip]
pub(crate) const ELEMENT_KEYWORDS: &[ElementKeyword] = &[
    ("COMMENT",          0, ANY_COUNT, "COMMENT text"),
    ("CONTACTS",         2, 3,   "CONTACTS name negated [set1]"),
    ("COIL",             4, 5,   "COIL name negated set reset [ttrigger]"),
    ("SHORT",            0, 0,   "SHORT"),
    ("OPEN",             0, 0,   "OPEN"),
    ("PLACEHOLDER",      0, 0,   "PLACEHOLDER"),
    ("MASTER_RELAY",     0, 0,   "MASTER_RELAY"),
    ("OSR",              0, 0,   "OSR"),
    ("OSF",              0, 0,   "OSF"),
    ("ODR",              0, 0,   "ODR"),
    ("ODF",              0, 0,   "ODF"),
    ("OSL",              0, 0,   "OSL"),
    ("OSC",              0, 0,   "OSC"),
    ("TON",              2, 3,   "TON name microseconds [adjust]"),
    ("TOF",              2, 3,   "TOF name microseconds [adjust]"),
    ("RTO",              2, 3,   "RTO name microseconds [adjust]"),
    ("RTL",              2, 3,   "RTL name microseconds [adjust]"),
    ("TCY",              2, 3,   "TCY name microseconds [adjust]"),
    ("THI",              2, 3,   "THI name microseconds [adjust]"),
    ("TLO",              2, 3,   "TLO name microseconds [adjust]"),
    ("CTU",              2, 4,   "CTU name max [start kind]"),
    ("CTD",              2, 4,   "CTD name max [start kind]"),
    ("CTC",              2, 4,   "CTC name max [start kind]"),
    ("CTR",              2, 4,   "CTR name min [start kind]"),
    ("RES",              1, 1,   "RES name"),
    ("MOVE",             2, 2,   "MOVE dest source"),
    ("ADD",              3, 3,   "ADD dest op1 op2"),
    ("SUB",              3, 3,   "SUB dest op1 op2"),
    ("MUL",              3, 3,   "MUL dest op1 op2"),
    ("DIV",              3, 3,   "DIV dest op1 op2"),
    ("MOD",              3, 3,   "MOD dest op1 op2"),
    ("AND",              3, 3,   "AND dest op1 op2"),
    ("OR",               3, 3,   "OR dest op1 op2"),
    ("XOR",              3, 3,   "XOR dest op1 op2"),
    ("NOT",              2, 2,   "NOT dest source"),
    ("NEG",              2, 2,   "NEG dest source"),
    ("SWAP",             2, 2,   "SWAP dest source"),
    ("OPPOSITE",         2, 2,   "OPPOSITE dest source"),
    ("BIN2BCD",          2, 2,   "BIN2BCD dest source"),
    ("BCD2BIN",          2, 2,   "BCD2BIN dest source"),
    ("SHL",              3, 3,   "SHL dest source count"),
    ("SHR",              3, 3,   "SHR dest source count"),
    ("SR0",              3, 3,   "SR0 dest source count"),
    ("ROL",              3, 3,   "ROL dest source count"),
    ("ROR",              3, 3,   "ROR dest source count"),
    ("SET_BIT",          2, 2,   "SET_BIT name bit"),
    ("CLEAR_BIT",        2, 2,   "CLEAR_BIT name bit"),
    ("IF_BIT_SET",       2, 2,   "IF_BIT_SET name bit"),
    ("IF_BIT_CLEAR",     2, 2,   "IF_BIT_CLEAR name bit"),
    ("BUS",              10, 10, "BUS dest source p7 p6 p5 p4 p3 p2 p1 p0"),
    ("LABEL",            1, 1,   "LABEL name"),
    ("GOTO",             1, 1,   "GOTO name"),
    ("GOSUB",            1, 1,   "GOSUB name"),
    ("SUBPROG",          1, 1,   "SUBPROG name"),
    ("ENDSUB",           1, 1,   "ENDSUB name"),
    ("RETURN",           0, 0,   "RETURN"),
    ("7SEGMENTS",        3, 3,   "7SEGMENTS dest source C or A"),
    ("9SEGMENTS",        3, 3,   "9SEGMENTS dest source C or A"),
    ("14SEGMENTS",       3, 3,   "14SEGMENTS dest source C or A"),
    ("16SEGMENTS",       3, 3,   "16SEGMENTS dest source C or A"),
    ("TIME2COUNT",       2, 2,   "TIME2COUNT dest microseconds"),
    ("TIME2DELAY",       2, 2,   "TIME2DELAY dest microseconds"),
    ("RANDOM",           1, 1,   "RANDOM dest"),
    ("SEED_RANDOM",      2, 2,   "SEED_RANDOM dest source"),
    ("DELAY",            1, 1,   "DELAY time"),
    ("SLEEP",            0, 0,   "SLEEP"),
    ("CLRWDT",           0, 0,   "CLRWDT"),
    ("LOCK",             0, 0,   "LOCK"),
    ("EQU",              2, 2,   "EQU op1 op2"),
    ("NEQ",              2, 2,   "NEQ op1 op2"),
    ("GRT",              2, 2,   "GRT op1 op2"),
    ("GEQ",              2, 2,   "GEQ op1 op2"),
    ("LES",              2, 2,   "LES op1 op2"),
    ("LEQ",              2, 2,   "LEQ op1 op2"),
    ("SHIFT_REGISTER",   2, 2,   "SHIFT_REGISTER name stages"),
    ("LOOK_UP_TABLE",    4, ANY_COUNT, "LOOK_UP_TABLE dest index count as_string v0 v1 .."),
    ("PIECEWISE_LINEAR", 3, ANY_COUNT, "PIECEWISE_LINEAR dest index count x0 y0 x1 y1 .."),
    ("READ_ADC",         1, 2,   "READ_ADC name [refs]"),
    ("SET_PWM",          2, 4,   "SET_PWM duty hertz [name resolution]"),
    ("UART_RECV",        1, 3,   "UART_RECV name [bytes wait]"),
    ("UART_SEND",        1, 3,   "UART_SEND name [bytes wait]"),
    ("UART_RECV_AVAIL",  0, 0,   "UART_RECV_AVAIL"),
    ("UART_SEND_READY",  0, 0,   "UART_SEND_READY"),
    ("PULSER",           5, 5,   "PULSER high low accel count coil"),
    ("STEPPER",          6, 6,   "STEPPER name max period size graph coil"),
    ("NPULSE",           3, 3,   "NPULSE count hertz coil"),
    ("NPULSE_OFF",       0, 0,   "NPULSE_OFF"),
    ("QUAD_ENCOD",       8, 8,   "QUAD_ENCOD counter interrupt A B Z dir kind turn"),
    ("SPI",              8, 8,   "SPI name send recv Master 0b00 8 MSB_FIRST rate"),
    ("SPI_WR",           8, 8,   "SPI_WR name text - Master 0b00 8 MSB_FIRST rate"),
    ("I2C_RD",           8, 8,   "I2C_RD name - recv Master device register MSB_FIRST rate"),
    ("I2C_WR",           8, 8,   "I2C_WR name send - Master device register MSB_FIRST rate"),
    ("PERSIST",          1, 1,   "PERSIST name"),
    ("STRING",           3, ANY_COUNT, "STRING dest name \"text\" (dest and name may be (none))"),
    ("FORMATTED_STRING", 2, ANY_COUNT, "FORMATTED_STRING name length c0 c1 .. or FORMATTED_STRING name \"text\" (name or (none))"),
];

/// Keywords of all elements that the reader accepts, in the order of the language's page.
pub fn element_keywords() -> impl Iterator<Item = &'static str> {
    ELEMENT_KEYWORDS.iter().map(|row| row.0)
}

const TEXT_VARIABLE: &str = "a variable holds a number here, not a text";
const NO_TEXT_ON_BUS: &str = "a bus sends single bytes here";
const FORMATTED: &str = "send the text with FORMATTED_STRING name \"text\", where \\5 is the place of the number";

const NO_WIDTH: &str = "it moves as many bytes as the variable is wide, which the line does not say";
const NO_SFR: &str = "it reaches a special register by its address";
const WRITE_REGISTER: &str = "write MOVE, SET_BIT or CLEAR_BIT with #PORTx, #PINx or #TRISx";
const TEST_REGISTER: &str = "test #PORTx, #PINx or #TRISx with IF_BIT_SET, IF_BIT_CLEAR or a comparison";

/// Older names of elements that LDmicro 5 reads, and the name that it writes.
pub(crate) const OLD_KEYWORDS: &[(&str, &str)] =
    &[("UART_SEND_BUSY", "UART_SEND_READY"), ("UART_UDRE", "UART_SEND_READY")];

/// Elements of LDmicro 5 that are not supported: keyword, reason, and the nearest thing that works.
#[rustfmt::skip]
pub(crate) const UNSUPPORTED_KEYWORDS: &[(&str, &str, &str)] = &[
    ("UART_RECVn",  NO_WIDTH, "write UART_RECV name 2 0 for two bytes, up to 4"),
    ("UART_SENDn",  NO_WIDTH, "write UART_SEND name 2 0 for two bytes, up to 4"),
    ("RSFR",        NO_SFR, "write MOVE name #PORTx, or #PINx"),
    ("WSFR",        NO_SFR, WRITE_REGISTER),
    ("SSFR",        NO_SFR, WRITE_REGISTER),
    ("CSFR",        NO_SFR, WRITE_REGISTER),
    ("TSFR",        NO_SFR, TEST_REGISTER),
    ("TCSFR",       NO_SFR, TEST_REGISTER),
    ("CPRINTF",     TEXT_VARIABLE, FORMATTED),
    ("SPRINTF",     TEXT_VARIABLE, FORMATTED),
    ("FPRINTF",     "a chip has no files", FORMATTED),
    ("PRINTF",      "a chip has no console", FORMATTED),
    ("I2C_PRINTF",  NO_TEXT_ON_BUS, "send its characters one by one: LOOK_UP_TABLE and I2C_WR"),
    ("ISP_PRINTF",  NO_TEXT_ON_BUS, "send the text with SPI_WR"),
    ("UART_PRINTF", "the serial line takes one character a scan", FORMATTED),
];
