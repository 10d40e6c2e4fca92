//! Tests whole images: complete and consistent maps, a reviewed listing, sizes and times, and long programs.

use crate::common::{CompiledChip, cases, compiled, options, pairs, program};
use emu_core::{Cpu, CycleTime, PinLevel, RamInit};
use ladder::ProgramElement;
use ladder_compile::{ImageMap, compile};

/// A traffic light program: clock, phases, a request button, five lamps.
const LIGHT: &str = include_str!("data/light.ld");

#[test]
fn the_map_has_everything_of_the_program() {
    for table in [include_str!("data/bits.txt"), include_str!("data/timers.txt"), include_str!("data/integers.txt")] {
        for (name, sections) in cases(table) {
            complete(&name, &program(&sections[0]));
        }
    }
    complete("light", &program(LIGHT));
}

fn complete(name: &str, program: &ladder::LadderProgram) {
    let compiled = compiled(program);
    let map = &compiled.map;
    let listed: Vec<(u32, u32)> = map.elements.iter().map(|e| (e.rung - 1, e.element - 1)).collect();
    let wanted: Vec<(u32, u32)> = program.elements().map(|ProgramElement { id, .. }| (id.rung, id.index)).collect();
    assert_eq!(listed, wanted, "{name}: elements");
    assert_eq!(map.rungs.len(), program.rungs.len(), "{name}: rungs");
    let names = |of: &[String]| of.join(" ");
    let found: Vec<String> = map.symbols.iter().map(|s| s.name.clone()).collect();
    let wanted: Vec<String> = program.symbols().into_iter().map(|s| s.name).collect();
    assert_eq!(names(&found), names(&wanted), "{name}: symbols");
    let mut at = map.rungs.first().map_or(0, |rung| rung.start);
    for rung in &map.rungs {
        assert_eq!(rung.start, at, "{name}: rung {} follows the one before", rung.rung);
        for element in map.elements.iter().filter(|e| e.rung == rung.rung) {
            assert_eq!(element.start, at, "{name}: {} follows the element before", element.text);
            assert!(element.end >= element.start);
            at = element.end;
        }
        assert_eq!(rung.end, at, "{name}: rung {} ends with its last element", rung.rung);
    }
    assert!(map.scan_start < map.rungs[0].start && at <= map.scan_end && map.scan_end < map.code_bytes);
    let text = serde_json::to_string(map).expect("JSON");
    assert_eq!(&serde_json::from_str::<ImageMap>(&text).expect("reads back"), map, "{name}");
}

#[test]
fn golden_listing() {
    let compiled = compiled(&program(include_str!("data/latch.ld")));
    let golden = include_str!("data/latch.lst");
    assert_eq!(compiled.listing, golden, "\n{}", compiled.listing);
    // The HEX file contains the words of the listing, low byte first.
    let words = golden.lines().filter(|l| l.get(4..6) == Some("  ") && !l.starts_with(';'));
    let bytes: Vec<u8> = words
        .flat_map(|l| l[6..15].split_whitespace().map(|w| u16::from_str_radix(w, 16).expect("hex")).collect::<Vec<_>>())
        .flat_map(u16::to_le_bytes)
        .collect();
    assert_eq!(compiled.code, bytes);
}

/// For comparison, on an ATmega8 and a similar traffic light, LDmicro 2.3 needs 2,154 bytes and about 1,016
/// clocks per scan, 5.4 needs 1,448 and 547.
#[test]
fn a_crossing_light_is_small_and_fast() {
    let map = compiled(&program(LIGHT)).map;
    println!("light: {} bytes, {} clocks, {} bytes of RAM", map.code_bytes, map.worst_scan_cycles, map.ram_bytes);
    assert!(map.code_bytes < 300, "{} bytes", map.code_bytes);
    assert!(map.worst_scan_cycles < 120, "{} clocks", map.worst_scan_cycles);
}

#[test]
fn pins_are_read_and_written() {
    let compiled = compiled(&program("RUNG\nCONTACTS Xa 0\nPARALLEL\nCOIL Ya 0 0 0\nCOIL Yn 1 0 0\nEND\nEND"));
    let mut chip = CompiledChip::new(&compiled, RamInit::Random(3));
    let pin = |name: &str| {
        let pin = &compiled.map.pins.iter().find(|p| p.name == name).expect("a pin").pin;
        emu_avr::chips::ATMEGA328P.pin(pin).expect("of the chip")
    };
    // Before the first scan, outputs are low and the input is pulled up.
    assert_eq!((chip.cpu.pin_level(pin("Xa")), chip.cpu.pin_level(pin("Ya"))), (PinLevel::High, PinLevel::Low));
    for (level, ya, yn) in [(true, true, false), (false, false, true), (true, true, false)] {
        let now = CycleTime::at(chip.cpu.cycle());
        chip.cpu.drive(now, pin("Xa"), PinLevel::from_bit(level));
        chip.run_to(compiled.map.scan_start);
        chip.run_to(compiled.map.scan_end);
        let after = chip.cpu.cycle() + 2;
        chip.cpu.run(after, &mut ());
        assert_eq!(
            (chip.cpu.pin_level(pin("Ya")), chip.cpu.pin_level(pin("Yn"))),
            (PinLevel::from_bit(ya), PinLevel::from_bit(yn)),
            "Xa={level}"
        );
    }
}

/// Tests long forms: more than 2,048 words between the poll loop and the end of the scan, branches over more
/// than 64 words, bits and words beyond the reach of one-word accesses.
#[test]
fn long_programs_reach_everything() {
    let mut text = String::from("LDmicro0.1\nCYCLE=10000\nCRYSTAL=16000000\nIO LIST\nEND\nPROGRAM\n");
    for n in 0..200 {
        text +=
            &format!("RUNG\nCONTACTS Xa 0\nOSR\nCOIL R{n} 0 1 0\nEND\nRUNG\nCONTACTS R{n} 0\nADD v{n} v{n} {n}\nEND\n");
        text += &format!("RUNG\nCONTACTS R{n} 0\nTON T{n} 30000\nCTD C{n} {n}\nCOIL Q{n} 0 0 0\nEND\n")
            .replace(" Q", " RQ");
    }
    text += "RUNG\nDIV w v199 7\nEND\n";
    let compiled = compiled(&program(&text));
    assert!(compiled.map.code_bytes > 8192, "{} bytes", compiled.map.code_bytes);
    let mut chip = CompiledChip::new(&compiled, RamInit::Random(9));
    for scan in 1..=4 {
        let clocks = chip.scan(&pairs("Xa=1"));
        assert!(clocks <= u64::from(compiled.map.worst_scan_cycles));
        for n in [0, 1, 31, 32, 63, 64, 100, 150, 199] {
            assert_eq!(chip.get(&format!("R{n}")), 1);
            assert_eq!(chip.get(&format!("v{n}")), scan * n);
            assert_eq!(chip.get(&format!("T{n}")), scan.min(2));
            // The timer is true from the third scan on, so the counter has counted down once.
            let count = if scan >= 3 { -1 } else { 0 };
            assert_eq!(chip.get(&format!("C{n}")), count);
            assert_eq!(chip.get(&format!("RQ{n}")), i32::from(count >= n));
        }
        assert_eq!(chip.get("w"), scan * 199 / 7);
    }
}

#[test]
fn the_same_program_gives_the_same_image() {
    let program = program(LIGHT);
    let (one, two) = (compiled(&program), compile(&program, &options()).expect("compiles"));
    assert_eq!(one, two);
}
