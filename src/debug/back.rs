//! Commands that go back in time.

use emu_debug::debug::{Access, Action, Expr, Halt, Hit, Passed, Place, Scope, What, Why};

use super::frames::{Calls, Frames};
use super::numbers::brief;
use super::shell::{Done, Shell};

pub(super) fn stepi(shell: &mut Shell, args: &str, out: &mut String) -> Done {
    let count = shell.count(args)?;
    shell.go(out, |session, go_on| session.back_stepi(count, go_on));
    Ok(())
}

pub(super) fn go_on(shell: &mut Shell, _: &str, out: &mut String) -> Done {
    shell.go(out, |session, go_on| session.back_run(go_on));
    Ok(())
}

pub(super) fn goto_cycle(shell: &mut Shell, args: &str, out: &mut String) -> Done {
    let cycle = shell.cycle(args)?;
    shell.go(out, |session, go_on| {
        let halt = session.goto_cycle(cycle, go_on);
        // That it came there is no news.
        if halt.why == Why::Limit { Halt { why: Why::Done } } else { halt }
    });
    Ok(())
}

/// Says which positions are wanted.
type Wanted = fn(&Scope, &Passed<'_>) -> bool;

/// Goes back to the last position that `wanted` and that lies where `calls` says; `count` times.
fn back_to(shell: &mut Shell, args: &str, calls: Calls, wanted: Wanted, out: &mut String) -> Done {
    let count = shell.count(args)?;
    shell.go(out, |session, go_on| {
        let mut halt = Halt { why: Why::Done };
        for _ in 0..count {
            halt = Frames::search(session, calls, wanted, go_on);
            if halt.why != Why::Done {
                break;
            }
        }
        halt
    });
    Ok(())
}

/// A source line begins at a position.
fn begins(scope: &Scope, passed: &Passed<'_>) -> bool {
    let source = scope.source();
    let (pc, bytes) = (passed.target.pc(), scope.chip().word_bytes);
    let Some(line) = source.line_at(pc) else { return false };
    let before = source.line_at(passed.from).map(|line| (&line.file, line.line));
    line.addr == pc * bytes && before != Some((&line.file, line.line))
}

fn has_lines(shell: &Shell) -> bool {
    !shell.session.scope.lines.all().is_empty()
}

pub(super) fn step(shell: &mut Shell, args: &str, out: &mut String) -> Done {
    if !has_lines(shell) {
        return back_to(shell, args, Calls::Into, |_, _| true, out);
    }
    back_to(shell, args, Calls::Into, begins, out)
}

pub(super) fn next(shell: &mut Shell, args: &str, out: &mut String) -> Done {
    if !has_lines(shell) {
        return back_to(shell, args, Calls::Over, |_, _| true, out);
    }
    back_to(shell, args, Calls::Over, begins, out)
}

pub(super) fn nexti(shell: &mut Shell, args: &str, out: &mut String) -> Done {
    back_to(shell, args, Calls::Over, |_, _| true, out)
}

pub(super) fn finish(shell: &mut Shell, _: &str, out: &mut String) -> Done {
    if shell.frames().is_empty() {
        return Err("there is nothing to go back out of: the stack tells of no call".to_owned());
    }
    back_to(shell, "", Calls::Out, |_, _| true, out)
}

pub(super) fn last_write(shell: &mut Shell, args: &str, out: &mut String) -> Done {
    let (text, moves) = match args.strip_suffix(" go") {
        Some(text) => (text.trim(), true),
        None => (args.trim(), false),
    };
    if text.is_empty() {
        return Err("whose last write? last-write buf, last-write PORTB.5, last-write data:0x100".to_owned());
    }
    let here = shell.session.target().cycle();
    let mut found = last(shell, text)?;
    // It stands there already: the one before is meant.
    if moves && found.is_some_and(|(cycle, _)| cycle == here) {
        shell.session.back_stepi(1, &mut || true);
        found = last(shell, text)?;
        if found.is_none() {
            shell.session.goto_cycle(here, &mut || true);
        }
    }
    let place = shell.expr(text)?.place(shell.session.target());
    if let Some((cycle, value)) =
        place.and_then(|place| by_hand(shell, place, if moves { here } else { here.saturating_add(1) }))
        && found.is_none_or(|(last, _)| cycle >= last)
    {
        out.push_str(&format!("{text} {}, set by hand at cycle {cycle}\n", brief(value)));
        if moves {
            shell.go(out, |session, go_on| session.goto_cycle(cycle, go_on));
        }
        return Ok(());
    }
    let Some((cycle, hit)) = found else {
        out.push_str(&format!("{text} did not change in this history\n"));
        return Ok(());
    };
    let value = match (hit.old, hit.new) {
        (Some(old), Some(new)) => format!("{} -> {}", brief(old), brief(new)),
        (None, Some(new)) => brief(new),
        _ => String::new(),
    };
    let instruction = shell.instruction(hit.pc).text;
    out.push_str(&format!("{text} {value}, by {}: {instruction}, at cycle {cycle}\n", shell.spot(hit.pc)));
    if moves {
        shell.go(out, |session, go_on| session.goto_cycle(cycle, go_on));
    }
    Ok(())
}

pub(super) fn reverse_last(shell: &mut Shell, args: &str, out: &mut String) -> Done {
    last_write(shell, &format!("{args} go"), out)
}

/// The last `set` of a place, or of a part of it, before a cycle.
fn by_hand(shell: &Shell, place: Place, end: u64) -> Option<(u64, i64)> {
    let bytes = |place: Place| match place {
        Place::Memory { space, addr, bytes, .. } => Some((space, addr..addr + u32::from(bytes))),
        Place::Bit { space, addr, .. } => Some((space, addr..addr + 1)),
        _ => None,
    };
    let touches = |other: Place| match (place, other, bytes(place), bytes(other)) {
        (Place::RegBit { name, .. }, Place::Reg(of), ..) | (Place::Reg(of), Place::RegBit { name, .. }, ..) => {
            name == of
        }
        (Place::Bit { bit, .. }, Place::Bit { bit: set, .. }, one, two) => one == two && bit == set,
        (.., Some((space, own)), Some((of, set))) => space == of && own.start < set.end && set.start < own.end,
        _ => place == other,
    };
    let sets = shell.session.deeds().filter_map(|(cycle, action)| match action {
        Action::Set(set, _) if touches(*set) => Some(cycle),
        _ => None,
    });
    let cycle = sets.filter(|cycle| *cycle < end).last()?;
    // What came of it, in whatever part it was set.
    Some((cycle, shell.session.value_at(place, cycle)?))
}

/// The last change of a place, and where there is none the last write to its bytes.
fn last(shell: &mut Shell, text: &str) -> Result<Option<(u64, Hit)>, String> {
    let interrupted = |_| "interrupted".to_owned();
    let expr = shell.expr(text)?;
    let place = expr.place(shell.session.target()).ok_or_else(|| format!("`{text}` is no place that is written"))?;
    let bytes = match place {
        Place::Memory { space, addr, bytes, .. } => Some((space, addr, u32::from(bytes))),
        Place::Bit { space, addr, .. } => Some((space, addr, 1)),
        Place::Pin(_) | Place::Reg(_) | Place::RegBit { .. } => None,
        Place::Pc | Place::Cycle | Place::Instructions => {
            return Err(format!("`{text}` changes with every instruction"));
        }
    };
    let by_bytes = |shell: &mut Shell| {
        let Some((space, addr, bytes)) = bytes else { return Ok(None) };
        let width = shell.session.scope.chip().width(space).max(1);
        let range = emu_debug::Range { space, start: addr / width, end: (addr + bytes).div_ceil(width) };
        shell.session.last(What::Access(range, Access::Write), &mut shell.go_on()).map_err(interrupted)
    };
    let by_value = |shell: &mut Shell| {
        let found = shell.session.last(What::Change(Expr::Place(place)), &mut shell.go_on()).map_err(interrupted)?;
        Ok::<_, String>(
            found.map(|(cycle, hit)| (cycle, Hit { pc: shell.session.writer(cycle).unwrap_or(hit.pc), ..hit })),
        )
    };
    // Of a bit the byte is written for others too; of a register of the chip the value changes without a write.
    if matches!(place, Place::Memory { .. }) {
        let found = by_bytes(shell)?;
        return if found.is_some() { Ok(found) } else { by_value(shell) };
    }
    let found = by_value(shell)?;
    if found.is_some() { Ok(found) } else { by_bytes(shell) }
}
