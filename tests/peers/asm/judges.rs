//! The external assemblers: how to call each, its messages, and the memories that it fills.
//!
//! as31 reports errors of a source as warnings, and writes what it has. sdas8051 writes relocatable code,
//! which sdld places. gpasm knows chips, and numbers its messages; gplink places its relocatable code. avr-as
//! leaves addresses to avr-ld.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use emu_core::Chip;
use emu_core::chip::ChipFamily;
use emu_core::image::{ElfMachine, Image, load};

/// Memory cells of a chip that a program fills: memory and byte address.
pub type Cells = BTreeMap<(&'static str, u32), u8>;

/// An assembler, named after the folder of its corpus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Judge {
    As31,
    Sdas,
    Gpasm,
    Avr,
}

/// The output of an assembler for a source.
#[derive(Debug)]
pub struct Verdict {
    /// The filled cells; `None` if it wrote no file.
    pub cells: Option<Cells>,
    /// All messages, line by line.
    pub said: Vec<String>,
}

/// Returns the cells that an image fills.
pub fn cells(image: &Image) -> Cells {
    let of = |s: &emu_core::image::Segment| {
        let space = s.space;
        (s.addr..).zip(s.bytes.clone()).map(move |(addr, byte)| ((space, addr), byte)).collect::<Vec<_>>()
    };
    image.segments.iter().flat_map(of).collect()
}

impl Judge {
    pub const ALL: [Judge; 4] = [Judge::As31, Judge::Sdas, Judge::Gpasm, Judge::Avr];

    /// Returns the name of the assembler and of its folder.
    pub fn name(self) -> &'static str {
        match self {
            Judge::As31 => "as31",
            Judge::Sdas => "sdas",
            Judge::Gpasm => "gpasm",
            Judge::Avr => "avr",
        }
    }

    /// Returns the chip of its family with this name.
    pub fn chip(self, name: &str) -> &'static Chip {
        let found = match self {
            Judge::As31 | Judge::Sdas => emu_8051::chips::chip(name),
            Judge::Gpasm => emu_pic16::chips::chip(name),
            Judge::Avr => emu_avr::chips::chip(name),
        };
        found.unwrap_or_else(|| panic!("{}: no chip {name}", self.name()))
    }

    /// Assembles the file `source` in `home`, the folder of its includes, for `chip`. Output files go to
    /// `out`.
    pub fn assemble(self, home: &Path, source: &str, chip: &'static Chip, out: &Path) -> Verdict {
        // Some assemblers add this extension to the given name.
        let product = out.join(match self {
            Judge::Sdas => "product.ihx",
            Judge::Avr => "product.elf",
            Judge::As31 | Judge::Gpasm => "product.hex",
        });
        let object = out.join("product.rel");
        for old in [&product, &object] {
            let _ = std::fs::remove_file(old);
        }
        let at = |path: &Path| path.to_string_lossy().into_owned();
        let mut said = Vec::new();
        let mut call = |program: &str, args: &[&str]| say(program, args, home, &mut said);
        match self {
            Judge::As31 => call("as31", &["-Fhex", &format!("-O{}", at(&product)), source]),
            Judge::Sdas => {
                call("sdas8051", &["-o", &at(&object), source]);
                call("sdld", &["-i", &at(&product), &at(&object)]);
            }
            Judge::Gpasm if is_relocatable(&home.join(source)) => {
                let object = at(&out.join("product.o"));
                call("gpasm", &["-c", "-o", &object, source]);
                call("gplink", &["-o", &at(&product), &object]);
            }
            Judge::Gpasm => call("gpasm", &["-o", &at(&product), source]),
            Judge::Avr => {
                let core = match chip.flash_bytes {
                    ..=0x2000 => "avr4",
                    0x2001..=0x1_0000 => "avr5",
                    _ => "avr51",
                };
                if source.ends_with(".S") {
                    call("avr-gcc", &[&format!("-mmcu={}", chip.name), "-c", "-o", &at(&object), source]);
                } else {
                    call("avr-as", &[&format!("-mmcu={}", chip.name), "-o", &at(&object), source]);
                }
                // The linker scripts are not specific to a chip, so the start of RAM is given, and no heap is
                // requested.
                let data = format!("-Tdata={:#x}", 0x80_0000 + u32::from(chip.ram_start));
                let (product, object) = (at(&product), at(&object));
                let args =
                    ["-m", core, "--no-relax", "--defsym=__heap_end=0", "-Ttext=0", &data, &object, "-o", &product];
                call("avr-ld", &args);
            }
        }
        said.retain(|line| !is_chatter(line));
        let cells = std::fs::read(&product).ok().filter(|bytes| !bytes.is_empty()).map(|bytes| {
            let spaces = if chip.family == ChipFamily::Avr { chip.elf_spaces } else { chip.hex_spaces };
            let loaded = load(source, &bytes, spaces, spaces, ElfMachine(chip.elf_machine));
            let loaded = loaded.unwrap_or_else(|e| panic!("{}: {source}: {e:?}", self.name()));
            cells(&loaded.image)
        });
        Verdict { cells, said }
    }
}

/// Runs a program in `home` and adds its messages to `said`, without folder names.
fn say(program: &str, args: &[&str], home: &Path, said: &mut Vec<String>) {
    let output = Command::new(program).args(args).current_dir(home).output();
    let output = output.unwrap_or_else(|e| panic!("{program}: {e}"));
    for text in [output.stdout, output.stderr] {
        said.extend(String::from_utf8_lossy(&text).lines().map(str::trim).filter(|l| !l.is_empty()).map(str::to_owned));
    }
    if !output.status.success() {
        said.push(format!("{program}: {}", output.status));
    }
}

/// Returns true if the header of a gpasm source says that it is for gplink.
fn is_relocatable(source: &Path) -> bool {
    std::fs::read_to_string(source).is_ok_and(|text| text.lines().any(|line| line == "; linked"))
}

/// Returns the HEX file that an assembler wrote last.
pub fn product(out: &Path) -> String {
    std::fs::read_to_string(out.join("product.hex")).unwrap_or_else(|e| panic!("{}: {e}", out.display()))
}

/// Returns true for messages that appear for good sources too.
fn is_chatter(line: &str) -> bool {
    ["Begin Pass", "including file:", "incLineCount=", "ASlink >>", "message: Using default linker script"]
        .iter()
        .any(|start| line.starts_with(start))
}

/// Returns the folder of an assembler's corpus.
pub fn home(judge: Judge) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/peers/asm").join(judge.name())
}
