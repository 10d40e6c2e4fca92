//! The run without a user: the machine, what watches it, and what is told of it.

use std::io::Write;
use std::sync::atomic::Ordering;
use std::time::Instant;

use emu_core::chip::Chip;
use emu_core::cpu::Cpu;
use emu_core::image::Image;
use emu_core::pins::Time;
use emu_debug::cod::{Limits, Script};
use emu_debug::run::shown;
use emu_debug::stimulus::queue;
use emu_debug::wave::Extras;
use emu_debug::{Board, Clock, Ended, Host, Names, Patience, Range, Reason, Source, Wave};
use scenario::Verdict;

use super::RunArgs;
use super::cover::{Cover, Seen};
use super::plan::{Planned, code, missing, planned, there};
use super::scenario::{Cast, Stage};
use super::snapshot::Snapshots;
use super::trace::Asked;
use crate::attach::Bench;
use crate::fail::Failure;
use crate::family::{self, Job};
use crate::held::held;
use crate::interrupts::interrupts;
use crate::output::Pending;
use crate::report::{Terminal, Texts, report};
use crate::snapshots::Shelf;
use crate::store::{self, Store};
use crate::summary::{self, Story};
use crate::{avr, cod, lint, output, pic16, scenarios};

/// A run without a user.
pub struct Headless<'a> {
    pub args: &'a RunArgs,
    pub image: &'a Image,
    /// The messages of a program that checks itself.
    pub script: Option<Script>,
    pub hz: u64,
    pub avr: avr::Wiring,
    pub pic16: emu_pic16::Options,
    /// The file of the EEPROM, and what it holds.
    pub eeprom: Option<(Store, Option<Vec<u8>>)>,
    pub snapshots: Snapshots,
    /// Where steps of a scenario write snapshots.
    pub shelf: Shelf,
    pub bench: Bench,
    /// Standard output carries something else than the summary.
    pub to_stdout: bool,
    pub terminal: &'a Terminal,
}

impl Job for Headless<'_> {
    type Out = Result<u8, Failure>;

    fn on<C: Cpu + 'static>(mut self, mut cpu: C) -> Self::Out {
        let store = self.eeprom.take().map(|(store, held)| {
            store::fill(&mut cpu, &held.unwrap_or_default());
            store
        });
        let clock = Clock { hz: self.hz, clocks_per_cycle: cpu.clocks_per_cycle() * self.avr.divider };
        let source = self.source(cpu.chip());
        let job = planned(self.args, &source, clock);
        // Asking for a line of the image may have shown that its debugging information is damaged.
        report(self.terminal, self.image.lines.warnings(), Texts::NONE);
        let told = self.image.lines.warnings().len();
        let mut job = job?;
        self.snapshots.resume(&mut cpu, &mut job)?;
        there(&job, &cpu)?;
        let mut board = self.bench.board(cpu.chip(), clock, &job.drives)?;
        let mut begun = false;
        let out = self.whole((&mut cpu, &mut board), job, &mut begun);
        report(self.terminal, self.image.lines.warnings().get(told..).unwrap_or_default(), Texts::NONE);
        if !begun {
            return out;
        }
        // However the run has ended, and whatever becomes of the others.
        let stored = store.map_or(Ok(()), |store| store.keep(&store::cells(&cpu)));
        let held = self.bench.keep(&board);
        let saved = self.snapshots.keep(&cpu);
        out.and_then(|code| stored.and(held).and(saved).map(|()| code))
    }
}

impl Headless<'_> {
    /// What is known of the addresses of the program.
    fn source(&self, chip: &'static Chip) -> Source<'_> {
        Source { names: Names { chip, symbols: &self.image.symbols }, lines: &self.image.lines }
    }

    /// The run, and what is told of it. `begun` becomes true when the machine is about to run.
    fn whole<C: Cpu>(
        &self,
        (cpu, board): (&mut C, &mut Board),
        mut job: Planned,
        begun: &mut bool,
    ) -> Result<u8, Failure> {
        let (args, image, chip) = (self.args, self.image, cpu.chip());
        let source = self.source(chip);
        let filled = image.segments.iter().filter(|s| s.space == chip.ram);
        job.plan.filled =
            filled.map(|s| Range { space: s.space, start: s.addr, end: s.addr + s.bytes.len() as u32 }).collect();
        for (text, range) in &job.peek {
            let width = chip.width(range.space);
            if let Some(addr) = (range.start..range.end).find(|&addr| cpu.peek(range.space, addr * width).is_none()) {
                let why = format!("{} has nothing at {}:0x{addr:x}", chip.name, range.space);
                return Err(Failure::value("--peek <RANGE>", text, &why));
            }
        }
        queue(cpu, &job.drives).map_err(Failure::Usage)?;
        pic16::warn(chip, image, &self.pic16);
        if let Some(script) = &self.script {
            let limits = Limits { cycle: job.plan.limit, hz: self.hz };
            let name = args.cod.as_deref().unwrap_or_default();
            *begun = true;
            return cod::judge(cpu, script, (name, source), (limits, &job.drives), args.json);
        }
        let scenario = args.scenes.scenario.as_deref().map(scenarios::read).transpose()?;
        let cast = match args.scenes.any() {
            true => {
                Some(args.scenes.cast(cpu, &source, (args, &job, scenario.as_ref()), (&self.shelf, self.terminal))?)
            }
            false => None,
        };
        if let Some(bound) = cast.as_ref().and_then(|cast| cast.main.as_ref()) {
            job.plan.limit = bound.cycles(job.clock.clocks_per_cycle);
        }
        board.connect(cpu);
        let asked = args.trace.asked(cpu, &source)?;
        let cover =
            Cover::new(&args.cover, args.trace.map.as_deref(), (&source, image), (&self.shelf.taken, self.terminal))?;
        let job_of = (&job, asked, source);
        let Recorded { ended, verdict, seen, kept } = recorded(args, (cpu, board), job_of, (cast, &cover), begun)?;
        let held = if ended.reason == Reason::Halted { held(cpu, &job.drives) } else { None };
        let Planned { clock, plan, peek, .. } = &job;
        let story = Story { cpu, source, clock: *clock, plan, ended: &ended, peek, held };
        if let Some(how) = args.lint {
            lint::complain(&story, how, &args.image, self.terminal);
        }
        summary::complain(&story, &avr::out_of_code(chip, image, &self.avr));
        avr::complain(cpu, &self.avr);
        let told = cover.told(&seen, &source);
        kept?;
        let (covered, members) = told?;
        let played = scenario.as_ref().zip(verdict.as_ref());
        if let (Reason::Over, Some(text)) = (ended.reason, missing(plan, &ended)) {
            let text = text.escape_ascii();
            output::tell(&format!("error: the scenario is over, and --expect-uart \"{text}\" was not sent\n"));
        }
        if args.json {
            let mut document = summary::document(&story);
            for (name, member) in members {
                document[name] = member;
            }
            if let Some((file, verdict)) = played {
                document["scenario"] = file.document(verdict);
            }
            if args.lint.is_some() {
                document["lints"] = lint::document(&story);
            }
            output::json(&document)?;
        } else if self.to_stdout {
            output::tell(&(summary::text(&story) + &covered));
        } else {
            output::print(summary::text(&story) + &covered)?;
        }
        let asked = args.time.is_some() || args.cycles.is_some();
        let code = code(&job.plan, &ended, asked);
        let code = match played {
            Some((file, verdict)) => file.judged(verdict, (code, args.json || self.to_stdout), self.terminal)?,
            None => code,
        };
        Ok(args.lint.map_or(code, |how| lint::code(how, &ended.lints, code)))
    }
}

/// Runs and writes along what `--uart`, `--vcd`, `--trace`, `--coverage` and `--profile` ask for.
fn recorded<C: Cpu>(
    args: &RunArgs,
    (cpu, board): (&mut C, &mut Board),
    (job, asked, source): (&Planned, Asked, Source<'_>),
    (cast, cover): (Option<Cast>, &Cover<'_>),
    begun: &mut bool,
) -> Result<Recorded, Failure> {
    let chip = cpu.chip();
    let record = args.scenes.record.as_deref().filter(|f| !output::is_stdout(f)).map(Pending::new).transpose()?;
    let raw = args.uart.as_deref().is_some_and(output::is_stdout);
    let (start, mut printed, mut broken) = (Instant::now(), 0, None);
    let interrupted = interrupts();
    let mut patience = |sent: &[u8]| {
        if raw && broken.is_none() {
            broken = output::print(sent.get(printed..).unwrap_or_default()).err();
            printed = sent.len();
        }
        broken.is_none()
            && !interrupted.load(Ordering::Relaxed)
            && args.timeout.is_none_or(|limit| start.elapsed() < limit)
    };
    let mut stage = match cast {
        Some(cast) => Some(Stage::new(chip, job.clock, cast, &mut patience)?),
        None => None,
    };
    // Before the waveform begins, so that it begins with what is there from the first cycle on.
    if let Some(stage) = &mut stage {
        stage.start(cpu);
    }
    let uart_file = args.uart.as_deref().filter(|f| !output::is_stdout(f)).map(Pending::new).transpose()?;
    let vcd_file = args.vcd.as_deref().filter(|f| !output::is_stdout(f)).map(Pending::new).transpose()?;
    let vcd_name = args.vcd.as_deref().unwrap_or_default();
    let vcd_error = |error: std::io::Error| Failure::writing(vcd_name, &error);
    let wave = match (&args.vcd, &vcd_file) {
        (None, _) => None,
        (Some(_), Some(file)) => Some(file.writer()?),
        (Some(_), None) => Some(Box::new(std::io::BufWriter::new(std::io::stdout())) as Box<dyn Write>),
    };
    let mut wave = wave
        .map(|out| {
            let levels = shown(cpu, chip);
            let columns = &asked.columns();
            let start = Time::at(cpu.cycle());
            let extras = Extras { start, uart: family::has_uart(chip), columns, split: args.trace.vcd_bits };
            Wave::with((out, chip, job.clock), &levels, extras)
        })
        .transpose()
        .map_err(vcd_error)?;

    let trace_file = args.trace.pending()?;
    let mut look = args.trace.look(asked, trace_file.as_ref(), (source, job.clock.hz))?;

    *begun = true;
    let mut go =
        |cpu: &mut C, host: &mut dyn Host<C>| cover.run((cpu, board), &job.plan, (wave.take(), look.as_mut()), host);
    let ((mut ended, seen), verdict, recording) = match stage {
        Some(mut stage) => {
            let ended = go(cpu, &mut stage);
            let verdict = stage.end(cpu, &ended.0.uart, "the run ended");
            (ended, verdict, stage.recording(cpu))
        }
        None => (go(cpu, &mut Patience(&mut patience)), None, None),
    };
    if ended.reason == Reason::Host && interrupted.load(Ordering::Relaxed) {
        ended.reason = Reason::Interrupted;
    }
    // Each is kept, whatever becomes of the others.
    let sent = uart_file.map_or(Ok(()), |file| filled(file, args.uart.as_deref(), &ended.uart));
    let drawn = match (ended.unwritten.take(), vcd_file) {
        (Some(error), _) => Err(vcd_error(error)),
        (None, file) => file.map_or(Ok(()), Pending::complete),
    };
    let traced = look.map_or(Ok(()), |look| args.trace.keep(look, trace_file, cpu.cycle(), &ended));
    let text = recording.unwrap_or_default();
    let record = match (args.scenes.record.as_deref(), record) {
        (Some(_), Some(file)) => filled(file, args.scenes.record.as_deref(), text.as_bytes()),
        (Some(_), None) => output::print(text),
        (None, _) => Ok(()),
    };
    let kept = broken.map_or(Ok(()), Err).and(sent).and(drawn).and(traced).and(record);
    Ok(Recorded { ended, verdict, seen, kept })
}

/// Writes a file that was begun, and puts it into its place.
fn filled(file: Pending, name: Option<&str>, bytes: &[u8]) -> Result<(), Failure> {
    let mut out = file.writer()?;
    let written = out.write_all(bytes).and_then(|()| out.flush());
    written.map_err(|error| Failure::writing(name.unwrap_or_default(), &error))?;
    drop(out);
    file.complete()
}

/// How a run ended, a scenario in it, and whether what it wrote is in its place.
struct Recorded {
    ended: Ended,
    verdict: Option<Verdict>,
    seen: Seen,
    kept: Result<(), Failure>,
}
