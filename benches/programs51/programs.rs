//! The benchmark programs for the 8052: the sources in this folder, and a generated ladder program.

/// Number of rungs of the ladder program.
pub const RUNGS: usize = 96;

/// Names and sources of the programs. `bits` is the ladder program of [`rungs`].
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

/// A rung. Bits are numbered: bit n is in byte 20h + n / 8; the first sixteen bits are inputs.
#[derive(Debug, Clone, Copy)]
pub struct Rung {
    /// The bits that are read.
    pub read: [u8; 4],
    /// The bit that is written.
    pub coil: u8,
    /// 0 for a coil, 1 for a set coil, 2 for a reset coil.
    pub kind: u8,
}

/// Rungs made by a fixed rule: (a AND b OR NOT c) AND NOT d, to a coil; one rung in five sets it, one in five
/// resets it.
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

/// An endless loop of scans of the ladder program, in the style of a ladder compiler. R6 and R7 count the
/// scans and are the inputs; the coils are in bytes 22h to 2Dh.
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
