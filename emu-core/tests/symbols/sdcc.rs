//! Builds the sources of the folder again: the symbols name the bytes that the image has at their addresses.

use emu_core::image::{ElfMachine, ImageSpace, WordBits, load};
use emu_test_support::{empty_test_folder, run_tool};

use crate::{DIR, bytes, load as load_files};

const CODE: &[ImageSpace] = &[ImageSpace { name: "code", start: 0, len: 0x1_0000, word: 1, word_bits: WordBits::All }];

#[test]
#[ignore = "needs sdcc"]
fn symbols_name_the_bytes_of_the_image() {
    for model in ["small", "medium", "large"] {
        for debug in [true, false] {
            check(model, debug);
        }
    }
}

fn check(model: &str, debug: bool) {
    let folder = empty_test_folder!(format!("symbols-{model}-{debug}"));
    for name in ["main.c", "sensor.c", "sensor.h", "nudge.asm"] {
        std::fs::copy(format!("{DIR}/{name}"), folder.join(name)).unwrap();
    }
    let flag = format!("--model-{model}");
    let sdcc = |args: &[&str]| {
        let all: Vec<&str> =
            debug.then_some("--debug").into_iter().chain([flag.as_str()]).chain(args.iter().copied()).collect();
        run_tool("sdcc", &all, &folder);
    };
    run_tool("sdas8051", &["-plosgff", "nudge.asm"], &folder);
    sdcc(&["-c", "sensor.c"]);
    sdcc(&["-c", "main.c"]);
    sdcc(&["main.rel", "sensor.rel", "nudge.rel"]);

    let mut names = vec!["main.map", "main.rst", "sensor.rst", "nudge.rst"];
    names.extend(debug.then_some("main.cdb"));
    let read = |name: &str| (name.to_owned(), std::fs::read(folder.join(name)).unwrap());
    let files: Vec<(String, Vec<u8>)> = names.into_iter().map(read).collect();
    agrees(&format!("{model} {debug}"), &files, &read("main.ihx").1);
}

/// The files kept in the folder come from one build.
#[test]
fn kept_symbols_name_the_bytes_of_the_kept_image() {
    let names = ["small/main.map", "small/main.cdb", "small/main.rst", "small/sensor.rst", "small/nudge.rst"];
    let files: Vec<(String, Vec<u8>)> = names.map(|name| (name.to_owned(), bytes(name))).into();
    agrees("kept", &files, &bytes("small/main.ihx"));
}

fn agrees(what: &str, files: &[(String, Vec<u8>)], hex: &[u8]) {
    let symbols = load_files(files).unwrap_or_else(|e| panic!("{what}: {e:#?}"));
    let image = load("main.ihx", hex, CODE, &[], ElfMachine::MCS51).unwrap_or_else(|e| panic!("{e:?}")).image;
    let mut code = vec![0; 0x1_0000];
    image.fill("code", &mut code);
    let at = |space: &str, name: &str| {
        let found = symbols.symbols.iter().find(|s| s.space == space && s.name == name);
        found.unwrap_or_else(|| panic!("{what}: no {space} {name}")).addr as usize
    };
    let found = |name: &str, wanted: &[u8]| {
        let from = at("code", name);
        assert_eq!(code[from..from + wanted.len()], *wanted, "{what} {name}");
    };
    let call = |to: usize| [0x12, (to >> 8) as u8, to as u8];
    found("squares", &[0, 1, 4, 9, 16]);
    found("table", &[7, 8]);
    // inc nudges; setb nudged
    found("asm_nudge", &[0x05, at("idata", "nudges") as u8, 0xD2, at("bit", "nudged") as u8]);
    // The vector of timer 0 is a jump to its function.
    assert_eq!(code[0x0B..0x0E], [0x02, (at("code", "on_timer") >> 8) as u8, at("code", "on_timer") as u8]);
    let main = at("code", "main");
    let body = &code[main..main + 0x120];
    for name in ["_asm_nudge", "sensor_read", "main.twice"] {
        let call = call(at("code", name));
        assert!(body.windows(3).any(|w| w == call), "{what}: main does not call {name}");
    }
    // Line 47 is only `mov AUXR, #1`.
    assert!(body.windows(3).any(|w| w == [0x75, at("sfr", "AUXR") as u8, 1]));
    let line = symbols.lines.iter().find(|l| &*l.file == "main.c" && l.line == 47).expect("line 47");
    assert_eq!(code[line.addr as usize..][..3], [0x75, at("sfr", "AUXR") as u8, 1]);
}
