//! Sources with random damage: nothing panics, every run ends, and every diagnostic has a position in the
//! source. EMU_SEED and EMU_CASES select other cases, and more of them.

mod common;

use common::{chip, chips};
use emu_asm::{AssembleOptions, IncludeFiles, SourceText, assemble};
use emu_core::rng::Rng;

/// Every include is the same small file.
struct Same;

impl IncludeFiles for Same {
    fn open(&mut self, name: &str, _: &str) -> std::io::Result<(String, Vec<u8>)> {
        Ok((name.to_owned(), b"included equ 1\n nop\n".to_vec()))
    }
}

fn variable(name: &str, otherwise: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(otherwise)
}

/// Pieces to insert: everything that the line reader looks for.
const PIECES: &[&str] = &[
    "'",
    "\"",
    "(",
    ")",
    ",",
    ":",
    ";",
    "\\",
    "#",
    "$",
    ".",
    "@",
    "=",
    "-",
    "~",
    "%",
    "/*",
    "*/",
    "<<",
    "\n",
    "\t",
    " ",
    "é",
    "\u{0}",
    "0x",
    "0FFH",
    "B'",
    "1f",
    "99999999999",
    "-1",
    " macro ",
    " endm\n",
    " rept 3\n",
    " endr\n",
    " rept 70\n",
    " if 1\n",
    " if x\n",
    " else\n",
    " endif\n",
    "#define a a b\n",
    "#define f(x) f(x) x\n",
    " include \"a\"\n",
    " org ",
    " ds ",
    " equ ",
    " org 0FFFFFFFFh\n",
    " ds 99999999\n",
    "x equ x+1\n",
    " irp x,1,2\n",
    " while 1\n",
    " endw\n",
    "m macro\n m\n m\n endm\n m\n",
    " local x\n",
    " db ",
    " end\n",
    " .section ",
    " exitm\n",
    "1$:",
    "\\@",
    "\\()",
    "{",
    "[",
    " .area CSEG (CODE)\n",
    " .area DSEG (DATA)\n",
    " .area BSEG (BIT)\n",
    " .area SSEG\n",
    " .area GSINIT0 (ABS,PAG,OVR,XDATA)\n",
    "p segment code inblock\n rseg p\n",
    "?stack segment idata\n rseg ?stack\n",
    " cseg at 0\n",
    " .ascii /",
    " lit 'x'\n",
    "$SET (x=1)\n",
    "$IF x\n",
    " elseifdef x\n",
    "<",
    ">",
];

fn damaged(text: &str, rng: &mut Rng) -> Vec<u8> {
    let mut bytes = text.as_bytes().to_vec();
    for _ in 0..1 + rng.below(4) {
        let at = rng.below(bytes.len() as u64 + 1) as usize;
        let end = (at + rng.below(12) as usize).min(bytes.len());
        match rng.below(5) {
            0 => drop(bytes.drain(at..end)),
            1 => bytes.splice(at..at, PIECES[rng.below(PIECES.len() as u64) as usize].bytes()).for_each(drop),
            2 => bytes.splice(at..end, PIECES[rng.below(PIECES.len() as u64) as usize].bytes()).for_each(drop),
            3 => {
                let copy = bytes[at..(at + rng.below(200) as usize).min(bytes.len())].to_vec();
                let to = rng.below(bytes.len() as u64 + 1) as usize;
                bytes.splice(to..to, copy).for_each(drop);
            }
            _ if at < bytes.len() => bytes[at] = rng.below(256) as u8,
            _ => {}
        }
    }
    bytes
}

#[test]
fn damaged_sources_are_refused_or_taken_and_nothing_else() {
    let (seed, cases) = (variable("EMU_SEED", 1), variable("EMU_CASES", 600));
    println!("EMU_SEED={seed} EMU_CASES={cases}");
    let mut rng = Rng::new(seed);
    let folder = format!("{}/tests/cases", env!("CARGO_MANIFEST_DIR"));
    let mut texts: Vec<(String, String)> = std::fs::read_dir(folder)
        .expect("cases")
        .map(|entry| std::fs::read_to_string(entry.expect("an entry").path()).expect("a text"))
        .flat_map(|text| {
            let cases = text.split("\n--- ").skip(1).filter_map(|case| {
                let (head, body) = case.split_once('\n')?;
                let source = body.lines().take_while(|line| !line.starts_with("= ") && !line.starts_with("! "));
                Some((head.split(' ').next()?.to_owned(), source.collect::<Vec<_>>().join("\n")))
            });
            cases.collect::<Vec<_>>()
        })
        .collect();
    texts.sort();
    let chips: Vec<_> = chips().collect();
    let (mut taken, mut refused) = (0, 0);
    for _ in 0..cases {
        let (name, text) = &texts[rng.below(texts.len() as u64) as usize];
        // Usually for their own chip, sometimes for another, even of another family.
        let own = chip(name).filter(|_| rng.below(8) > 0);
        let chip = own.unwrap_or(chips[rng.below(chips.len() as u64) as usize]);
        let bytes = damaged(text, &mut rng);
        let lines = bytes.iter().filter(|byte| matches!(byte, b'\n' | b'\r')).count() as u32 + 1;
        let source = SourceText { name: "a.asm", bytes: &bytes };
        let faults = match assemble(&source, chip, &AssembleOptions::default(), &mut Same) {
            Ok(assembled) => {
                taken += 1;
                let listing = assembled.listing.to_string();
                assert!(!listing.contains('\u{1}'), "names of labels within are not shown");
                assembled.warnings
            }
            Err(found) => {
                refused += 1;
                assert!(found.diagnostics.iter().any(|fault| fault.is_error()), "refused for a reason");
                found.diagnostics
            }
        };
        for fault in faults {
            assert!(fault.pos.line <= lines, "{fault}");
            assert!(!fault.cause.is_empty() && !fault.hint.is_empty(), "{fault}");
            assert!(emu_asm::CODES.iter().any(|code| code.code == fault.code), "{fault}: its code is explained");
        }
    }
    println!("{taken} taken, {refused} refused");
    assert!(taken * 50 > cases && refused * 4 > cases, "damage is neither too small nor too large: {taken}, {refused}");
}
