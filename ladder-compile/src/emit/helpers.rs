//! Helpers for emitted C, valid in C++ too: conversions that wrap, and a division that never traps.

/// Integer types of known widths, for compilers with a 16-bit or 32-bit int.
pub(super) const TYPES: &str = "\
#include <limits.h>

/* Integers of 8, 16 and 32 bits; three bytes are kept in four. */
typedef signed char plc8;
typedef short plc16;
#if UINT_MAX >= 0xFFFFFFFF
typedef int plc32;
typedef unsigned plcU32;
#else
typedef long plc32;
typedef unsigned long plcU32;
#endif
";

/// A function of C that a program may call.
struct CHelper {
    name: &'static str,
    text: &'static str,
}

/// Convert the low bits to a signed number.
///
/// They use the compiler's own conversion if it is known to wrap; the alternative is portable.
const WRAP_HELPERS: [CHelper; 4] = [
    CHelper {
        name: "Plc8",
        text: "\
static plc8 Plc8(unsigned v)
{
#ifdef PLC_WRAPS
    return (plc8)v;
#else
    v &= 0xFFu;
    return (plc8)(v < 0x80u ? (int)v : -(int)(0xFFu - v) - 1);
#endif
}
",
    },
    CHelper {
        name: "Plc16",
        text: "\
static plc16 Plc16(unsigned v)
{
#ifdef PLC_WRAPS
    return (plc16)v;
#else
    v &= 0xFFFFu;
    return (plc16)(v < 0x8000u ? (int)v : -(int)(0xFFFFu - v) - 1);
#endif
}
",
    },
    CHelper {
        name: "Plc24",
        text: "\
static plc32 Plc24(plcU32 v)
{
    v &= 0xFFFFFFUL;
    return v < 0x800000UL ? (plc32)v : -(plc32)(0xFFFFFFUL - v) - 1;
}
",
    },
    CHelper {
        name: "Plc32",
        text: "\
static plc32 Plc32(plcU32 v)
{
#ifdef PLC_WRAPS
    return (plc32)v;
#else
    return v < 0x80000000UL ? (plc32)v : -(plc32)(0xFFFFFFFFUL - v) - 1;
#endif
}
",
    },
];

const DIVIDE_HELPERS: [CHelper; 2] = [
    CHelper {
        name: "PlcDiv16",
        text: "\
static plc16 PlcDiv16(plc16 a, plc16 b)
{
    unsigned x = a < 0 ? 0u - (unsigned)a : (unsigned)a;
    unsigned y = b < 0 ? 0u - (unsigned)b : (unsigned)b;
    if (y == 0)
        return (plc16)(a < 0 ? 1 : -1);
    x /= y;
    return Plc16((a < 0) != (b < 0) ? 0u - x : x);
}
",
    },
    CHelper {
        name: "PlcDiv32",
        text: "\
static plc32 PlcDiv32(plc32 a, plc32 b)
{
    plcU32 x = a < 0 ? 0u - (plcU32)a : (plcU32)a;
    plcU32 y = b < 0 ? 0u - (plcU32)b : (plcU32)b;
    if (y == 0)
        return a < 0 ? 1 : -1;
    x /= y;
    return Plc32((a < 0) != (b < 0) ? 0u - x : x);
}
",
    },
];

/// Returns the helpers that `body` calls, directly or through each other.
pub(super) fn called_helpers(body: &str) -> String {
    let divides: Vec<&CHelper> = DIVIDE_HELPERS.iter().filter(|helper| calls(body, helper.name)).collect();
    let needed = |name: &str| calls(body, name) || divides.iter().any(|helper| calls(helper.text, name));
    let wraps: Vec<&CHelper> = WRAP_HELPERS.iter().filter(|helper| needed(helper.name)).collect();
    let mut text = String::new();
    if !wraps.is_empty() {
        text += "\
\n/* The low bits of a result as a number with sign. The compilers named here convert so themselves; the other way is
   right with every compiler. */
#if (defined(__GNUC__) || defined(__SDCC)) && !defined(PLC_PORTABLE)
#define PLC_WRAPS
#endif
";
    }
    wraps.iter().for_each(|helper| text += helper.text);
    if !divides.is_empty() {
        text +=
            "\n/* Truncated quotients. x / 0 is -1 for x >= 0 and 1 for x < 0; the lowest number / -1 is itself. */\n";
    }
    divides.iter().for_each(|helper| text += helper.text);
    text
}

fn calls(text: &str, name: &str) -> bool {
    text.contains(&format!("{name}("))
}
