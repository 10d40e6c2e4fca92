//! What `emu run` is asked for in scenarios: flags, files, and what is known before the first cycle.

use clap::Args;
use emu_core::chip::Family;
use emu_core::cpu::Cpu;
use emu_core::pins::{PinId, Time};
use emu_debug::Source;
use emu_debug::scene::{ChipSite, Table};
use emu_debug::stimulus::{Put, can, pin, supplies};
use emu_debug::text::unescape;
use scenario::{Done, Recorder, Value, bind};

use super::super::RunArgs;
use super::super::plan::Planned;
use super::Cast;
use crate::fail::Failure;
use crate::report::{Terminal, Texts, report};
use crate::scenarios::{self, File};
use crate::snapshots::Shelf;
use crate::{avr, family};

/// Flags of scenarios.
#[derive(Debug, Args)]
pub struct Asked {
    /// Play a scenario (docs/scenario.md): the run ends with it, with exit code 1 where an expectation was not met and 5 where
    /// something was still waited for at its limit. --for and --cycles are its limit.
    #[arg(long, value_name = "FILE")]
    pub scenario: Option<String>,
    /// Take a waveform (VCD) as stimulus: wires with the name of a pin drive it. Wires that name none are passed over.
    #[arg(long, value_name = "FILE")]
    pub stimulus: Option<String>,
    /// Of the wires of --stimulus only these: PD2,PD3. Repeatable.
    #[arg(long, value_name = "PIN", value_delimiter = ',', requires = "stimulus")]
    pub drive: Vec<String>,
    /// Write what was done to the chip (--set, --at, --uart-in, --scenario, --stimulus) as a scenario that does the same again.
    #[arg(long, value_name = "FILE")]
    pub record: Option<String>,
}

impl Asked {
    /// Anything of it.
    pub fn any(&self) -> bool {
        self.scenario.is_some() || self.stimulus.is_some() || self.record.is_some()
    }

    /// Reads the files and looks their names up on a machine.
    pub fn cast<C: Cpu>(
        &self,
        cpu: &C,
        source: &Source<'_>,
        (args, job, file): (&RunArgs, &Planned, Option<&File>),
        (shelf, terminal): (&Shelf, &Terminal),
    ) -> Result<Cast, Failure> {
        let there = |space: &str, addr: u32| cpu.peek(space, addr).is_some();
        let has_pin = |pin: PinId| cpu.has_pin(pin);
        let deaf = (!args.machine.uart_in.is_empty()).then(|| "--uart-in has the line already".to_owned());
        let devices = || "a snapshot holds no state of the devices of --attach".to_owned();
        let stateless = (!args.machine.attach.is_empty()).then(devices);
        let chip = cpu.chip();
        let own = |name: &str| avr::own_name(chip, name);
        let mut site = ChipSite {
            names: source.names,
            clock: job.clock,
            there: &there,
            has_pin: &has_pin,
            can: &|put| can(cpu, put),
            own: &own,
            serial: (family::has_uart(chip), family::receive_pin(chip)),
            stateless,
            deaf,
            table: Table::default(),
        };
        let clocks = u64::from(job.clock.clocks_per_cycle.max(1));
        let main = match file {
            Some(file) => {
                let bound = bind(&file.scenario, &mut site, Some(&args.image), Some(chip.name));
                let asked = args.time.is_some() || args.cycles.is_some();
                let limit = asked.then(|| job.plan.limit.saturating_mul(clocks));
                Some(bound.map_err(|faults| file.refused(faults))?.limited(limit))
            }
            None => None,
        };
        let mut beside = Vec::new();
        if let Some(name) = &self.stimulus {
            let wave = scenarios::waveform(name)?;
            for wire in &self.drive {
                if !wave.has(wire) {
                    return Err(Failure::value("--drive <PIN>", wire, "the waveform has no wire of this name"));
                }
            }
            let wanted = |wire: &str| {
                let asked = self.drive.is_empty() || self.drive.iter().any(|name| name == wire);
                let own = avr::own_name(chip, &source.names.with_channel(wire));
                asked && pin(chip, &own).is_ok_and(|pin| cpu.has_pin(pin))
            };
            let (stimuli, told) = wave.scenario(&mut { wanted })?;
            // Wires that were left out on purpose are no news.
            if self.drive.is_empty() {
                report(terminal, &told, Texts::NONE);
            }
            let bound = bind(&stimuli, &mut site, None, None).map_err(|faults| wave.refused(faults))?;
            beside.push(bound.limited(Some(u64::MAX)));
        }
        let recorder = self.record.as_ref().map(|_| {
            let mut recorder = Recorder::new(Some(job.clock.clocks_per_cycle.max(1)));
            recorder.program = (args.image != "-").then(|| last(&args.image));
            recorder.mcu = Some(chip.name.to_owned());
            // There what is driven acts as its cycle begins.
            recorder.whole = chip.family == Family::Mcs51;
            recorder.baud = (!args.machine.uart_in.is_empty()).then_some(args.machine.baud);
            given(args, job, clocks).into_iter().for_each(|(tick, done)| recorder.push(tick, done));
            recorder
        });
        let (table, shelf) = (std::mem::take(&mut site.table), shelf.clone());
        let supplies = supplies(&job.drives);
        Ok(Cast { table, supplies, main, beside, baud: args.machine.baud, recorder, shelf })
    }
}

/// A path without its folders.
fn last(path: &str) -> String {
    path.rsplit(['/', '\\']).next().unwrap_or(path).to_owned()
}

/// What --set, --at and --uart-in do.
fn given(args: &RunArgs, job: &Planned, clocks: u64) -> Vec<(u64, Done)> {
    let at = args.machine.at.iter().map(|text| text.split_once(':').map_or(text.as_str(), |(_, put)| put));
    let texts = args.machine.set.iter().map(String::as_str).chain(at);
    let tick = |at: Time| at.cycle.saturating_mul(clocks).saturating_add(at.phase.into());
    let mut done: Vec<(u64, bool, Done)> = Vec::new();
    for (text, drive) in texts.zip(&job.drives) {
        let Some((name, value)) = text.split_once('=') else { continue };
        let value = value.trim();
        let value = value.parse().map_or_else(|_| Value::Text(value.to_owned()), Value::Number);
        let pin = !matches!(drive.put, Put::Supply(_));
        done.push((tick(drive.at), pin, Done::Set(name.trim().to_owned(), value)));
    }
    let texts = args.machine.uart_in.iter().filter_map(|text| text.split_once(':'));
    for (time, text) in texts {
        if let (Ok(at), Ok(bytes)) = (job.clock.moment(time), unescape(text)) {
            done.push((tick(at), true, Done::Send(bytes)));
        }
    }
    // As they are queued: the supply before the pins.
    done.sort_by_key(|(tick, pin, _)| (*tick, *pin));
    done.into_iter().map(|(tick, _, done)| (tick, done)).collect()
}
