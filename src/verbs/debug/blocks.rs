//! Blocks of lines up to their `end`: commands of points, user-defined commands, loops and conditionals.

use std::collections::VecDeque;

use super::command_error::CommandError;
use super::commands::{CommandLine, find_command, split_command};
use super::shell::{CommandResult, DebugShell};

/// Queue entry after which the next iteration of the running loop begins.
const LOOP_MARK: &str = "\u{1}loop";

/// Queue entry after the last command of a point.
pub(super) const POINT_MARK: &str = "\u{1}point";

/// Commands of gdb whose blocks contain text in another language.
const FOREIGN_BLOCKS: &[&str] = &["python", "py", "guile", "gu", "compile"];

/// Commands that begin a block.
const BLOCK_COMMANDS: &[&str] = &["commands", "define", "document", "while", "if"];

/// What the lines of a block are for.
pub(super) enum BlockKind {
    /// Commands of the point of this number.
    Point(u32),
    /// A user-defined command.
    Define(String),
    /// The help text of a user-defined command.
    Document(String),
    /// Lines that are repeated while an expression is not 0.
    While(String),
    /// Lines that are executed if an expression is not 0; those after `else` if it is 0.
    If(String),
    /// Lines in another language, which are refused; holds the command that begins them.
    Foreign(String),
    /// Lines of a block whose first command was refused.
    Refused,
}

impl BlockKind {
    /// Returns true if the lines are text: the first `end` ends them, and nested blocks are not counted.
    fn is_text(&self) -> bool {
        matches!(self, BlockKind::Document(_) | BlockKind::Foreign(_))
    }
}

/// A block whose `end` has not been read yet.
pub(super) struct OpenBlock {
    kind: BlockKind,
    lines: Vec<String>,
    /// Number of nested blocks that are still open.
    depth: u32,
}

/// A user-defined command.
#[derive(Default)]
pub(super) struct UserCommand {
    lines: Vec<String>,
    /// The text for `help`, if the user gave one.
    pub(super) help: Option<String>,
}

/// Returns true if a line begins a block that ends with `end`.
fn begins_block(line: &str) -> bool {
    let Some(CommandLine { word, args }) = split_command(line) else { return false };
    FOREIGN_BLOCKS.contains(&word) && args.is_empty()
        || find_command(word).is_ok_and(|found| BLOCK_COMMANDS.contains(&found.name))
}

/// Returns the change of the nesting depth by a line: 1, 0 or -1.
fn opened_by(line: &str) -> i32 {
    if line == "end" { -1 } else { i32::from(begins_block(line)) }
}

/// Splits the lines of a block into those before and those after its own `else`.
fn split_else(lines: &[String]) -> (&[String], &[String]) {
    let mut depth = 0;
    for (at, line) in lines.iter().enumerate() {
        if line == "else" && depth == 0 {
            return (&lines[..at], &lines[at + 1..]);
        }
        depth += opened_by(line);
    }
    (lines, &[])
}

/// Replaces `$argc`, `$arg0`, .. in a line of a user-defined command by its arguments.
fn with_arguments(line: &str, arguments: &[&str]) -> String {
    let (mut text, mut rest) = (String::new(), line);
    while let Some((before, behind)) = rest.split_once("$arg") {
        text.push_str(before);
        let digits = behind.len() - behind.trim_start_matches(|c: char| c.is_ascii_digit()).len();
        let argument = behind[..digits].parse::<usize>().ok().and_then(|number| arguments.get(number));
        let (own, skipped) = match argument {
            Some(argument) => ((*argument).to_owned(), digits),
            None if digits == 0 && behind.starts_with('c') => (arguments.len().to_string(), 1),
            None => ("$arg".to_owned(), 0),
        };
        text.push_str(&own);
        rest = &behind[skipped..];
    }
    text + rest
}

/// Splits arguments at blanks; text in quotes is one argument.
fn split_arguments(args: &str) -> Vec<&str> {
    let (mut words, mut start, mut quote) = (Vec::new(), None, None);
    for (at, c) in args.char_indices() {
        match quote {
            Some(open) if c == open => quote = None,
            Some(_) => {}
            None if c.is_whitespace() => words.extend(start.take().map(|start| &args[start..at])),
            None => {
                start.get_or_insert(at);
                quote = Some(c).filter(|c| matches!(c, '"' | '\''));
            }
        }
    }
    words.extend(start.map(|start| &args[start..]));
    words
}

impl DebugShell {
    /// Opens a block: the lines that follow belong to it, up to its `end`.
    pub(super) fn open_block(&mut self, kind: BlockKind) {
        self.block = Some(OpenBlock { kind, lines: Vec::new(), depth: 0 });
    }

    /// Opens the block of a command in another language. Returns false if the line begins no such block.
    pub(super) fn open_foreign_block(&mut self, word: &str, args: &str) -> bool {
        let is_foreign = FOREIGN_BLOCKS.contains(&word) && args.is_empty();
        if is_foreign {
            self.open_block(BlockKind::Foreign(word.to_owned()));
        }
        is_foreign
    }

    /// Adds a line to the open block, or closes the block at its `end`, which can fail. Returns `None` if no
    /// block is open.
    pub(super) fn collect_line(&mut self, line: &str) -> Option<CommandResult> {
        let mut block = self.block.take()?;
        let line = line.trim();
        if line == "end" && block.depth == 0 {
            return Some(self.close_block(block));
        }
        if !block.kind.is_text() {
            block.depth = block.depth.saturating_add_signed(opened_by(line));
        }
        block.lines.push(line.to_owned());
        self.block = Some(block);
        Some(Ok(()))
    }

    fn close_block(&mut self, block: OpenBlock) -> CommandResult {
        let OpenBlock { kind, lines, .. } = block;
        match kind {
            BlockKind::Point(id) => {
                if let Some(point) = self.session.points.get_mut(id) {
                    point.commands = lines;
                }
            }
            BlockKind::Define(name) => {
                let help = self.user_commands.remove(&name).and_then(|old| old.help);
                self.user_commands.insert(name, UserCommand { lines, help });
            }
            BlockKind::Document(name) => {
                self.user_commands.entry(name).or_default().help = Some(lines.join("\n"));
            }
            BlockKind::If(condition) => {
                let (then, otherwise) = split_else(&lines);
                let chosen = if self.expression_value(&condition)?.is_true() { then } else { otherwise };
                self.push_front(chosen.to_vec());
            }
            BlockKind::While(condition) => {
                // Each iteration queues the lines of the loop again; an interrupt ends the loop.
                self.queued_count = 0;
                if self.expression_value(&condition)?.is_true() {
                    let again = [LOOP_MARK.to_owned(), format!("while {condition}")];
                    let again = again.into_iter().chain(lines.iter().cloned()).chain(["end".to_owned()]);
                    let all = lines.iter().cloned().chain(again).collect();
                    self.push_front(all);
                }
            }
            BlockKind::Refused => {}
            BlockKind::Foreign(word) => {
                let why = find_command(&word).err().unwrap_or_default();
                return Err(format!("{why}; its lines up to `end` are skipped").into());
            }
        }
        Ok(())
    }

    /// Queues lines before those that are queued already.
    fn push_front(&mut self, lines: Vec<String>) {
        let rest = std::mem::replace(&mut self.queue, lines.into());
        self.queue.extend(rest);
    }

    /// Queues the commands of the points that have stopped the machine. Drops the remaining commands of the
    /// points that had resumed it.
    pub(super) fn enqueue(&mut self, mut lines: Vec<String>) {
        if let Some(end) = self.queue.iter().position(|line| line == POINT_MARK) {
            self.queue.drain(..=end);
        }
        if !lines.is_empty() {
            lines.push(POINT_MARK.to_owned());
            self.push_front(lines);
        }
    }

    /// Returns true if a queued line is only a mark, and no command.
    pub(super) fn is_mark(line: &str) -> bool {
        matches!(line, LOOP_MARK | POINT_MARK | "silent")
    }

    /// Queues the lines of a user-defined command. Returns false if there is no command of that name.
    pub(super) fn queue_user_command(&mut self, word: &str, args: &str) -> bool {
        let arguments = split_arguments(args);
        let Some(command) = self.user_commands.get(word) else { return false };
        let lines = command.lines.iter().map(|line| with_arguments(line, &arguments)).collect();
        self.push_front(lines);
        true
    }

    /// Handles the end of the input lines, and discards an open block.
    ///
    /// # Errors
    /// A block is still open.
    pub fn end_of_lines(&mut self) -> CommandResult {
        let what = match self.block.take().map(|block| block.kind) {
            None | Some(BlockKind::Refused) => return Ok(()),
            Some(BlockKind::Point(id)) => format!("the commands of point {id} lack"),
            Some(BlockKind::Define(name)) => format!("`define {name}` lacks"),
            Some(BlockKind::Document(name)) => format!("`document {name}` lacks"),
            Some(BlockKind::While(condition)) => format!("`while {condition}` lacks"),
            Some(BlockKind::If(condition)) => format!("`if {condition}` lacks"),
            Some(BlockKind::Foreign(word)) => format!("`{word}` lacks"),
        };
        Err(format!("{what} their `end`").replace("lacks their", "lacks its").into())
    }
}

/// Checks the name of a user-defined command.
fn user_name(args: &str) -> Result<String, CommandError> {
    let is_name = !args.is_empty() && args.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '-'));
    if !is_name {
        return Err("write the name of the command: define twice".into());
    }
    if args.starts_with("hook-") || args.starts_with("hookpost-") {
        return Err("there are no hooks; `display` and `commands` do something at a stop".into());
    }
    match find_command(args) {
        Ok(own) if own.name == args || own.aliases.contains(&args) => {
            Err(format!("`{args}` is a command of the debugger; choose another name").into())
        }
        _ => Ok(args.to_owned()),
    }
}

/// Opens a block. If its first command is refused, its lines are skipped, because they are not commands of
/// their own.
fn open(shell: &mut DebugShell, kind: Result<BlockKind, CommandError>) -> CommandResult {
    let (kind, done) = match kind {
        Ok(kind) => (kind, Ok(())),
        Err(why) => (BlockKind::Refused, Err(why)),
    };
    shell.open_block(kind);
    done
}

/// `define`: reads the lines of a user-defined command.
pub(super) fn define(shell: &mut DebugShell, args: &str, _: &mut String) -> CommandResult {
    open(shell, user_name(args).map(BlockKind::Define))
}

/// `document`: reads the help of a user-defined command.
pub(super) fn document(shell: &mut DebugShell, args: &str, _: &mut String) -> CommandResult {
    let known = shell.user_commands.contains_key(args).then(|| BlockKind::Document(args.to_owned()));
    open(shell, known.ok_or_else(|| format!("no command `{args}` is defined; `define` does that").into()))
}

/// `while`: reads the lines of a loop.
pub(super) fn while_loop(shell: &mut DebugShell, args: &str, _: &mut String) -> CommandResult {
    open(shell, condition(args).map(BlockKind::While))
}

/// `if`: reads the lines of a condition.
pub(super) fn if_block(shell: &mut DebugShell, args: &str, _: &mut String) -> CommandResult {
    open(shell, condition(args).map(BlockKind::If))
}

fn condition(args: &str) -> Result<String, CommandError> {
    let why = "the condition is missing: while $i < 10, if x > 5";
    Some(args.to_owned()).filter(|args| !args.is_empty()).ok_or_else(|| why.into())
}

/// Drops the queue up to the start of the next iteration of the running loop.
fn skip_iteration(queue: &mut VecDeque<String>) -> CommandResult {
    let at = queue.iter().position(|line| line == LOOP_MARK).ok_or("no loop is running")?;
    queue.drain(..=at);
    Ok(())
}

/// `loop_continue`: begins the next iteration of the loop.
pub(super) fn loop_continue(shell: &mut DebugShell, _: &str, _: &mut String) -> CommandResult {
    skip_iteration(&mut shell.queue)
}

/// `loop_break`: leaves the loop.
pub(super) fn loop_break(shell: &mut DebugShell, _: &str, _: &mut String) -> CommandResult {
    skip_iteration(&mut shell.queue)?;
    let mut depth = 0;
    while let Some(line) = shell.queue.pop_front() {
        depth += opened_by(&line);
        if depth == 0 {
            break;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{split_arguments, split_else, with_arguments};

    #[test]
    fn arguments_are_put_into_lines() {
        assert_eq!(split_arguments("a 'b c' d"), ["a", "'b c'", "d"]);
        assert_eq!(with_arguments("p $arg0 + $arg1, $argc $arg9 $i", &["x", "y"]), "p x + y, 2 $arg9 $i");
    }

    #[test]
    fn an_else_belongs_to_its_own_if() {
        let lines = ["if 1", "else", "end", "a", "else", "b"].map(str::to_owned);
        let (then, otherwise) = split_else(&lines);
        assert_eq!((then.len(), otherwise), (4, &["b".to_owned()][..]));
    }
}
