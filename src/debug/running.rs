//! Commands that let the machine run forwards.

use emu_core::cpu::{END_OF_TIME, Reset};
use emu_core::image::TypeId;
use emu_debug::debug::{Action, Flow, Goal, Halt, Place, Session, What, Why};
use emu_debug::stimulus::pin_level;

use super::ladder::wired_pin;
use super::shell::{Done, Shell};
use crate::avr;

const NO_LINES: &str = "note: there are no source lines here, so step and next go by instructions";

/// How deep the machine is in calls, as seen from where it started, and whether it is in a service routine that began since.
#[derive(Debug, Clone, Copy, Default)]
struct Depth {
    calls: i64,
    /// Calls within a service routine, itself counted.
    service: u64,
}

impl Depth {
    /// After an instruction, or the entry of an interrupt.
    fn after(&mut self, flow: Flow, entry: bool) {
        match (self.service, flow) {
            (service, _) if entry => self.service = service + 1,
            (0, Flow::Call) => self.calls += 1,
            (0, Flow::Return) => self.calls -= 1,
            (_, Flow::Call) => self.service += 1,
            (_, Flow::Return) => self.service -= 1,
            _ => {}
        }
    }

    /// It stands where it started, or below.
    fn is_home(self) -> bool {
        self.calls <= 0 && self.service == 0
    }
}

/// The line that an instruction belongs to.
fn line(session: &Session) -> Option<(String, u32)> {
    let source = session.scope.source();
    let line = source.line_at(session.target().pc())?;
    Some((line.file.to_string(), line.line))
}

/// The code of a line begins where the machine is.
fn begins_line(session: &Session) -> bool {
    let (source, pc) = (session.scope.source(), session.target().pc());
    source.line_at(pc).is_some_and(|line| line.addr == pc.saturating_mul(session.scope.chip().word_bytes))
}

/// One step of a source line; `over`: calls are passed. Without lines one instruction.
fn line_step(session: &mut Session, over: bool, forward_only: bool, go_on: &mut dyn FnMut() -> bool) -> Halt {
    let (mut start, from) = (line(session), session.target().pc());
    let (mut depth, mut last) = (Depth::default(), from);
    // Where the prologue of the function ends that it has come into, and how deep that is.
    let mut entered: Option<(u32, i64)> = None;
    session.stroll(END_OF_TIME, true, go_on, &mut |session, flow, entry| {
        depth.after(flow, entry);
        if depth.service > 0 {
            return false;
        }
        if let Some((word, calls)) = entered.filter(|(_, calls)| depth.calls >= *calls) {
            return depth.calls == calls && session.target().pc() == word;
        }
        if depth.calls > 0 && over {
            return false;
        }
        // A jump to itself: nothing but service routines leads out of it, and those return.
        let before = std::mem::replace(&mut last, session.target().pc());
        if !entry && flow == Flow::Plain && before == last {
            return true;
        }
        let here = line(session);
        // A call into code without lines is passed.
        if depth.calls > 0 && start.is_some() && here.is_none() {
            return false;
        }
        // Back in the middle of the line that has called, it goes on to the end of that, as in gdb.
        if depth.calls < 0 && flow == Flow::Return && here.is_some() && here != start && !begins_line(session) {
            start = here;
            return false;
        }
        if depth.calls > 0 && flow == Flow::Call && here.is_some() {
            let pc = session.target().pc();
            entered = session.scope.entered(pc).map(|word| (word, depth.calls));
            if entered.is_some() {
                return false;
            }
        }
        let passed = start.is_none() || here != start || flow == Flow::Call && !over;
        passed && (!forward_only || depth.calls < 0 || session.target().pc() > from)
    })
}

/// Does something up to `count` times, as long as nothing else stops it; only the last is told.
fn times(
    shell: &mut Shell,
    args: &str,
    out: &mut String,
    mut once: impl FnMut(&mut Session, &mut dyn FnMut() -> bool) -> Halt,
) -> Done {
    let count = shell.count(args)?;
    shell.go(out, |session, go_on| {
        let mut halt = Halt { why: Why::Done };
        for _ in 0..count {
            halt = once(session, go_on);
            if halt.why != Why::Done {
                break;
            }
        }
        halt
    });
    Ok(())
}

fn note_lines(shell: &mut Shell, out: &mut String) {
    if line(&shell.session).is_none() {
        shell.note(NO_LINES, out);
    }
}

pub(super) fn step(shell: &mut Shell, args: &str, out: &mut String) -> Done {
    note_lines(shell, out);
    times(shell, args, out, |session, go_on| line_step(session, false, false, go_on))
}

pub(super) fn next(shell: &mut Shell, args: &str, out: &mut String) -> Done {
    note_lines(shell, out);
    times(shell, args, out, |session, go_on| line_step(session, true, false, go_on))
}

pub(super) fn stepi(shell: &mut Shell, args: &str, out: &mut String) -> Done {
    let count = shell.count(args)?;
    shell.go(out, |session, go_on| session.stepi(count, END_OF_TIME, go_on));
    Ok(())
}

pub(super) fn nexti(shell: &mut Shell, args: &str, out: &mut String) -> Done {
    times(shell, args, out, |session, go_on| {
        let mut depth = Depth::default();
        session.stroll(END_OF_TIME, true, go_on, &mut |_, flow, entry| {
            depth.after(flow, entry);
            depth.is_home()
        })
    })
}

/// Steps until the subroutine or service routine has returned.
fn out_of_it(session: &mut Session, go_on: &mut dyn FnMut() -> bool, also: &mut dyn FnMut(&Session) -> bool) -> Halt {
    let mut depth = Depth::default();
    session.stroll(END_OF_TIME, true, go_on, &mut |session, flow, entry| {
        depth.after(flow, entry);
        depth.calls < 0 || also(session)
    })
}

pub(super) fn finish(shell: &mut Shell, _: &str, out: &mut String) -> Done {
    if !shell.may_return() {
        return Err("there is nothing to finish: the stack tells of no call".to_owned());
    }
    if shell.level > 0 {
        // As in gdb: up to where the call that is looked at goes on.
        let target = shell.calls().get(shell.level + 1).map(|frame| (frame.word, frame.sp));
        let (word, sp) = target.ok_or("the outermost call does not return")?;
        let reached = move |session: &Session| session.target().pc() == word && session.target().reg("SP") == Some(sp);
        shell.go(out, |session, go_on| session.stroll(END_OF_TIME, true, go_on, &mut |session, _, _| reached(session)));
        return Ok(());
    }
    let kind = shell.result_kind();
    let halt = shell.go(out, |session, go_on| out_of_it(session, go_on, &mut |_| false));
    if let (Why::Done, Some(kind)) = (halt.why, kind)
        && let Some(object) = shell.session.scope.calls().result(kind)
    {
        let value = object.text(&shell.session.scope, shell.session.target(), None);
        out.push_str(&format!("Value returned is {value}\n"));
    }
    Ok(())
}

pub(super) fn advance(shell: &mut Shell, args: &str, out: &mut String) -> Done {
    if args.is_empty() {
        return Err("where to? advance main.c:12, advance price".to_owned());
    }
    until(shell, args, out)
}

/// Back to where the history begins; it is told only where that cannot be.
fn rewind(shell: &mut Shell) -> Done {
    let first = shell.session.first_cycle();
    let go_on = &mut shell.go_on();
    match shell.session.goto_cycle(first, go_on).why {
        Why::Interrupted => Err("interrupted".to_owned()),
        _ => Ok(()),
    }
}

pub(super) fn run(shell: &mut Shell, _: &str, out: &mut String) -> Done {
    rewind(shell)?;
    go_on(shell, "", out)
}

pub(super) fn start(shell: &mut Shell, _: &str, out: &mut String) -> Done {
    let words = shell.line_location("main").map_err(|why| format!("{why}; run goes to the first breakpoint"))?;
    rewind(shell)?;
    shell.go(out, |session, go_on| session.run(&Goal { words: words.into_iter().collect(), ..Goal::default() }, go_on));
    Ok(())
}

pub(super) fn jump(shell: &mut Shell, args: &str, out: &mut String) -> Done {
    if args.is_empty() {
        return Err("where to? jump main.c:12, jump 0x86".to_owned());
    }
    let word = shell.line_location(args)?.first().copied().unwrap_or_default();
    let address = shell.session.scope.chip().code_address(word);
    shell.session.act(Action::Set(Place::Pc, address.into()))?;
    shell.registers = shell.core_registers();
    go_on(shell, "", out)
}

pub(super) fn until(shell: &mut Shell, args: &str, out: &mut String) -> Done {
    if args.is_empty() {
        note_lines(shell, out);
        shell.go(out, |session, go_on| line_step(session, true, true, go_on));
        return Ok(());
    }
    let words = shell.line_location(args)?;
    let inside = !shell.frames().is_empty();
    shell.go(out, |session, go_on| match inside {
        true => out_of_it(session, go_on, &mut |session| words.contains(&session.target().pc())),
        false => session.run(&Goal { words: words.into_iter().collect(), ..Goal::default() }, go_on),
    });
    Ok(())
}

pub(super) fn go_on(shell: &mut Shell, args: &str, out: &mut String) -> Done {
    let count = shell.count(args)?;
    if count > 1 {
        let pc = shell.session.target().pc();
        let here = |what: &What| matches!(what, What::Code(words) if words.contains(&pc));
        let id = shell.session.points.enabled().find(|point| here(&point.what)).map(|point| point.id);
        let point = id.and_then(|id| shell.session.points.get_mut(id));
        point.ok_or("a count is for a breakpoint that has stopped it here; there is none")?.ignore = count - 1;
    }
    shell.go(out, |session, go_on| session.run(&Goal::default(), go_on));
    Ok(())
}

pub(super) fn until_pin(shell: &mut Shell, args: &str, out: &mut String) -> Done {
    let chip = shell.session.scope.chip();
    let named = shell.view.as_ref().map_or_else(|| args.to_owned(), |view| wired_pin(view, args));
    let own = avr::own_name(chip, &shell.session.scope.source().names.with_channel(&named));
    let (pin, level) = pin_level(chip, &own)?;
    let id = shell.session.points.add(What::Pin(pin, Some(level)), args, true);
    shell.go(out, |session, go_on| session.run(&Goal::default(), go_on));
    shell.session.points.remove(id);
    Ok(())
}

pub(super) fn run_to_cycle(shell: &mut Shell, args: &str, out: &mut String) -> Done {
    let cycle = shell.cycle(args)?;
    let now = shell.session.target().cycle();
    if cycle < now {
        return Err(format!("cycle {cycle} is past, it is {now} now; goto-cycle goes back"));
    }
    shell.go(out, |session, go_on| session.run(&Goal { until: Some(cycle), passes: true, ..Goal::default() }, go_on));
    Ok(())
}

pub(super) fn reset(shell: &mut Shell, args: &str, out: &mut String) -> Done {
    let kinds = [
        ("external", Reset::External),
        ("power", Reset::PowerOn),
        ("watchdog", Reset::Watchdog),
        ("brownout", Reset::BrownOut),
    ];
    let wanted = if args.is_empty() { "external" } else { args };
    let found = kinds.iter().find(|(name, _)| name.starts_with(wanted));
    let (_, why) =
        found.ok_or_else(|| format!("`{args}` is no reset; there are power, external, watchdog, brownout"))?;
    shell.session.act(Action::Reset(*why))?;
    shell.here(out);
    Ok(())
}

impl Shell {
    /// A machine cycle or a time: `16000`, `$cycle + 100`, `10ms`.
    pub(super) fn cycle(&self, text: &str) -> Result<u64, String> {
        if text.trim().is_empty() {
            return Err("a cycle or a time is missing: 16000, $cycle+100, 10ms".to_owned());
        }
        let is_time = text.trim().ends_with(['s', 'c']) && text.trim().starts_with(|c: char| c.is_ascii_digit());
        if is_time {
            return self.session.clock().cycles(text.trim());
        }
        let value = self.value(text)?;
        u64::try_from(value).map_err(|_| format!("cycle {value} is before power-up"))
    }

    /// The type of what the function returns that the machine is in; nothing where it is not known, or `void`.
    fn result_kind(&self) -> Option<TypeId> {
        let byte = self.session.target().pc().saturating_mul(self.session.scope.chip().word_bytes);
        self.session.scope.calls().info.function_at(byte)?.result
    }

    /// The same as [`Shell::location`], but that a number alone is a line where the program has lines, as in gdb.
    pub(super) fn line_location(&self, text: &str) -> Result<Vec<u32>, String> {
        let text = text.trim();
        let named = text.rsplit_once(':').and_then(|(file, line)| Some((self.source_file(file)?, line.parse().ok()?)));
        match self.plain_line(text).or(named) {
            Some((file, line)) => {
                // Of a line without code the next one is meant that has some.
                let lines =
                    self.session.scope.lines.all().iter().filter(|known| *known.file == *file && known.line >= line);
                let line = lines.map(|known| known.line).min().unwrap_or(line);
                let scope = &self.session.scope;
                let words = scope.source().words(&format!("{file}:{line}"))?;
                let bytes: Vec<u32> = words.iter().map(|word| word * scope.chip().word_bytes).collect();
                Ok(scope.line_words(&bytes))
            }
            None => match self.session.scope.function_words(text) {
                words if words.is_empty() => self.location(text),
                words => Ok(words),
            },
        }
    }

    /// Program words that a text stands for: an address, a symbol, `main.c:12`, `*EXPR`, `$pc`.
    pub(super) fn location(&self, text: &str) -> Result<Vec<u32>, String> {
        let text = text.trim();
        if let Some(words) = self.rung_location(text) {
            return words;
        }
        let computed = text.strip_prefix('*').or_else(|| text.starts_with('$').then_some(text));
        let Some(expr) = computed else { return self.session.scope.source().words(text) };
        let value = self.value(expr)?;
        let address = u32::try_from(value).map_err(|_| format!("`{text}` is no address: {value}"))?;
        self.session.scope.source().words(&format!("0x{address:x}"))
    }
}
