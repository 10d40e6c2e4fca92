//! The commands of `monitor`. gdb does not read registers again after such a command, so commands that change
//! the machine print a hint.

use std::convert::Infallible;

use emu_core::cpu::ResetCause;
use emu_debug::address_names::AddressRange;
use emu_debug::debug::{HistorySize, SessionStopReason, UserAction};
use gdbstub::target::ext::monitor_cmd::{ConsoleOutput, MonitorCmd};

use crate::error::GdbError;
use crate::gdb_target::GdbTarget;

const HELP: &str = "\
reset         resets the chip by its reset pin; `reset power` by its supply
halt          prints the position of the program, which is stopped while gdb waits
cycle         machine cycles, instructions and time since power-up
scan          scans begun, of a ladder program
why           the reason of the last stop
back N        goes N steps back, by default 1
goto CYCLE    goes to a cycle, in the past or in the future
peek PLACE    bytes of a memory: data:0x100..0x120, PORTB, a symbol
print EXPR    an expression over registers, memory, pins, symbols: PORTB.5, $cycle
set PLACE=EXPR   assigns a value: a pin, a register, a variable
history       copies of the machine, and external actions";

/// The hint after a command that changes the machine without gdb's knowledge.
const FLUSH_HINT: &str = "gdb still shows the old registers; update them with `maintenance flush register-cache`";

/// Maximum number of bytes that `peek` shows.
const MAX_PEEK_BYTES: usize = 1024;

impl MonitorCmd for GdbTarget<'_> {
    fn handle_monitor_cmd(&mut self, command: &[u8], mut out: ConsoleOutput<'_>) -> Result<(), Infallible> {
        let text = String::from_utf8_lossy(command);
        let answer = self.run_command(text.trim());
        out.write_raw(answer.as_bytes());
        out.write_raw(b"\n");
        Ok(())
    }
}

impl GdbTarget<'_> {
    fn run_command(&mut self, text: &str) -> String {
        let (word, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
        let rest = rest.trim();
        match word.trim_end_matches('?') {
            "help" | "" => HELP.to_owned(),
            "reset" => match rest {
                "" => self.reset(ResetCause::External),
                "power" => self.reset(ResetCause::PowerOn),
                other => format!("`{other}` is not a kind of reset; `reset` and `reset power` are"),
            },
            "halt" => self.describe_place(),
            "cycle" => self.describe_time(),
            "scan" => match self.session.scan() {
                Some(scan) => format!("scan {scan}"),
                None => "this program has no scans; one compiled from a ladder program has".to_owned(),
            },
            "why" if rest.is_empty() => self.last_halt.clone(),
            "back" => self.run_back_command(rest),
            "goto" => self.run_goto_command(rest),
            "peek" => self.run_peek_command(rest),
            "print" => match self.session.scope.parse_expression(rest) {
                Ok(expr) => match expr.value(self.session.machine()) {
                    Some(value) => format!("{value}"),
                    None => "it has no value now: a pin floats, or a place does not exist".to_owned(),
                },
                Err(why) => why.to_string(),
            },
            "set" => self.set_place(rest),
            "history" => self.describe_history(),
            _ => self.run_extra_command(text),
        }
    }

    /// Executes a command of the handler that the server was started with.
    fn run_extra_command(&mut self, text: &str) -> String {
        let lines = self.monitor.as_mut().and_then(|monitor| monitor(self.session, text));
        lines.map_or_else(|| format!("no command `{text}`; `monitor help` lists them"), |lines| lines.join("\n"))
    }

    fn describe_place(&self) -> String {
        let machine = self.session.machine();
        format!("stopped at {}, cycle {}", self.session.scope.source().describe_word(machine.pc()), machine.cycle())
    }

    fn describe_time(&self) -> String {
        let machine = self.session.machine();
        let seconds = self.session.clock().seconds(machine.cycle());
        format!("cycle {}, {} instructions, {seconds:.9} s", machine.cycle(), machine.instructions())
    }

    fn reset(&mut self, why: ResetCause) -> String {
        match self.session.apply_action(UserAction::Reset(why)) {
            Ok(()) => format!("reset; {}\n{FLUSH_HINT}", self.describe_place()),
            Err(why) => why.to_string(),
        }
    }

    fn run_back_command(&mut self, rest: &str) -> String {
        let Some(n) = (if rest.is_empty() { Some(1) } else { rest.parse().ok() }) else {
            return format!("`{rest}` is not a number of steps");
        };
        let input = &mut self.input;
        let halt = self.session.step_back(n, &mut || input.may_continue());
        self.describe_move(&halt)
    }

    fn run_goto_command(&mut self, rest: &str) -> String {
        let number = rest.strip_prefix("0x").map_or_else(|| rest.parse().ok(), |hex| u64::from_str_radix(hex, 16).ok());
        let Some(cycle) = number else { return format!("`{rest}` is not a cycle; write `goto 1000`") };
        let input = &mut self.input;
        let halt = self.session.goto_cycle(cycle, &mut || input.may_continue());
        self.describe_move(&halt)
    }

    fn describe_move(&self, why: &SessionStopReason) -> String {
        let what = match why {
            SessionStopReason::Beginning => "the history begins here; ",
            SessionStopReason::Interrupted => "interrupted; ",
            SessionStopReason::Halted => "nothing can wake the chip any more; ",
            SessionStopReason::BlockedOnInput => "only an external stimulus can change what the program does; ",
            _ => "",
        };
        format!("{what}{}\n{FLUSH_HINT}", self.describe_place())
    }

    fn run_peek_command(&self, rest: &str) -> String {
        let range = match self.session.scope.parse_range(rest) {
            Ok(range) => range,
            Err(why) => return why.to_string(),
        };
        let AddressRange { space, start, end } = range;
        let machine = self.session.machine();
        let width = machine.chip().bytes_per_address(space);
        let bytes = (start.saturating_mul(width)..end.saturating_mul(width)).take(MAX_PEEK_BYTES);
        let bytes: Vec<u8> = bytes.filter_map(|at| machine.peek(space, at)).collect();
        let lines = bytes.chunks(16).zip((start..).step_by(16 / width.max(1) as usize));
        let line = |(bytes, at): (&[u8], u32)| {
            let hex: Vec<String> = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
            format!("{space}:0x{at:04x}  {}", hex.join(" "))
        };
        lines.map(line).collect::<Vec<_>>().join("\n")
    }

    fn set_place(&mut self, rest: &str) -> String {
        let Some((place, value)) = rest.split_once('=') else { return "write `set PLACE=EXPR`".to_owned() };
        match self.assign(place.trim(), value.trim()) {
            Ok(()) => FLUSH_HINT.to_owned(),
            Err(why) => why.to_string(),
        }
    }

    fn assign(&mut self, place: &str, value: &str) -> Result<(), GdbError> {
        let scope = &self.session.scope;
        let place = scope.parse_expression(place)?.place(self.session.machine()).ok_or(GdbError::NotAPlace)?;
        let value = scope.parse_expression(value)?.value(self.session.machine()).ok_or(GdbError::NoValue)?;
        Ok(self.session.apply_action(UserAction::Set(place, value))?)
    }

    fn describe_history(&self) -> String {
        let HistorySize { copies, bytes } = self.session.history_size();
        let actions = self.session.input_events().count();
        format!("{copies} copies of the machine in {} KB, {actions} external actions", bytes.div_ceil(1024))
    }
}
