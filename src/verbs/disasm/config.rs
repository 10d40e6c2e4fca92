//! Turns the configuration block of AP101 into the directives that produce it.

use emu_ap101::InputSampling;
use emu_ap101::config::{Ap101Config, HZ, INPUTS, OUTPUTS};
use emu_ap101::modules::{ModuleKind, ModuleTimeUnit};
use emu_core::chip::{Chip, ChipFamily};
use emu_core::image::{Image, Segment};

/// Returns the directives for the block, one per line. Returns `None` if the segment is no such block, or if
/// no directives produce exactly its bytes.
pub(super) fn directives(chip: &'static Chip, segment: &Segment) -> Option<Vec<String>> {
    let only = Image { segments: vec![segment.clone()], ..Image::default() };
    let config = Ap101Config::read_config(&only).ok().filter(|_| chip.family == ChipFamily::Ap101)?;
    let lines = lines(&config);
    let made = emu_asm::assemble_text(chip, &lines.join("\n")).ok()?;
    (made.segments == only.segments).then_some(lines)
}

fn lines(config: &Ap101Config) -> Vec<String> {
    let mut lines = Vec::new();
    let mut say = |wanted: bool, line: String| lines.extend(wanted.then_some(line));
    // At least one directive is necessary for the assembler to write a block.
    let channels = (config.input_channels, config.output_channels);
    say(true, format!("channels {}, {}", channels.0.min(INPUTS), channels.1.min(OUTPUTS)));
    say(config.hz != HZ, format!("clock {}", config.hz));
    say(config.inputs == InputSampling::Live, "inputs live".to_owned());
    say(config.reconfigurable, "mode reconfigurable".to_owned());
    say(config.period > 0, format!("period {}c", config.period));
    for program in &config.programs {
        let off = config.enabled.get(usize::from(program.entry)) == Some(&false);
        let off = if off { ", off" } else { "" };
        say(true, format!("program 0x{:03X}, 0x{:03X}, {}{off}", program.start, program.last, program.rx));
    }
    for (n, module) in config.modules.iter().enumerate().filter(|(_, module)| module.kind != ModuleKind::None) {
        let (kind, preset) = (name(module.kind), module.preset);
        let unit = match module.unit {
            _ if module.kind.is_counter() => String::new(),
            ModuleTimeUnit::Cycle => "cycle, ".to_owned(),
            unit => format!("{}ms, ", unit.ms()),
        };
        say(true, format!("module R{n}, {kind}, {unit}{preset}"));
    }
    lines
}

fn name(kind: ModuleKind) -> &'static str {
    match kind {
        ModuleKind::None => "",
        ModuleKind::Ton => "TON",
        ModuleKind::Tof => "TOF",
        ModuleKind::Rto => "RTO",
        ModuleKind::Tp => "TP",
        ModuleKind::Ctu => "CTU",
        ModuleKind::Ctd => "CTD",
        ModuleKind::Ctc => "CTC",
    }
}
