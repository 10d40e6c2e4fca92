//! The output of `emu disasm` assembles back to the same image: random words with gaps on every chip, and
//! every image of the tree on every chip that accepts it.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use emu_core::chip::Chip;
use emu_core::image::{ElfMachine, Image, ImageSpace, Segment, WordBits, load, write_hex};
use emu_core::rng::Rng;

/// Number of images per chip. EMU_DISASM_ROUNDS gives more.
const ROUNDS: u64 = 2;

fn chips() -> Vec<&'static Chip> {
    let avr = emu_avr::chips::AVR_CHIPS.iter().copied();
    let others = emu_8051::chips::chips().chain(emu_pic16::chips::chips()).chain(emu_ap101::chips::chips());
    avr.chain(others).collect()
}

/// Returns the output of `emu disasm` for a file, or for text on its standard input.
fn disasm(chip: &Chip, file: &str, input: &[u8]) -> Result<String, String> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_emu"));
    command.args(["disasm", file, "--mcu", chip.name]);
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("emu runs");
    child.stdin.take().expect("a pipe").write_all(input).expect("read");
    let run = child.wait_with_output().expect("emu ends");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
    if run.status.success() { Ok(text(run.stdout)) } else { Err(text(run.stderr)) }
}

/// Returns the bytes of an image in a canonical order, with only the bits that the memory keeps. RAM is
/// omitted, because only a debugger fills it.
fn bytes(chip: &Chip, image: &Image) -> Vec<Segment> {
    let mut segments = image.segments.clone();
    segments.retain(|segment| segment.space != chip.ram_space);
    for segment in &mut segments {
        if let Some(ImageSpace { word_bits: WordBits::Low(bits), .. }) =
            chip.hex_spaces.iter().find(|space| space.name == segment.space)
        {
            let mask = ((1u16 << bits) - 1).to_le_bytes();
            segment.bytes.iter_mut().zip(mask.iter().cycle()).for_each(|(byte, mask)| *byte &= mask);
        }
    }
    segments.sort_by_key(|segment| (segment.space, segment.addr));
    segments
}

/// Assembles the text and compares the images; the error shows the first difference.
fn compare(chip: &'static Chip, text: &str, wanted: &Image) -> Result<(), String> {
    let ours = emu_asm::assemble_text(chip, text).map_err(|refused| refused.to_string())?;
    let (ours, wanted) = (bytes(chip, &ours), bytes(chip, wanted));
    if ours == wanted {
        return Ok(());
    }
    let flat = |list: &[Segment]| -> Vec<(&str, u32, u8)> {
        let each = list.iter().flat_map(|s| (s.addr..).zip(&s.bytes).map(|(addr, byte)| (s.space, addr, *byte)));
        each.collect()
    };
    let (ours, wanted) = (flat(&ours), flat(&wanted));
    let at = ours.iter().zip(&wanted).position(|(a, b)| a != b).unwrap_or(ours.len().min(wanted.len()));
    Err(format!("{:x?} in place of {:x?}", ours.get(at), wanted.get(at)))
}

/// Adds random bytes of a memory with gaps, some of them erased, within the bits of its words.
fn random(rng: &mut Rng, chip: &Chip, space: &ImageSpace, into: &mut Vec<(u32, Vec<u8>)>) {
    let (size, erased) = (space.word.max(chip.word_bytes), chip.isa.erased_word);
    let words = space.len / size;
    let mask = match space.word_bits {
        WordBits::All => u16::MAX,
        WordBits::Only(bits) | WordBits::Low(bits) => (1 << bits) - 1,
    };
    let word = |word: u16| word.to_le_bytes().into_iter().take(size as usize).collect::<Vec<u8>>();
    let mut below = |n: u32| rng.below(n.into()) as u32;
    let mut at = if below(2) == 0 { 0 } else { below(words.min(64)) };
    for _ in 0..4 {
        let count = (1 + below(80)).min(words.saturating_sub(at));
        let plain = below(3) == 0;
        let stretch: Vec<u8> = (0..count)
            .flat_map(|_| word(if plain || below(8) == 0 { erased & mask } else { below(0x1_0000) as u16 & mask }))
            .collect();
        if !stretch.is_empty() {
            into.push((space.start + at * size, stretch));
        }
        at += count + 1 + below(words / 5 + 1);
    }
    // Always include the last word of the memory.
    if at < words {
        into.push((space.start + (words - 1) * size, word(below(0x1_0000) as u16 & mask)));
    }
}

fn loaded(chip: &Chip, name: &str, bytes: &[u8]) -> Option<Image> {
    load(name, bytes, chip.hex_spaces, chip.elf_spaces, ElfMachine(chip.elf_machine)).ok().map(|loaded| loaded.image)
}

#[test]
fn random_words_come_back() {
    let rounds = std::env::var("EMU_DISASM_ROUNDS").map_or(ROUNDS, |n| n.parse().expect("a number"));
    let (mut wrong, mut words) = (Vec::new(), 0);
    for (n, chip) in (0..).zip(chips()) {
        for round in 0..rounds {
            let seed = n * 1000 + round;
            let mut rng = Rng::new(seed);
            let mut parts = Vec::new();
            for space in chip.hex_spaces {
                // The configuration block of AP101 must be complete and valid, or the image is refused.
                if chip.name == "ap101" && space.name == "config" {
                    let mut block = vec![0; space.len as usize];
                    block[..4].copy_from_slice(b"AP\x01\0");
                    parts.push((space.start, block));
                    continue;
                }
                random(&mut rng, chip, space, &mut parts);
            }
            let parts: Vec<_> =
                parts.iter().map(|(addr, bytes)| emu_core::image::HexSegment { addr: *addr, bytes }).collect();
            let hex = write_hex(&parts);
            let image = loaded(chip, "random", hex.as_bytes()).expect("an image");
            words += image.segments.iter().map(|s| s.bytes.len()).sum::<usize>();
            let text = disasm(chip, "-", hex.as_bytes()).expect("instructions");
            if let Err(why) = compare(chip, &text, &image) {
                wrong.push(format!(
                    "{}, seed {seed}: {}",
                    chip.name,
                    why.lines().take(3).collect::<Vec<_>>().join("\n  ")
                ));
            }
        }
    }
    println!("{} chips, {words} bytes", chips().len());
    assert!(wrong.is_empty(), "{} of {}\n{}", wrong.len(), chips().len() as u64 * rounds, wrong.join("\n"));
}

/// Collects HEX and ELF files below a folder.
fn images(dir: &Path, out: &mut Vec<PathBuf>) {
    let Ok(entries) = fs::read_dir(dir) else { return };
    let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    for path in paths {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if path.is_dir() && name != "target" && !name.starts_with('.') {
            images(&path, out);
        } else if path.extension().is_some_and(|end| ["hex", "ihx", "elf"].iter().any(|known| end == *known)) {
            out.push(path);
        }
    }
}

#[test]
fn images_of_the_tree_come_back() {
    let mut files = Vec::new();
    images(Path::new(env!("CARGO_MANIFEST_DIR")), &mut files);
    let (mut wrong, mut count, mut none) = (Vec::new(), 0, 0);
    for file in &files {
        let bytes = fs::read(file).expect("a file");
        let mut taken = false;
        for name in ["atmega328p", "atmega128", "8052", "pic16f877a", "pic16f84", "ap101"] {
            let chip = chips().into_iter().find(|chip| chip.name == name).expect("a chip");
            let Some(image) = loaded(chip, "image", &bytes) else { continue };
            // The verb refuses images that were linked for another AVR.
            let Ok(text) = disasm(chip, &file.to_string_lossy(), &[]) else { continue };
            (taken, count) = (true, count + 1);
            if let Err(why) = compare(chip, &text, &image) {
                wrong.push(format!(
                    "{} on {name}: {}",
                    file.display(),
                    why.lines().take(3).collect::<Vec<_>>().join("\n  ")
                ));
            }
        }
        none += usize::from(!taken);
    }
    println!("{} files, {count} images, {none} files that no chip takes", files.len());
    assert!(count > 100, "{count} images");
    assert!(wrong.is_empty(), "{} of {count}\n{}", wrong.len(), wrong.join("\n"));
}
