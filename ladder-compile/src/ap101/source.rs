//! The configuration as lines of an assembly source, so that a reader sees what it says.

use std::fmt::Write;

use emu_ap101::config::{Config, Kind, Unit};
use emu_core::image::{Image, Segment};

/// The directives of `emu asm` that give a block of the configuration; nothing where the block is none.
#[must_use]
pub fn directives(block: &[u8]) -> Option<String> {
    let segment = Segment { space: "config", addr: 0, bytes: block.to_vec() };
    let config = Config::of(&Image { segments: vec![segment], ..Image::default() }).ok()?;
    let mut out =
        format!("    channels {}, {}\n    clock {}\n", config.input_channels, config.output_channels, config.hz);
    _ = writeln!(out, "    period {}c", config.period);
    for program in &config.programs {
        _ = writeln!(out, "    program {}, {}", program.start, program.last);
    }
    for (number, module) in config.modules.iter().enumerate().filter(|(_, module)| module.kind != Kind::None) {
        let kind = format!("{:?}", module.kind).to_ascii_uppercase();
        let unit = match module.unit {
            Unit::Cycle if module.kind.counts() => "",
            Unit::Cycle => " cycle,",
            Unit::Ms1 => " 1ms,",
            Unit::Ms10 => " 10ms,",
            Unit::Ms100 => " 100ms,",
        };
        _ = writeln!(out, "    module R{number}, {kind},{unit} {}", module.preset);
    }
    Some(out)
}
