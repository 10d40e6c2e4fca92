//! Tests that the assembly source of an image assembles to the same bytes.

use std::collections::BTreeSet;

use crate::common::ladders::random_ladder;
use crate::common::{cases, program};
use emu_core::rng::Rng;
use ladder::LadderProgram;
use ladder_compile::{CompileOptions, assembly, compile, targets};

#[test]
fn sources_assemble_to_the_image() {
    let mut seen = BTreeSet::new();
    let mut turn = 0;
    for table in [include_str!("data/bits.txt"), include_str!("data/timers.txt"), include_str!("data/integers.txt")] {
        for (_, sections) in cases(table) {
            turn += 1;
            check_source(&program(&sections[0]), turn, &mut seen);
        }
    }
    for seed in 0..40 {
        let text = random_ladder(&mut Rng::new(seed), seed % 3 == 0);
        check_source(&ladder::parse("random.ld", &text).expect("reads").program, turn + seed as usize, &mut seen);
    }
    let all: BTreeSet<&str> = targets().map(|target| target.chip.name).collect();
    assert_eq!(seen, all, "every chip has taken a program");
}

/// Checks every fifth chip, starting at another one each time; every second program is unoptimised.
fn check_source(program: &LadderProgram, turn: usize, seen: &mut BTreeSet<&str>) {
    for target in targets().skip(turn % 5).step_by(5) {
        let options = CompileOptions {
            mcu: target.chip.name.to_owned(),
            optimise: turn.is_multiple_of(2),
            ..CompileOptions::default()
        };
        let Ok(compiled) = compile(program, &options) else { continue };
        let source = assembly(program, target.chip, &compiled.built, &compiled.map);
        let image = emu_asm::assemble_text(target.chip, &source)
            .unwrap_or_else(|e| panic!("{}: {e}\n{source}", target.chip.name));
        let wanted =
            emu_core::image::load_hex("image", compiled.hex.as_bytes(), target.chip.hex_spaces).expect("a sound image");
        let all = |image: &emu_core::image::Image| {
            let spaces = target.chip.spaces.iter().map(|space| space.name);
            spaces
                .flat_map(|name| {
                    image.bytes_in(name).map(move |cell| (name, (cell.addr, cell.byte))).collect::<Vec<_>>()
                })
                .collect::<Vec<_>>()
        };
        assert_eq!(all(&image), all(&wanted.image), "{}\n{source}", target.chip.name);
        seen.insert(target.chip.name);
    }
}
