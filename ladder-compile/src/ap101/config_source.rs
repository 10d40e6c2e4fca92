//! Writes the AP101 configuration as lines of an assembly source.

use std::fmt::Write;

use emu_ap101::config::{Ap101Config, ModuleKind, ModuleTimeUnit};
use emu_core::image::{Image, Segment};

/// Returns the `emu asm` directives for a configuration block; `None` if the block is not a valid
/// configuration.
#[must_use]
pub fn config_directives(block: &[u8]) -> Option<String> {
    let segment = Segment { space: "config", addr: 0, bytes: block.to_vec() };
    let config = Ap101Config::read_config(&Image { segments: vec![segment], ..Image::default() }).ok()?;
    let mut out =
        format!("    channels {}, {}\n    clock {}\n", config.input_channels, config.output_channels, config.hz);
    _ = writeln!(out, "    period {}c", config.period);
    for program in &config.programs {
        _ = writeln!(out, "    program {}, {}", program.start, program.last);
    }
    for (number, module) in config.modules.iter().enumerate().filter(|(_, module)| module.kind != ModuleKind::None) {
        let kind = format!("{:?}", module.kind).to_ascii_uppercase();
        let unit = match module.unit {
            ModuleTimeUnit::Cycle if module.kind.is_counter() => "",
            ModuleTimeUnit::Cycle => " cycle,",
            ModuleTimeUnit::Ms1 => " 1ms,",
            ModuleTimeUnit::Ms10 => " 10ms,",
            ModuleTimeUnit::Ms100 => " 100ms,",
        };
        _ = writeln!(out, "    module R{number}, {kind},{unit} {}", module.preset);
    }
    Some(out)
}
