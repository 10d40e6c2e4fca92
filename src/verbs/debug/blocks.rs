//! Blocks of lines up to their `end`: commands of points, commands of the user, loops and choices.

use std::collections::VecDeque;

use super::commands::{find_command, split_command};
use super::shell::{CommandResult, DebugShell};

/// A line of the queue behind which the loop that is running begins anew.
const LOOP_MARK: &str = "\u{1}loop";

/// A line of the queue behind the commands of points.
pub(super) const POINT_MARK: &str = "\u{1}point";

/// Commands of gdb whose blocks hold no commands of the debugger.
const FOREIGN_BLOCKS: &[&str] = &["python", "py", "guile", "gu", "compile"];

/// Commands that begin a block.
const BLOCK_COMMANDS: &[&str] = &["commands", "define", "document", "while", "if"];

/// What the lines of a block are for.
pub(super) enum BlockKind {
    /// Commands of the point of this number.
    Point(u32),
    /// A command of the user.
    Define(String),
    /// The help text of a command of the user.
    Document(String),
    /// Lines that are repeated while an expression is not 0.
    While(String),
    /// Lines that are carried out where an expression is not 0; those behind `else` where it is.
    If(String),
    /// Lines in another language, which are refused: the command that begins them.
    Foreign(String),
    /// Lines of a command that was refused already.
    Refused,
}

impl BlockKind {
    /// The lines are no commands: the first `end` ends them.
    fn is_text(&self) -> bool {
        matches!(self, BlockKind::Document(_) | BlockKind::Foreign(_))
    }
}

/// A block whose `end` has not come yet.
pub(super) struct OpenBlock {
    kind: BlockKind,
    lines: Vec<String>,
    /// Blocks within it that are still open.
    depth: u32,
}

/// A command that the user has defined.
#[derive(Default)]
pub(super) struct UserCommand {
    lines: Vec<String>,
    pub(super) help: Option<String>,
}

/// A line begins a block that ends with `end`.
fn begins_block(line: &str) -> bool {
    let Some((word, args)) = split_command(line) else { return false };
    FOREIGN_BLOCKS.contains(&word) && args.is_empty()
        || find_command(word).is_ok_and(|found| BLOCK_COMMANDS.contains(&found.name))
}

/// How many blocks more are open behind a line.
fn opened_by(line: &str) -> i32 {
    if line == "end" { -1 } else { i32::from(begins_block(line)) }
}

/// The lines before the `else` of a block, and those behind it.
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

/// A line of a command of the user with `$argc`, `$arg0`, .. replaced by its arguments.
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

/// Words with blanks between them; what is in quotes is one.
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
    /// The lines that follow belong to a block, up to its `end`.
    pub(super) fn open_block(&mut self, kind: BlockKind) {
        self.block = Some(OpenBlock { kind, lines: Vec::new(), depth: 0 });
    }

    /// Opens the block of a command in another language; false where the line begins none.
    pub(super) fn open_foreign_block(&mut self, word: &str, args: &str) -> bool {
        let is_foreign = FOREIGN_BLOCKS.contains(&word) && args.is_empty();
        if is_foreign {
            self.open_block(BlockKind::Foreign(word.to_owned()));
        }
        is_foreign
    }

    /// Takes a line that belongs to a block; nothing where no block is open. Its `end` may fail.
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
                // Each iteration begins anew with the lines of the loop; an interrupt ends it.
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
                return Err(format!("{why}; its lines up to `end` are left out"));
            }
        }
        Ok(())
    }

    /// Lines that are carried out before those that are queued already.
    fn push_front(&mut self, lines: Vec<String>) {
        let rest = std::mem::replace(&mut self.queue, lines.into());
        self.queue.extend(rest);
    }

    /// Commands of points that have stopped the machine are carried out next; what is left of those that have let it run is not.
    pub(super) fn enqueue(&mut self, mut lines: Vec<String>) {
        if let Some(end) = self.queue.iter().position(|line| line == POINT_MARK) {
            self.queue.drain(..=end);
        }
        if !lines.is_empty() {
            lines.push(POINT_MARK.to_owned());
            self.push_front(lines);
        }
    }

    /// A line of the queue that only marks a place.
    pub(super) fn is_mark(line: &str) -> bool {
        matches!(line, LOOP_MARK | POINT_MARK | "silent")
    }

    /// Queues the lines of a command of the user; false where there is none of that name.
    pub(super) fn queue_user_command(&mut self, word: &str, args: &str) -> bool {
        let arguments = split_arguments(args);
        let Some(command) = self.user_commands.get(word) else { return false };
        let lines = command.lines.iter().map(|line| with_arguments(line, &arguments)).collect();
        self.push_front(lines);
        true
    }

    /// The lines have come to their end.
    ///
    /// # Errors
    /// They end within a block, which is left out then.
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
        Err(format!("{what} their `end`").replace("lacks their", "lacks its"))
    }
}

/// The name of a command of the user.
fn user_name(args: &str) -> Result<String, String> {
    let is_name = !args.is_empty() && args.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '-'));
    if !is_name {
        return Err("write the name of the command: define twice".to_owned());
    }
    if args.starts_with("hook-") || args.starts_with("hookpost-") {
        return Err("there are no hooks; `display` and `commands` do something at a stop".to_owned());
    }
    match find_command(args) {
        Ok(own) if own.name == args || own.aliases.contains(&args) => {
            Err(format!("`{args}` is a command of the debugger; choose another name"))
        }
        _ => Ok(args.to_owned()),
    }
}

/// Opens a block; of a refused one the lines are left out, they are no commands of their own.
fn open(shell: &mut DebugShell, kind: Result<BlockKind, String>) -> CommandResult {
    let (kind, done) = match kind {
        Ok(kind) => (kind, Ok(())),
        Err(why) => (BlockKind::Refused, Err(why)),
    };
    shell.open_block(kind);
    done
}

pub(super) fn define(shell: &mut DebugShell, args: &str, _: &mut String) -> CommandResult {
    open(shell, user_name(args).map(BlockKind::Define))
}

pub(super) fn document(shell: &mut DebugShell, args: &str, _: &mut String) -> CommandResult {
    let known = shell.user_commands.contains_key(args).then(|| BlockKind::Document(args.to_owned()));
    open(shell, known.ok_or_else(|| format!("no command `{args}` is defined; `define` does that")))
}

pub(super) fn while_loop(shell: &mut DebugShell, args: &str, _: &mut String) -> CommandResult {
    open(shell, condition(args).map(BlockKind::While))
}

pub(super) fn if_block(shell: &mut DebugShell, args: &str, _: &mut String) -> CommandResult {
    open(shell, condition(args).map(BlockKind::If))
}

fn condition(args: &str) -> Result<String, String> {
    let why = "the condition is missing: while $i < 10, if x > 5";
    Some(args.to_owned()).filter(|args| !args.is_empty()).ok_or_else(|| why.to_owned())
}

/// The queue up to where the loop that is running begins anew.
fn skip_iteration(queue: &mut VecDeque<String>) -> CommandResult {
    let at = queue.iter().position(|line| line == LOOP_MARK).ok_or("no loop is running")?;
    queue.drain(..=at);
    Ok(())
}

pub(super) fn loop_continue(shell: &mut DebugShell, _: &str, _: &mut String) -> CommandResult {
    skip_iteration(&mut shell.queue)
}

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
