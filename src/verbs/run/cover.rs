//! `--coverage` and `--profile`: what a run executed, and where its cycles went.

use emu_debug::coverage::lcov::ListingWithRecord;
use std::io::Write;

use clap::Args;
use emu_core::cpu::{Cpu, Probe};
use emu_core::image::Image;
use emu_debug::coverage::{CoverageTotals, CoveredInstruction, lcov};
use emu_debug::run::{ConnectedMachine, ExtraProbes, ReadMemory, RunProbe, run_with_probe};
use emu_debug::trace::TraceProbe;
use emu_debug::{
    AttachedDevices, CodeCoverage, CycleProfile, ProgramSource, RunController, RunPlan, RunResult, WaveWriter,
};
use serde_json::{Value, json};

use super::cycle_profile::CycleReport;
use super::rungs::{ElementCounts, MappedLadder};
use crate::shared::fail::VerbFailure;
use crate::shared::output;
use crate::shared::output::PendingFile;
use crate::shared::report::MessageStyle;

/// Flags of coverage and profile.
#[derive(Debug, Args)]
pub struct CoverageFlags {
    /// Write the coverage of the run as an lcov tracefile: lines, functions, and both outcomes of conditional
    /// instructions. The lines are those of the sources if known (ELF, --symbols), those of the ladder
    /// program with --map and --ladder, otherwise those of a listing that is written next to the file as
    /// FILE.lst.
    #[arg(long, value_name = "FILE")]
    pub coverage: Option<String>,
    /// Report where the cycles went: by function, rung (with --map) and interrupt, and idle cycles (asleep or
    /// stopped). With =FILE also as folded stacks for flame graphs.
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true, default_missing_value = "")]
    pub profile: Option<String>,
    /// The ladder program of --map, whose lines --coverage reports.
    #[arg(long, value_name = "PROGRAM", requires = "map", requires = "coverage")]
    pub ladder: Option<String>,
}

impl CoverageFlags {
    /// Returns the output files, with their flags.
    pub fn outputs(&self) -> [(&'static str, &str); 2] {
        [("--coverage", &self.coverage), ("--profile", &self.profile)]
            .map(|(flag, file)| (flag, file.as_deref().unwrap_or_default()))
    }

    /// Returns the input files.
    pub fn inputs(&self) -> impl Iterator<Item = &String> {
        self.ladder.iter()
    }
}

/// What a run reports about its coverage and profile.
pub struct CoverageReport {
    /// The text of the summary.
    pub text: String,
    /// Named members of the JSON document.
    pub members: Vec<(&'static str, Value)>,
}

/// The coverage and profile of one run, with their open output files.
pub struct CoverageRun<'a> {
    args: &'a CoverageFlags,
    image: &'a Image,
    /// The ladder program of `--map`, if it is given.
    rungs: Option<MappedLadder>,
    /// Files that the run reads or writes for other flags.
    protected_files: &'a [String],
    /// Name and open file of the coverage output; no file means standard output.
    coverage: Option<(&'a str, Option<PendingFile>)>,
    /// Name and open file of the folded stacks of `--profile=FILE`.
    folded: Option<(&'a str, Option<PendingFile>)>,
}

/// Coverage of instructions, and of the elements of a ladder program.
struct CoverageProbe {
    coverage: CodeCoverage,
    elements: Option<ElementCounts>,
}

impl Probe for CoverageProbe {
    const FLOW: bool = true;

    #[inline(always)]
    fn on_branch(&mut self, next: u32, to: u32, taken: bool) {
        self.coverage.on_branch(next, to, taken);
    }

    fn on_flow_start(&mut self, pc: u32) {
        self.coverage.on_flow_start(pc);
    }

    fn on_flow_end(&mut self, pc: u32) {
        self.coverage.on_flow_end(pc);
    }
}

impl RunProbe for CoverageProbe {
    fn on_breakpoint_passed(&mut self, memory: ReadMemory<'_>, pc: u32) {
        if let Some(elements) = &mut self.elements {
            elements.sample_elements(memory, pc);
        }
    }
}

/// The collected coverage and profile. As a probe, it serves runs with a profile.
#[derive(Default)]
pub struct CoverageAndProfile {
    coverage_probe: Option<CoverageProbe>,
    profile: Option<CycleProfile>,
}

impl Probe for CoverageAndProfile {
    const INSN: bool = true;
    const EVERY_ITERATION: bool = false;
    const FLOW: bool = true;

    fn on_instruction(&mut self, at: u64, pc: u32) -> bool {
        self.profile.as_mut().is_some_and(|profile| profile.on_instruction(at, pc))
    }

    fn on_branch(&mut self, next: u32, to: u32, taken: bool) {
        if let Some(coverage_probe) = &mut self.coverage_probe {
            coverage_probe.on_branch(next, to, taken);
        }
    }

    fn on_flow_start(&mut self, pc: u32) {
        if let Some(coverage_probe) = &mut self.coverage_probe {
            coverage_probe.on_flow_start(pc);
        }
    }

    fn on_flow_end(&mut self, pc: u32) {
        if let Some(coverage_probe) = &mut self.coverage_probe {
            coverage_probe.on_flow_end(pc);
        }
    }

    fn on_interrupt(&mut self, at: u64, vector: u8) {
        if let Some(profile) = &mut self.profile {
            profile.on_interrupt(at, vector);
        }
    }
}

impl RunProbe for CoverageAndProfile {
    fn on_breakpoint_passed(&mut self, memory: ReadMemory<'_>, pc: u32) {
        if let Some(coverage_probe) = &mut self.coverage_probe {
            coverage_probe.on_breakpoint_passed(memory, pc);
        }
    }
}

impl<'a> CoverageRun<'a> {
    /// Reads the map and opens the output files.
    pub fn new(
        args: &'a CoverageFlags,
        map: Option<&str>,
        (source, image): (&ProgramSource<'_>, &'a Image),
        (protected_files, style): (&'a [String], &MessageStyle),
    ) -> Result<CoverageRun<'a>, VerbFailure> {
        let map = map.filter(|_| args.coverage.is_some() || args.profile.is_some());
        let ladder = args.ladder.as_deref();
        let rungs = map.map(|map| MappedLadder::read(map, ladder, source, style)).transpose()?;
        match args.coverage.as_deref().filter(|_| !has_lines(source, rungs.as_ref())) {
            Some("-") => {
                let why = "there are no source lines, so --coverage writes a listing next to its file; give it a file";
                return Err(VerbFailure::Usage(why.to_owned()));
            }
            Some(file) => check_listing_path(&format!("{file}.lst"), protected_files)?,
            None => {}
        }
        let open_output = |file: &'a str| -> Result<(&'a str, Option<PendingFile>), VerbFailure> {
            Ok((file, if output::is_stdout(file) { None } else { Some(PendingFile::new(file)?) }))
        };
        let folded = args.profile.as_deref().filter(|file| !file.is_empty());
        Ok(CoverageRun {
            args,
            image,
            protected_files,
            coverage: args.coverage.as_deref().map(open_output).transpose()?,
            folded: folded.map(open_output).transpose()?,
            rungs,
        })
    }

    /// Runs the machine with [`run_with_probe`] and the probe that the flags need.
    pub fn run<C: Cpu>(
        &self,
        (cpu, devices): (&mut C, &mut AttachedDevices),
        plan: &RunPlan,
        (wave, trace_probe): (Option<WaveWriter>, Option<&mut TraceProbe<'_>>),
        controller: &mut dyn RunController<C>,
    ) -> (RunResult, CoverageAndProfile) {
        let coverage_probe = self.args.coverage.is_some().then(|| CoverageProbe {
            coverage: CodeCoverage::default(),
            elements: self.rungs.as_ref().and_then(MappedLadder::new_element_counts),
        });
        if let Some(elements) = coverage_probe.as_ref().and_then(|coverage_probe| coverage_probe.elements.as_ref()) {
            cpu.set_breakpoint(elements.scan_end_word(), true);
        }
        let profile = self.args.profile.is_some().then(|| CycleProfile::new(cpu.chip(), self.image, cpu.cycle()));
        // Each combination has its own run loop, which enables only the hooks that it needs.
        match (coverage_probe, profile) {
            (None, None) => {
                let result = run_with_probe(
                    ConnectedMachine { cpu, devices },
                    plan,
                    wave,
                    ExtraProbes { extra: &mut (), trace: trace_probe },
                    controller,
                );
                (result, CoverageAndProfile::default())
            }
            (Some(mut coverage_probe), None) => {
                let result = run_with_probe(
                    ConnectedMachine { cpu, devices },
                    plan,
                    wave,
                    ExtraProbes { extra: &mut coverage_probe, trace: trace_probe },
                    controller,
                );
                (result, CoverageAndProfile { coverage_probe: Some(coverage_probe), profile: None })
            }
            (coverage_probe, profile) => {
                let mut collected = CoverageAndProfile { coverage_probe, profile };
                let result = run_with_probe(
                    ConnectedMachine { cpu, devices },
                    plan,
                    wave,
                    ExtraProbes { extra: &mut collected, trace: trace_probe },
                    controller,
                );
                if let Some(profile) = &mut collected.profile {
                    profile.finish(cpu.cycle());
                }
                (result, collected)
            }
        }
    }

    /// Writes the files, and returns the reports as text and as members of the JSON document.
    pub fn write_reports(
        self,
        collected: &CoverageAndProfile,
        source: &ProgramSource<'_>,
    ) -> Result<CoverageReport, VerbFailure> {
        let (mut text, mut members) = (String::new(), Vec::new());
        if let (Some(CoverageProbe { coverage, elements }), Some((file, pending))) =
            (&collected.coverage_probe, self.coverage)
        {
            let instructions = coverage.covered_instructions(source.names.chip, self.image);
            let (records, listing) =
                coverage_records(&instructions, source, self.rungs.as_ref(), elements.as_ref(), file);
            let mut totals = CoverageTotals::of(&instructions, &records);
            totals.elements = elements.as_ref().map(ElementCounts::covered_share);
            let listing_path = format!("{file}.lst");
            let listing = listing.map(|listing| -> Result<_, VerbFailure> {
                check_listing_path(&listing_path, self.protected_files)?;
                let file = PendingFile::new(&listing_path)?;
                write_to_pending(&file, &listing_path, &listing)?;
                Ok(file)
            });
            let listing = listing.transpose()?;
            write_open_file(file, pending, &lcov::format_tracefile(&records))?;
            listing.map_or(Ok(()), PendingFile::complete)?;
            text.push_str(&coverage_table(&totals));
            members.push(("coverage", document(&totals)));
        }
        if let Some(profile) = &collected.profile {
            let report = CycleReport::new(profile, source, self.rungs.as_ref());
            if let Some((file, pending)) = self.folded {
                write_open_file(file, pending, &report.folded_stacks())?;
            }
            text.push_str(&report.text());
            members.push(("profile", report.document()));
        }
        Ok(CoverageReport { text, members })
    }
}

/// Refuses a listing whose path is a file that the run reads or writes for another flag.
fn check_listing_path(listing: &str, protected_files: &[String]) -> Result<(), VerbFailure> {
    match protected_files.iter().find(|file| *file != "-" && output::same_place(file, listing)) {
        Some(_) => {
            let why = format!(
                "--coverage writes the listing {listing} next to its file, which would replace a file of this run; give it another name"
            );
            Err(VerbFailure::Usage(why))
        }
        None => Ok(()),
    }
}

/// Returns true if lines of sources or of a ladder program are known.
fn has_lines(source: &ProgramSource<'_>, rungs: Option<&MappedLadder>) -> bool {
    rungs.is_some_and(MappedLadder::has_lines) || !source.lines.all_lines().is_empty()
}

/// Returns the coverage records: by lines of the ladder program, of the sources, or of a listing, which is
/// then returned too.
fn coverage_records(
    instructions: &[CoveredInstruction],
    source: &ProgramSource<'_>,
    rungs: Option<&MappedLadder>,
    elements: Option<&ElementCounts>,
    file: &str,
) -> (Vec<lcov::LcovRecord>, Option<String>) {
    if let Some(record) = rungs.and_then(|rungs| rungs.record(instructions, elements)) {
        return (vec![record], None);
    }
    let records = lcov::source_records(instructions, source);
    if records.is_empty() {
        let ListingWithRecord { listing, record } = lcov::listing_record(instructions, source, &format!("{file}.lst"));
        return (vec![record], Some(listing));
    }
    (records, None)
}

fn write_to_pending(pending: &PendingFile, name: &str, text: &str) -> Result<(), VerbFailure> {
    let mut out = pending.writer()?;
    out.write_all(text.as_bytes()).and_then(|()| out.flush()).map_err(|error| VerbFailure::write_failed(name, &error))
}

/// Writes a file that [`CoverageRun::new`] opened, or standard output if it opened none, and completes it.
fn write_open_file(name: &str, pending: Option<PendingFile>, text: &str) -> Result<(), VerbFailure> {
    match pending {
        None => output::print(text),
        Some(pending) => {
            write_to_pending(&pending, name, text)?;
            pending.complete()
        }
    }
}

/// Returns the coverage figures as text.
fn coverage_table(totals: &CoverageTotals) -> String {
    let CoverageTotals { instructions, branches, lines, functions, elements } = totals;
    let mut rows = vec![("instructions", instructions), ("branches", branches), ("lines", lines)];
    rows.extend((functions.total > 0).then_some(("functions", functions)));
    rows.extend(elements.as_ref().map(|elements| ("elements", elements)));
    let rows = rows.iter().enumerate().map(|(i, (what, part))| {
        let head = if i == 0 { "coverage" } else { "" };
        format!("{head:<10} {what:<12} {part}\n")
    });
    rows.collect()
}

/// Returns the coverage figures as JSON.
fn document(totals: &CoverageTotals) -> Value {
    let part = |part: &emu_debug::coverage::CoveredShare| json!({ "seen": part.covered, "all": part.total });
    let mut document = json!({
        "instructions": part(&totals.instructions),
        "branches": part(&totals.branches),
        "lines": part(&totals.lines),
        "functions": part(&totals.functions),
    });
    if let Some(elements) = &totals.elements {
        document["elements"] = part(elements);
    }
    document
}
