//! Commands about the session itself: scripts, leaving.

use emu_debug::snapshot;

use super::shell::{Done, Flow, Shell};
use crate::codes::reason;
use crate::fail::Failure;
use crate::input;
use crate::report::Texts;

/// How deep scripts may call each other up.
const DEEPEST: u32 = 20;

pub(super) fn source(shell: &mut Shell, args: &str, out: &mut String) -> Done {
    if args.is_empty() {
        return Err("the name of a file is missing".to_owned());
    }
    let bytes = input::read(args).map_err(|error| format!("{args} cannot be read: {}", reason(&error)))?;
    shell.script(args, &diag::text::readable(&bytes), &mut |_| {}, out)
}

/// The lines of a script that are commands, each with its number: empty ones repeat nothing, they are for the reader.
pub fn commands_of(text: &str) -> impl Iterator<Item = (u32, &str)> {
    (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty())
}

impl Shell {
    /// Carries out the lines of a script, up to the first that fails; `tell` is given each before it.
    pub fn script(&mut self, name: &str, text: &str, tell: &mut dyn FnMut(&str), out: &mut String) -> Done {
        if self.nesting >= DEEPEST {
            return Err(format!("{name}: scripts are nested too deeply"));
        }
        self.nesting += 1;
        // What a point still wants done goes on behind the script.
        let queue = std::mem::take(&mut self.queue);
        let done = commands_of(text).try_for_each(|(number, line)| {
            if self.leave.is_some() {
                return Ok(());
            }
            tell(line);
            let why = match self.execute(line, out) {
                Flow::Failed(why) => why,
                _ if self.interrupted() => "interrupted".to_owned(),
                _ => return Ok(()),
            };
            // Of scripts that call each other up the innermost tells its place.
            let placed = std::mem::replace(&mut self.placed, true);
            Err(if placed { why } else { format!("{name}:{number}: {why}") })
        });
        let done = done.and_then(|()| self.ended().map_err(|why| format!("{name}: {why}")));
        self.nesting -= 1;
        self.queue = queue;
        self.placed &= self.nesting > 0;
        done
    }
}

/// `save`.
pub(super) fn save(shell: &mut Shell, args: &str, out: &mut String) -> Done {
    let (file, cycle) = (named(args)?, shell.session.target().cycle());
    shell.session.bare()?;
    shell.shelf.write(file, cycle, &shell.session.save()).map_err(|failure| failure.sentence())?;
    out.push_str(&format!("{file} has the machine at cycle {cycle}\n"));
    Ok(())
}

/// `load`.
pub(super) fn load(shell: &mut Shell, args: &str, out: &mut String) -> Done {
    let file = named(args)?;
    shell.session.bare()?;
    let sentence = |failure: Failure| failure.sentence();
    let refused = |fault| sentence(Failure::Refused(vec![fault], Texts::default()));
    let bytes = input::bytes(file).map_err(sentence)?;
    let (cycle, state) = snapshot::read_for(file, &bytes, &shell.shelf.head).map_err(refused)?;
    shell.session.load(state, cycle).map_err(|_| refused(snapshot::no_state(file)))?;
    shell.loaded = Some((file.to_owned(), cycle));
    shell.begun(out);
    Ok(())
}

/// The file that a command names; standard input and output are the user's.
fn named(args: &str) -> Result<&str, String> {
    match args {
        "" => Err("the name of a file is missing".to_owned()),
        "-" => Err("write the name of a file; - is none here".to_owned()),
        file => Ok(file),
    }
}

pub(super) fn quit(shell: &mut Shell, args: &str, _: &mut String) -> Done {
    let code = if args.is_empty() { i64::from(shell.code()) } else { shell.value(args)? };
    shell.leave = Some(u8::try_from(code).map_err(|_| format!("{code} is no exit code; those are 0 to 255"))?);
    Ok(())
}
