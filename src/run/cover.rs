//! What of a program a run has executed, and where its cycles went: `--coverage` and `--profile`.

use std::io::Write;

use clap::Args;
use emu_core::cpu::{Cpu, Probe};
use emu_core::image::Image;
use emu_debug::coverage::{Reached, Totals, lcov};
use emu_debug::run::{Along, Memory, run_along};
use emu_debug::trace::Look;
use emu_debug::{Board, Coverage, Ended, Host, Plan, Profile, Source, Wave};
use serde_json::{Value, json};

use super::rungs::{Elements, Rungs};
use super::spent::Spent;
use crate::fail::Failure;
use crate::output::{self, Pending};
use crate::report::Terminal;

/// Flags of `emu run`.
#[derive(Debug, Args)]
pub struct CoverArgs {
    /// Write what the run has executed as a tracefile of lcov: lines, functions, and both ways of conditional instructions. Lines are
    /// those of the sources where they are known (ELF, --symbols), of the ladder program with --map and --ladder, else of a listing
    /// that is written beside it as FILE.lst.
    #[arg(long, value_name = "FILE")]
    pub coverage: Option<String>,
    /// Tell where the cycles went: by function, rung (with --map) and interrupt, and how many the chip slept. With =FILE also as
    /// folded stacks for flame graphs.
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true, default_missing_value = "")]
    pub profile: Option<String>,
    /// The ladder program of --map, whose lines --coverage tells of.
    #[arg(long, value_name = "PROGRAM", requires = "map", requires = "coverage")]
    pub ladder: Option<String>,
}

impl CoverArgs {
    /// The files that are written, with their flags.
    pub fn outputs(&self) -> [(&'static str, &str); 2] {
        [("--coverage", &self.coverage), ("--profile", &self.profile)]
            .map(|(flag, file)| (flag, file.as_deref().unwrap_or_default()))
    }

    /// The files that are read.
    pub fn inputs(&self) -> impl Iterator<Item = &String> {
        self.ladder.iter()
    }
}

/// Text for people, and members of the document by name.
type Told = (String, Vec<(&'static str, Value)>);

/// What is looked at, with its files begun.
pub struct Cover<'a> {
    args: &'a CoverArgs,
    image: &'a Image,
    rungs: Option<Rungs>,
    /// Files that are read or written otherwise.
    taken: &'a [String],
    /// Each file with its name.
    coverage: Option<(&'a str, Option<Pending>)>,
    folded: Option<(&'a str, Option<Pending>)>,
}

/// Instructions, and elements of a ladder program.
struct Covered {
    coverage: Coverage,
    elements: Option<Elements>,
}

impl Probe for Covered {
    const FLOW: bool = true;

    #[inline(always)]
    fn goes(&mut self, next: u32, to: u32, taken: bool) {
        self.coverage.goes(next, to, taken);
    }

    fn enters(&mut self, pc: u32) {
        self.coverage.enters(pc);
    }

    fn breaks(&mut self, pc: u32) {
        self.coverage.breaks(pc);
    }
}

impl Along for Covered {
    fn passes(&mut self, memory: Memory<'_>, pc: u32) {
        if let Some(elements) = &mut self.elements {
            elements.look(memory, pc);
        }
    }
}

/// What was seen: a probe where there is a profile.
#[derive(Default)]
pub struct Seen {
    covered: Option<Covered>,
    profile: Option<Profile>,
}

impl Probe for Seen {
    const INSN: bool = true;
    const EVERY: bool = false;
    const FLOW: bool = true;

    fn insn(&mut self, at: u64, pc: u32) -> bool {
        self.profile.as_mut().is_some_and(|profile| profile.insn(at, pc))
    }

    fn goes(&mut self, next: u32, to: u32, taken: bool) {
        if let Some(covered) = &mut self.covered {
            covered.goes(next, to, taken);
        }
    }

    fn enters(&mut self, pc: u32) {
        if let Some(covered) = &mut self.covered {
            covered.enters(pc);
        }
    }

    fn breaks(&mut self, pc: u32) {
        if let Some(covered) = &mut self.covered {
            covered.breaks(pc);
        }
    }

    fn irq(&mut self, at: u64, vector: u8) {
        if let Some(profile) = &mut self.profile {
            profile.irq(at, vector);
        }
    }
}

impl Along for Seen {
    fn passes(&mut self, memory: Memory<'_>, pc: u32) {
        if let Some(covered) = &mut self.covered {
            covered.passes(memory, pc);
        }
    }
}

impl<'a> Cover<'a> {
    /// Reads the map and begins the files.
    pub fn new(
        args: &'a CoverArgs,
        map: Option<&str>,
        (source, image): (&Source<'_>, &'a Image),
        (taken, terminal): (&'a [String], &Terminal),
    ) -> Result<Cover<'a>, Failure> {
        let map = map.filter(|_| args.coverage.is_some() || args.profile.is_some());
        let ladder = args.ladder.as_deref();
        let rungs = map.map(|map| Rungs::read(map, ladder, source, terminal)).transpose()?;
        match args.coverage.as_deref().filter(|_| !has_lines(source, rungs.as_ref())) {
            Some("-") => {
                let why =
                    "nothing is known of source lines, so --coverage writes a listing beside its file; give it a file";
                return Err(Failure::Usage(why.to_owned()));
            }
            Some(file) => spared(&format!("{file}.lst"), taken)?,
            None => {}
        }
        let begin = |file: &'a str| -> Result<(&'a str, Option<Pending>), Failure> {
            Ok((file, if output::is_stdout(file) { None } else { Some(Pending::new(file)?) }))
        };
        let folded = args.profile.as_deref().filter(|file| !file.is_empty());
        Ok(Cover {
            args,
            image,
            taken,
            coverage: args.coverage.as_deref().map(begin).transpose()?,
            folded: folded.map(begin).transpose()?,
            rungs,
        })
    }

    /// [`run_along`] with what looks at it.
    pub fn run<C: Cpu>(
        &self,
        (cpu, board): (&mut C, &mut Board),
        plan: &Plan,
        (wave, look): (Option<Wave>, Option<&mut Look<'_>>),
        host: &mut dyn Host<C>,
    ) -> (Ended, Seen) {
        let covered = self.args.coverage.is_some().then(|| Covered {
            coverage: Coverage::default(),
            elements: self.rungs.as_ref().and_then(Rungs::elements),
        });
        if let Some(elements) = covered.as_ref().and_then(|covered| covered.elements.as_ref()) {
            cpu.trap(elements.at(), true);
        }
        let profile = self.args.profile.is_some().then(|| Profile::new(cpu.chip(), self.image, cpu.cycle()));
        // Each has a loop of its own, which asks for nothing else.
        match (covered, profile) {
            (None, None) => {
                let ended = run_along((cpu, board), plan, wave, (&mut (), look), host);
                (ended, Seen::default())
            }
            (Some(mut covered), None) => {
                let ended = run_along((cpu, board), plan, wave, (&mut covered, look), host);
                (ended, Seen { covered: Some(covered), profile: None })
            }
            (covered, profile) => {
                let mut seen = Seen { covered, profile };
                let ended = run_along((cpu, board), plan, wave, (&mut seen, look), host);
                if let Some(profile) = &mut seen.profile {
                    profile.finish(cpu.cycle());
                }
                (ended, seen)
            }
        }
    }

    /// Writes the files, and gives what is told of it to people and as members of the document.
    pub fn told(self, seen: &Seen, source: &Source<'_>) -> Result<Told, Failure> {
        let (mut text, mut members) = (String::new(), Vec::new());
        if let (Some(Covered { coverage, elements }), Some((file, pending))) = (&seen.covered, self.coverage) {
            let reached = coverage.reached(source.names.chip, self.image);
            let (records, listing) = records(&reached, source, self.rungs.as_ref(), elements.as_ref(), file);
            let mut totals = Totals::of(&reached, &records);
            totals.elements = elements.as_ref().map(Elements::part);
            let beside = format!("{file}.lst");
            let listing = listing.map(|listing| -> Result<_, Failure> {
                spared(&beside, self.taken)?;
                let place = Pending::new(&beside)?;
                fill(&place, &beside, &listing)?;
                Ok(place)
            });
            let listing = listing.transpose()?;
            written(file, pending, &lcov::text(&records))?;
            listing.map_or(Ok(()), Pending::complete)?;
            text.push_str(&figures(&totals));
            members.push(("coverage", document(&totals)));
        }
        if let Some(profile) = &seen.profile {
            let spent = Spent::new(profile, source, self.rungs.as_ref());
            if let Some((file, pending)) = self.folded {
                written(file, pending, &spent.folded())?;
            }
            text.push_str(&spent.text());
            members.push(("profile", spent.document()));
        }
        Ok((text, members))
    }
}

/// Refuses a listing in the place of a file that is read or written otherwise.
fn spared(listing: &str, taken: &[String]) -> Result<(), Failure> {
    match taken.iter().find(|file| *file != "-" && output::same_place(file, listing)) {
        Some(_) => {
            let why = format!(
                "--coverage writes the listing {listing} beside its file, which would replace a file of this run; give it another name"
            );
            Err(Failure::Usage(why))
        }
        None => Ok(()),
    }
}

/// Lines of sources or of a ladder program are known.
fn has_lines(source: &Source<'_>, rungs: Option<&Rungs>) -> bool {
    rungs.is_some_and(Rungs::has_lines) || !source.lines.all().is_empty()
}

/// What is written of a run: by lines of the ladder program, of the sources, or of a listing, which comes along.
fn records(
    reached: &[Reached],
    source: &Source<'_>,
    rungs: Option<&Rungs>,
    elements: Option<&Elements>,
    file: &str,
) -> (Vec<lcov::Record>, Option<String>) {
    if let Some(record) = rungs.and_then(|rungs| rungs.record(reached, elements)) {
        return (vec![record], None);
    }
    let records = lcov::by_source(reached, source);
    if records.is_empty() {
        let (listing, record) = lcov::by_listing(reached, source, &format!("{file}.lst"));
        return (vec![record], Some(listing));
    }
    (records, None)
}

fn fill(place: &Pending, file: &str, text: &str) -> Result<(), Failure> {
    let mut out = place.writer()?;
    out.write_all(text.as_bytes()).and_then(|()| out.flush()).map_err(|error| Failure::writing(file, &error))
}

/// Writes a file that was begun, or standard output.
fn written(file: &str, place: Option<Pending>, text: &str) -> Result<(), Failure> {
    match place {
        None => output::print(text),
        Some(place) => {
            fill(&place, file, text)?;
            place.complete()
        }
    }
}

/// The figures of the coverage, for people.
fn figures(totals: &Totals) -> String {
    let Totals { instructions, branches, lines, functions, elements } = totals;
    let mut rows = vec![("instructions", instructions), ("branches", branches), ("lines", lines)];
    rows.extend((functions.all > 0).then_some(("functions", functions)));
    rows.extend(elements.as_ref().map(|elements| ("elements", elements)));
    let rows = rows.iter().enumerate().map(|(i, (what, part))| {
        let head = if i == 0 { "coverage" } else { "" };
        format!("{head:<10} {what:<12} {part}\n")
    });
    rows.collect()
}

/// The same as a member of the document.
fn document(totals: &Totals) -> Value {
    let part = |part: &emu_debug::coverage::Part| json!({ "seen": part.seen, "all": part.all });
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
