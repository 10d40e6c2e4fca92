//! `--snapshot-in` and `--snapshot-out`: continue a run from the state at the end of another run.

use std::io::Write as _;

use clap::Args;
use emu_core::cpu::Cpu;
use emu_core::pins::CycleTime;
use emu_debug::snapshot::{self, SnapshotHeader};

use super::plan::PlannedRun;
use crate::shared::fail::VerbFailure;
use crate::shared::output::PendingFile;
use crate::shared::report::FileTexts;
use crate::shared::{input, output};

/// Flags of snapshots.
#[derive(Debug, Args)]
#[group(id = "snapshot")]
pub struct SnapshotFlags {
    /// Continue from a state that --snapshot-out wrote, for the same chip, image and configuration. --for and
    /// --cycles count from that state, and --set drives pins from it. --at and --uart-in use chip time since
    /// power-up, and must not be in the past. The state includes drives that were still pending.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["eeprom", "attach", "cod", "lint", "scenario", "stimulus", "record"])]
    pub snapshot_in: Option<String>,
    /// Write the state of the machine at the end of the run, however it ends, for --snapshot-in; - is
    /// standard output.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["attach", "cod"])]
    pub snapshot_out: Option<String>,
}

/// The snapshots that a run reads and writes.
pub struct RunSnapshots {
    expected_header: SnapshotHeader,
    input: Option<(String, Vec<u8>)>,
    out: Option<(String, Option<PendingFile>)>,
}

impl RunSnapshots {
    /// Reads the input snapshot, and opens the output file.
    pub fn open(flags: &SnapshotFlags, expected_header: SnapshotHeader) -> Result<RunSnapshots, VerbFailure> {
        let input = flags.snapshot_in.as_ref().map(|name| Ok((name.clone(), input::read_bytes(name)?))).transpose()?;
        let pending = |name: &String| if output::is_stdout(name) { Ok(None) } else { PendingFile::new(name).map(Some) };
        let out = flags.snapshot_out.as_ref().map(|name| Ok((name.clone(), pending(name)?))).transpose()?;
        Ok(RunSnapshots { expected_header, input, out })
    }

    /// Restores the machine from the snapshot, and shifts limit and drives to its cycle.
    pub fn resume<C: Cpu>(&self, cpu: &mut C, planned: &mut PlannedRun) -> Result<(), VerbFailure> {
        planned.plan.continues = self.out.is_some();
        let Some((name, bytes)) = &self.input else { return Ok(()) };
        let refused = |fault| VerbFailure::Refused(vec![fault], FileTexts::default());
        let snapshot::MachineState { cycle, state } =
            snapshot::decode_snapshot_for(name, bytes, &self.expected_header).map_err(refused)?;
        cpu.restore(state).map_err(|_| refused(snapshot::invalid_state(name)))?;
        if cpu.cycle() != cycle {
            return Err(refused(snapshot::invalid_state(name)));
        }
        planned.plan.limit = planned.plan.limit.saturating_add(cycle);
        for drive in &mut planned.drives {
            if drive.at == CycleTime::default() {
                drive.at = CycleTime::at(cycle);
            } else if drive.at.cycle < cycle {
                let why = format!(
                    "--at and --uart-in: cycle {} has passed, the snapshot is of cycle {cycle}",
                    drive.at.cycle
                );
                return Err(VerbFailure::Usage(why));
            }
        }
        Ok(())
    }

    /// Writes the state at the end of the run.
    pub fn write_snapshot<C: Cpu>(self, cpu: &C) -> Result<(), VerbFailure> {
        let Some((name, pending)) = self.out else { return Ok(()) };
        let file =
            snapshot::encode_snapshot(&SnapshotHeader { cycle: cpu.cycle(), ..self.expected_header }, &cpu.save());
        let Some(pending) = pending else { return output::print(file) };
        let mut out = pending.writer()?;
        out.write_all(&file).and_then(|()| out.flush()).map_err(|error| VerbFailure::write_failed(&name, &error))?;
        drop(out);
        pending.complete()
    }
}
