//! The programs in this folder: an instruction a line, `;` begins a comment, `name:` in front a label; `.org` moves on,
//! `.ascii "TEXT"` is a text without any of `;:"`.

use emu_8051::isa::assemble;
use emu_core::image::{Image, Segment};

/// Rungs of the ladder.
pub const RUNGS: usize = 96;

/// Names and sources. `bits` is the ladder of [`rungs`].
pub fn programs() -> Vec<(&'static str, String)> {
    let sources = [
        ("alu", include_str!("alu.s")),
        ("sieve", include_str!("sieve.s")),
        ("tick", include_str!("tick.s")),
        ("idle", include_str!("idle.s")),
    ];
    let mut list: Vec<_> = sources.into_iter().map(|(name, source)| (name, source.to_owned())).collect();
    list.insert(3, ("bits", ladder()));
    list
}

/// One rung: bits by number (byte 20h + n / 8), the first sixteen are inputs.
#[derive(Debug, Clone, Copy)]
pub struct Rung {
    /// Bits that are read.
    pub read: [u8; 4],
    /// The bit that is written.
    pub coil: u8,
    /// 0: a coil, 1: one that is set, 2: one that is reset.
    pub kind: u8,
}

/// Rungs drawn by a fixed rule: (a AND b OR NOT c) AND NOT d, to a coil, which every fifth rung sets and every fifth resets.
pub fn rungs() -> Vec<Rung> {
    let mut state = 1u32;
    let mut draw = |below: usize| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        ((state >> 16) as usize % below) as u8
    };
    (0..RUNGS)
        .map(|i| Rung { read: std::array::from_fn(|_| draw(16 + i)), coil: 16 + i as u8, kind: [0, 0, 0, 1, 2][i % 5] })
        .collect()
}

/// A scan of the ladder, as a compiler of ladders writes it, for ever: R6 and R7 count the scans, and are the inputs; the coils are at 22h
/// to 2Dh.
fn ladder() -> String {
    let bit = |n: u8| format!("0x{:02X}.{}", 0x20 + n / 8, n % 8);
    let mut text =
        String::from("clr A\nmov R6, A\nmov R7, A\nmov R0, #0x20\nclear: mov @R0, A\ninc R0\ncjne R0, #0x30, clear\n");
    text += "scan: mov 0x20, R6\nmov 0x21, R7\n";
    for (i, Rung { read: [a, b, c, d], coil, kind }) in rungs().into_iter().enumerate() {
        let [a, b, c, d, coil] = [a, b, c, d, coil].map(bit);
        text += &format!("mov C, {a}\nanl C, {b}\norl C, /{c}\nanl C, /{d}\n");
        text += &match kind {
            0 => format!("mov {coil}, C\n"),
            1 => format!("jnc rung{i}\nsetb {coil}\nrung{i}:\n"),
            _ => format!("jnc rung{i}\nclr {coil}\nrung{i}:\n"),
        };
    }
    text + "inc R6\ncjne R6, #0, again\ninc R7\nagain: ljmp scan\n"
}

/// Assembles a program from address 0.
///
/// # Errors
/// The first line that is no instruction, with its number and the cause.
pub fn image(source: &str) -> Result<Image, String> {
    let mut labels = source.lines().filter_map(|line| Some((split(line).0?, None))).collect();
    // Twice: at first a label that is not known yet stands where it is used, which is in reach and as long as the right place.
    pass(source, &mut labels)?;
    let bytes = pass(source, &mut labels)?;
    Ok(Image { segments: vec![Segment { space: "code", addr: 0, bytes }], ..Image::default() })
}

/// The label in front of a line, and its instruction.
fn split(line: &str) -> (Option<&str>, &str) {
    let code = line.split(';').next().unwrap_or("").trim();
    code.split_once(':').map_or((None, code), |(label, rest)| (Some(label), rest.trim()))
}

fn pass(source: &str, labels: &mut Vec<(&str, Option<usize>)>) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    for (number, line) in (1..).zip(source.lines()) {
        let (label, code) = split(line);
        if let Some((_, place)) = labels.iter_mut().find(|(name, _)| Some(*name) == label) {
            *place = Some(bytes.len());
        }
        if let Some(place) = code.strip_prefix(".org ") {
            let place = emu_core::table::number(place.trim()).and_then(|p| usize::try_from(p).ok());
            bytes.resize(place.filter(|&p| p >= bytes.len()).ok_or(format!("line {number}: `{line}`"))?, 0xFF);
        } else if let Some(text) = code.strip_prefix(".ascii ") {
            bytes.extend(text.trim().trim_matches('"').bytes());
        } else if !code.is_empty() {
            let words = code.split_inclusive([' ', ',']).map(|word| {
                let bare = word.trim_start_matches('#').trim_end_matches([' ', ',']);
                let known = labels.iter().find(|(name, _)| *name == bare);
                known
                    .map_or(word.to_owned(), |(_, place)| word.replace(bare, &place.unwrap_or(bytes.len()).to_string()))
            });
            let words =
                assemble(&words.collect::<String>(), bytes.len() as u32).map_err(|e| format!("line {number}: {e}"))?;
            bytes.extend(words.into_iter().map(|word| word as u8));
        }
    }
    Ok(bytes)
}
