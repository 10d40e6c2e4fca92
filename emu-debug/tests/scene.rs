//! Stimuli of scenarios as drives at fixed times (`chip_scenario::timed_drives`): steps, and the resulting
//! cycles and clocks.

use emu_core::chip::Chip;
use emu_core::pins::{PinId, PinLevel};
use emu_debug::chip_scenario::{ChipBindings, ChipResolver, timed_drives};
use emu_debug::stimulus::ExternalDrive;
use emu_debug::{AddressNames, CycleClock};
use emu_pic16::chips::PIC16F873;

/// `steps => drives`, on a PIC16F873 at 4 MHz with four clocks per cycle: `cycle.clock NAME=VALUE`; or the
/// position and code of a refusal.
const ROWS: &str = r#"
    set = { RB0 = 1, RA0 = "1.25V" }; after = "2.5us", set = { VDD = "4.5V" } => 0.0 RB0=High; 0.0 RA0=1250mV; 2.2 VDD=4500mV
    at = "10us", pulse = { RB1 = 1 }, for = "3 cycles"                        => 10.0 RB1=High; 13.0 RB1=Low
    every = "1us", times = 3, toggle = "RB0"                                  => 0.0 RB0=High; 1.0 RB0=Low; 2.0 RB0=High
    repeat = 2, steps = [{ set = { RB0 = "z" } }, { after = "5 clocks" }]     => 0.0 RB0=Float; 1.1 RB0=Float
    ramp = { RA1 = ["0V", "2V"] }, over = "4us", grain = "2us"                => 0.0 RA1=0mV; 2.0 RA1=1000mV; 4.0 RA1=2000mV
    log = "nothing"; set = { RA0 = "512counts" }                              => 0.0 RA0=512
    at = "1ms", uart-send = [0xFF]                                            => 0.0 RC7=High; 1000.0 RC7=Low; 1104.0 RC7=High
    set = { RB0 = 1 }; wait = { RB1 = 1 }                                     => 4:1 SCN012
    never = { RB0 = 1 }                                                       => 2:1 SCN012
    expect-uart = "a"                                                         => 2:1 SCN012
    every = "1us", toggle = "RB0"                                             => 3:1 SCN012
    set = { RB0 = 1 }; power-cycle = true                                     => 4:1 SCN012
    set = { RB0 = 1 }; set = { "data:0x20" = 1, RB0 = 0 }                     => 4:1 SCN012
    ramp = { "data:0x20" = [0, 9] }, over = "4us"                             => 2:1 SCN012
    set = { RB9 = 1 }                                                         => 2:9 SCN006
    ramp = { RA1 = ["0V", "2V"] }, over = "1s", grain = "99us"                => 4:9 SCN005
    uart-send = "U"; uart-send = [0xFF]                                       => 0.0 RC7=High; 0.0 RC7=Low; 104.0 RC7=High; 208.1 RC7=Low; 312.2 RC7=High; 416.2 RC7=Low; 520.3 RC7=High; 625.0 RC7=Low; 729.0 RC7=High; 833.1 RC7=Low; 937.2 RC7=High; 1041.2 RC7=Low; 1145.3 RC7=High
"#;

fn name(chip: &Chip, pin: PinId) -> &'static str {
    chip.pins[usize::from(pin)].name
}

fn found(steps: &str) -> String {
    let chip = &PIC16F873.chip;
    // Commas at the outermost level separate the keys of a step.
    let mut text = String::new();
    for step in steps.split("; ") {
        text += "[[step]]\n";
        let mut depth = 0;
        for c in step.chars() {
            depth += i32::from("[{".contains(c)) - i32::from("]}".contains(c));
            text.push(if c == ',' && depth == 0 { '\n' } else { c });
        }
        text.push('\n');
    }
    let scenario = scenario::parse("row.toml", &text.replace("\n ", "\n")).expect(steps);
    let mut site = ChipResolver {
        names: AddressNames { chip, symbols: &[] },
        clock: CycleClock { hz: 4_000_000, clocks_per_cycle: 4 },
        has_byte: &|space, addr| space == "data" && addr < 0x200,
        has_pin: &|_| true,
        check_drive: &|_| Ok(()),
        canonical_pin_name: &|name| name.to_owned(),
        serial: (true, chip.pin("RC7")),
        no_snapshots: Some("a test writes no snapshots".to_owned()),
        no_serial_input: None,
        bindings: ChipBindings::default(),
    };
    match timed_drives(&scenario, &mut site, None, 9_600) {
        Ok(drives) => {
            let shown = drives.iter().map(|drive| {
                let what = match drive.drive {
                    ExternalDrive::Level(pin, PinLevel::PullUp | PinLevel::PullDown) => {
                        format!("{}=resistor", name(chip, pin))
                    }
                    ExternalDrive::Level(pin, level) => format!("{}={level:?}", name(chip, pin)),
                    ExternalDrive::Volts(pin, millivolts) => format!("{}={millivolts}mV", name(chip, pin)),
                    ExternalDrive::Counts(pin, count) => format!("{}={count}", name(chip, pin)),
                    ExternalDrive::Supply(millivolts) => format!("VDD={millivolts}mV"),
                };
                format!("{}.{} {what}", drive.at.cycle, drive.at.phase)
            });
            shown.collect::<Vec<_>>().join("; ")
        }
        Err(faults) => {
            let shown = faults.iter().map(|fault| format!("{}:{} {}", fault.pos.line, fault.pos.column, fault.code));
            shown.collect::<Vec<_>>().join("; ")
        }
    }
}

#[test]
fn stimuli_become_drives() {
    let rows = ROWS.lines().filter_map(|row| row.split_once("=>"));
    let wrong: Vec<String> = rows
        .filter(|(steps, wanted)| found(steps.trim()) != wanted.trim())
        .map(|(steps, wanted)| {
            format!("{}\n  found  {}\n  wanted {}", steps.trim(), found(steps.trim()), wanted.trim())
        })
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
