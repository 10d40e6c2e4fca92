//! The mid-range PIC16 as gpasm takes it.

use emu_core::chip::Chip;

use super::common::{nothing, value_of, wanted};
use super::{Dialect, Directive, Form, Holds, Op, Provided, SectionRow};
use crate::engine::{Asm, Call};

/// What is kept during a pass.
#[derive(Debug, Default)]
pub(crate) struct State {}

/// The dialect.
#[rustfmt::skip]
pub(super) const PIC16: Dialect = Dialect {
    name: "PIC16",
    comments: &[";"],
    line_comments: &[],
    separators: b"",
    block_comments: false,
    column_one: true,
    column_one_warns: true,
    numbers: &[Form::Hex0x, Form::HexH, Form::Quoted, Form::DecimalDot, Form::Plain],
    radix: 16,
    dot_is_bit: false,
    here: &["$"],
    here_is_line: true,
    here_is_behind: false,
    operators: &[
        ("*", 10, Op::Mul), ("/", 10, Op::Div), ("%", 10, Op::Mod),
        ("+", 9, Op::Add), ("-", 9, Op::Sub),
        ("<<", 8, Op::Shl), (">>", 8, Op::Shr),
        (">=", 7, Op::GreaterEqual), (">", 7, Op::Greater), ("<", 7, Op::Less), ("<=", 7, Op::LessEqual),
        ("==", 6, Op::Equal), ("!=", 6, Op::Unequal),
        ("&", 5, Op::And), ("^", 4, Op::Xor), ("|", 3, Op::Or), ("&&", 2, Op::BothTrue), ("||", 1, Op::EitherTrue),
    ],
    unary: &[
        ("-", 11, |n| n.wrapping_neg()), ("+", 11, |n| n), ("~", 11, |n| !n), ("!", 11, |n| i64::from(n == 0)),
        ("low", 11, |n| n & 0xFF), ("high", 11, |n| n >> 8 & 0xFF), ("upper", 11, |n| n >> 16 & 0xFF),
    ],
    truth: 1,
    controls: false,
    numbered_labels: false,
    dollar_labels: false,
    any_case: false,
    plain_arguments: true,
    big_endian: false,
    word_bytes: 0,
    org_fills: None,
    spaced_arguments: false,
    space_fills: false,
    zones: false,
    literals: &[("W", 0), ("F", 1)],
    directives: &[
        Directive::run("dw", words),
        Directive::run("word", words),
        Directive::run("data", words),
        Directive::run("res", super::common::space),
        Directive::run("list", nothing),
    ],
    provides,
    defines: |_| Vec::new(),
    refuses: |_, _| None,
    finish: |_| (),
    sections: &[SectionRow { name: "code", space: "", holds: Holds::Image, behind: false }],
};

fn provides(_: &Chip, _: &str) -> Provided {
    Provided::No
}

/// One program word for each value.
fn words(asm: &mut Asm<'_>, call: &Call<'_>) {
    for part in wanted(asm, call) {
        let value = value_of(asm, call.text, part.clone(), 16) as u16;
        asm.emit_words(&[value], part);
    }
}
