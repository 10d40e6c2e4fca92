//! The PIC16 dialect: small sources with their words and diagnostics (pic16.txt). tests/peers_asm.rs of the
//! workspace compares whole programs with gpasm.
//!
//! A source follows `== CHIP: what it shows`. Then come lines `-- ADDR: WORDS` (hexadecimal; word addresses
//! and words; everything that the source emits), `-- remark LINE CODE` for each warning and note, and `--
//! error LINE CODE` for each error.

use std::io;

use emu_asm::{AssembleOptions, IncludeFiles, SourceText, assemble, named_chip};
use emu_core::Chip;
use emu_core::image::Image;
use emu_pic16::chips;

/// Prints the words of an image with their word addresses.
fn words(chip: &Chip, image: &Image) -> String {
    let mut out = Vec::new();
    for segment in &image.segments {
        let start = chip.hex_spaces.iter().find(|s| s.name == segment.space).map_or(0, |s| s.start);
        let words = segment.bytes.chunks(2).map(|w| format!(" {:04x}", u16::from_le_bytes([w[0], w[1]])));
        out.push(format!("{:x}:{}", (start + segment.addr) / 2, words.collect::<String>()));
    }
    out.join("\n")
}

#[test]
fn sources_give_these_words_and_these_complaints() {
    let mut wrong = Vec::new();
    let mut count = 0;
    for part in include_str!("pic16.txt").split("\n== ").skip(1) {
        let (title, rest) = part.split_once('\n').expect("a title line");
        let name = title.split(':').next().unwrap_or_default();
        let chip = chips::chip(name).unwrap_or_else(|| panic!("no chip {name}"));
        let (source, wanted): (Vec<&str>, Vec<&str>) = rest.lines().partition(|line| !line.starts_with("-- "));
        let text = source.join("\n");
        let options = AssembleOptions { find_chip: Some(chips::chip), ..AssembleOptions::default() };
        let found = assemble(&SourceText { name: "", bytes: text.as_bytes() }, chip, &options, &mut ());
        let tell = |list: &[diag::Diagnostic]| {
            let line = |d: &diag::Diagnostic| {
                format!("-- {} {} {}", if d.is_error() { "error" } else { "remark" }, d.pos.line, d.code)
            };
            list.iter().map(line).collect::<Vec<_>>()
        };
        let found: Vec<String> = match &found {
            Ok(done) => {
                let lines = words(chip, &done.image);
                lines.lines().map(|l| format!("-- {l}")).chain(tell(&done.warnings)).collect()
            }
            Err(refused) => tell(&refused.diagnostics).into_iter().filter(|l| l.starts_with("-- error")).collect(),
        };
        count += 1;
        if found != wanted {
            wrong.push(format!("== {title}\nwanted\n{}\nfound\n{}", wanted.join("\n"), found.join("\n")));
        }
    }
    assert!(count > 20, "only {count} sources");
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
}

#[test]
fn a_source_names_its_chip() {
    #[rustfmt::skip]
    let cases = [
        ("  list p=16F873, r=dec\n", Some("pic16f873")), ("\tLIST r=hex, P = PIC16F84A ; x\n", Some("pic16f84a")),
        ("; processor 16f88\n processor 16f877\n", Some("pic16f877")), (" list r=dec\n movlw 1\n", None), ("", None),
    ];
    for (source, name) in cases {
        assert_eq!(named_chip(source.as_bytes()).as_deref(), name, "{source}");
    }
}

/// The include file of a chip that is not known, and no other file.
struct Header;

impl IncludeFiles for Header {
    fn open(&mut self, name: &str, _: &str) -> io::Result<(String, Vec<u8>)> {
        match name {
            "p16f887.inc" => Ok((name.to_owned(), b"ANSELH equ 189\n".to_vec())),
            _ => Err(io::ErrorKind::NotFound.into()),
        }
    }
}

#[test]
fn the_file_of_a_chip_that_is_not_known_is_read() {
    let chip = chips::chip("pic16f877a").expect("a chip");
    let options = AssembleOptions { find_chip: Some(chips::chip), ..AssembleOptions::default() };
    let bytes = b" include <p16f887.inc>\n clrf ANSELH\n";
    let done = assemble(&SourceText { name: "", bytes }, chip, &options, &mut Header).expect("a program");
    assert_eq!(words(chip, &done.image), "0: 0189");
}
