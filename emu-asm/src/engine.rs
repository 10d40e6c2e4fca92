//! The engine: reads the source again and again until no name moves.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::ops::Range;
use std::rc::Rc;
use std::sync::Arc;

use diag::text::{byte_of, show};
use diag::{Diagnostic, Pos, Severity, nearest};
use emu_core::chip::Chip;

use crate::dialect::Dialect;
use crate::expr::{Value, evaluate};
use crate::fault::Fault;
use crate::files::{Files, Texts};
use crate::known::Known;
use crate::output::Output;
use crate::reader::{Cond, Frame, Macro};
use crate::statement::code_end;
use crate::symbols::{Kind, Symbols};
use crate::table::Table;
use crate::text::{BACKSLASH, Line, trim};

/// Passes in which nothing more settles until names that still move are an error; each of a chain of names may wait for the next.
const PASSES: u32 = 20;
/// Passes at most, however many names there are.
const MOST_PASSES: u32 = 1000;
/// Errors that are told, and as many warnings and notes.
pub(crate) const LIMIT: usize = 100;

/// What a directive is given: the line without its comment, and where its parts stand.
pub(crate) struct Call<'t> {
    /// The line.
    pub text: &'t str,
    /// The word in front of it, for directives that are about one.
    pub label: Option<Range<usize>>,
    /// The directive.
    pub word: Range<usize>,
    /// What stands behind it.
    pub rest: Range<usize>,
}

impl<'t> Call<'t> {
    /// The text of a part.
    pub fn get(&self, range: Range<usize>) -> &'t str {
        self.text.get(range).unwrap_or_default()
    }
}

/// The assembler at work.
pub(crate) struct Asm<'a> {
    pub chip: &'static Chip,
    pub d: &'static Dialect,
    pub table: Arc<Table>,
    pub known: Arc<Known>,
    /// Other chips by name.
    pub chip_named: Option<fn(&str) -> Option<&'static Chip>>,
    pub files: &'a mut dyn Files,
    pub texts: Texts,
    /// Number of a text by the name asked for and the file that asked.
    pub opened: HashMap<(String, u32), Result<u32, (String, String)>>,
    /// Names and texts given from outside.
    pub given: Vec<(String, String)>,
    pub symbols: Symbols,
    pub pass: u32,
    /// Lines read in all passes.
    pub lines_read: u64,
    /// Undefined names of the expression that is being read.
    pub undefined: Vec<Fault>,
    /// A name was read in this pass that was not given yet.
    pub forward: bool,
    /// Names that were read in this pass as those of the chip, in lower case where case does not matter.
    pub chips: BTreeSet<String>,
    /// The program gave one of them behind that.
    pub late: bool,
    pub line: Option<Line>,
    pub frames: Vec<Frame>,
    pub conds: Vec<Cond>,
    pub macros: HashMap<String, Rc<Macro>>,
    pub defines: HashMap<String, Rc<crate::macros::Define>>,
    /// Macros called so far, for unique names.
    pub calls: u32,
    pub radix: u32,
    pub ended: bool,
    /// Labels with names so far, between which `12$` is known.
    pub stretch: u32,
    /// How often each numbered label was given in this pass.
    pub numbered: HashMap<String, u32>,
    /// Length of the instruction in the unit of addresses while its operands are read, where the dialect counts from its end.
    pub behind: i64,
    /// The line's word is a directive with a dot.
    pub dotted: bool,
    /// The last instruction stood at an odd address.
    pub odd: bool,
    /// The address of the line.
    pub line_at: i64,
    /// An address that decides where something lies could not be read in this pass.
    pub astray: bool,
    pub out: Output,
    faults: Vec<(Diagnostic, Option<String>)>,
    /// Errors among them.
    errors: usize,
    /// Errors beyond [`LIMIT`].
    more: usize,
    /// Warnings and notes beyond it.
    more_remarks: usize,
    /// Remarks about the instruction that is being matched.
    pub notes: Vec<Fault>,
    /// Names that the source says another module gives.
    pub externs: BTreeSet<String>,
    /// Codes of warnings and notes that the source does not want to be told.
    pub quiet: BTreeSet<&'static str>,
    /// What else it does not want: 1 notes, 2 warnings too.
    pub least: u32,
    /// What a family keeps during a pass.
    pub own: crate::dialect::Own,
    /// Names of other modules, with the line and place that first read each.
    pub externals: BTreeMap<String, (Option<Line>, Range<usize>)>,
}

impl<'a> Asm<'a> {
    /// An assembler for a chip that has read nothing yet.
    pub fn new(chip: &'static Chip, given: Vec<(String, String)>, files: &'a mut dyn Files) -> Asm<'a> {
        let d = Dialect::of(chip);
        Asm {
            chip,
            d,
            table: Table::of(chip.isa),
            known: Known::of(chip),
            chip_named: None,
            files,
            texts: Texts::default(),
            opened: HashMap::new(),
            given,
            symbols: Symbols::default(),
            pass: 1,
            lines_read: 0,
            undefined: Vec::new(),
            forward: false,
            chips: BTreeSet::new(),
            late: false,
            line: None,
            frames: Vec::new(),
            conds: Vec::new(),
            macros: HashMap::new(),
            defines: HashMap::new(),
            calls: 0,
            radix: d.radix,
            ended: false,
            stretch: 0,
            numbered: HashMap::new(),
            behind: 0,
            line_at: 0,
            dotted: false,
            odd: false,
            astray: false,
            out: Output::new(chip, d),
            faults: Vec::new(),
            errors: 0,
            more: 0,
            more_remarks: 0,
            notes: Vec::new(),
            externs: BTreeSet::new(),
            quiet: BTreeSet::new(),
            least: 0,
            own: crate::dialect::Own::default(),
            externals: BTreeMap::new(),
        }
    }

    /// Reads the text number 0 until nothing moves.
    pub fn run(&mut self) {
        // The least number of names that had not settled, and the pass in which it came to that.
        let (mut least, mut since) = (usize::MAX, 0);
        loop {
            self.begin_pass();
            self.read(0);
            (self.d.finish)(self);
            let placed_anew = (self.d.hooks.place)(self);
            self.tell_externals();
            let moving = self.symbols.end(self.pass);
            // Names that were read before they were given have moved, or some had no value at all when they were read.
            let again = self.out.stack()
                || placed_anew
                || self.late
                || if self.pass == 1 { self.forward } else { !moving.is_empty() };
            if !again || self.stopped() {
                break;
            }
            let all = self.symbols.all();
            let unknown =
                all.iter().filter(|(name, symbol)| symbol.value.unknown && moving.binary_search(name).is_err());
            let open = moving.len() + unknown.count();
            if open < least {
                (least, since) = (open, self.pass);
            }
            if self.pass >= (since + PASSES).min(MOST_PASSES) || self.tired() {
                let names: Vec<String> = moving.iter().take(5).map(|name| format!("`{name}`")).collect();
                let cause = format!("after {} passes {} still changes with every pass", self.pass, names.join(", "));
                let hint = "the place of something hangs on a name whose value hangs on that place";
                self.tell_of(moving.first(), cause, hint);
                break;
            }
            self.pass += 1;
        }
        let unknown =
            self.symbols.all().into_iter().find(|(_, symbol)| symbol.value.unknown).map(|(name, _)| name.clone());
        if let Some(name) = unknown.filter(|_| self.errors() == 0) {
            let cause = format!("the value of `{}` hangs on itself", name.split('\u{1}').next().unwrap_or_default());
            self.tell_of(Some(&name), cause, "give one of the names that hang on each other a plain number");
        }
        let told = self.faults.len();
        self.place();
        if self.astray {
            // Where things lie is not known, so what does not fit there is not told.
            let mut index = 0;
            self.faults.retain(|(fault, _)| {
                index += 1;
                index <= told || !matches!(fault.code, "ASM019" | "ASM020")
            });
        }
    }

    /// Tells of values that do not settle, where a name is given.
    fn tell_of(&mut self, name: Option<&Rc<str>>, cause: String, hint: &str) {
        let place = name.and_then(|name| self.symbols.get(name, false)).map(|symbol| symbol.place);
        self.line =
            place.and_then(|(file, number)| self.texts.lines(file).get((number as usize).checked_sub(1)?).cloned());
        let text = self.line.as_ref().map_or("", |line| &line.text);
        let whole = trim(text, 0..code_end(self.d, text));
        self.tell(Fault::new("ASM018", whole, cause, hint));
        self.line = None;
    }

    /// Reads the text number 0 once, from the program word `pc` on, as a pass that knows all names that there are.
    pub fn one_line(&mut self, pc: u32) {
        self.pass = 2;
        self.begin_pass();
        let unit = self.out.unit().max(1);
        self.out.go(i64::from(pc) * i64::from(self.chip.word_bytes) / i64::from(unit));
        self.read(0);
    }

    fn begin_pass(&mut self) {
        self.undefined.clear();
        self.chips.clear();
        self.late = false;
        (self.forward, self.ended, self.odd, self.astray) = Default::default();
        (self.calls, self.stretch, self.radix, self.more, self.more_remarks) = (0, 0, self.d.radix, 0, 0);
        self.line = None;
        self.frames.clear();
        self.conds.clear();
        self.macros.clear();
        self.numbered.clear();
        self.faults.clear();
        self.errors = 0;
        (self.notes, self.quiet, self.least, self.externs) = Default::default();
        self.own = std::mem::take(&mut self.own).next();
        self.known = Known::of(self.chip);
        self.externals.clear();
        self.out.restart();
        self.define_given();
    }

    /// Tells a complaint about the line that is being read.
    pub fn tell(&mut self, fault: Fault) {
        let unwanted = match fault.severity {
            Severity::Error => false,
            Severity::Warning => self.least >= 2 || self.quiet.contains(fault.code),
            Severity::Note => self.least >= 1 || self.quiet.contains(fault.code),
        };
        if unwanted {
            return;
        }
        let fault = self.with_spaces(fault);
        let is_error = fault.severity == Severity::Error;
        let stored = if is_error { self.errors } else { self.faults.len() - self.errors };
        // What stops everything is told in any case.
        if stored >= LIMIT && fault.code != "ASM017" {
            *(if is_error { &mut self.more } else { &mut self.more_remarks }) += 1;
            return;
        }
        self.errors += usize::from(is_error);
        let (file, pos) = match &self.line {
            Some(line) => self.texts.pos(line, &fault.at),
            None => (self.texts.name(0).to_owned(), Pos::default()),
        };
        let cause = fault.cause.replace(BACKSLASH, "\\") + &self.chain();
        self.faults.push((Diagnostic::new(fault.severity, fault.code, &file, pos, cause, fault.hint), fault.name));
    }

    /// What is wrong with a piece of the line that holds a no-break space, which looks like a blank and is none: that.
    fn with_spaces(&self, fault: Fault) -> Fault {
        let text = self.line.as_ref().and_then(|line| line.text.get(fault.at.clone())).unwrap_or_default();
        let is_it = |c: char| matches!(c, '\u{A0}' | '\u{2007}' | '\u{202F}') || byte_of(c) == Some(0xA0);
        if !matches!(fault.code, "ASM001" | "ASM002" | "ASM005" | "ASM006") || !text.contains(is_it) {
            return fault;
        }
        let cause = format!("`{}` has a no-break space in it, which is no blank", text.replace(is_it, "\u{2423}"));
        let hint = "put a plain space in its place; web pages and word processors give the other".to_owned();
        Fault { cause, hint, name: None, ..fault }
    }

    /// Errors told so far in this pass.
    pub fn errors(&self) -> usize {
        self.errors + self.more
    }

    /// `, in macro a called at main.asm:3`.
    fn chain(&self) -> String {
        let calls = self.frames.iter().rev().filter_map(|frame| frame.called.as_ref());
        let shown: Vec<String> = calls
            .take(3)
            .map(|(name, file, line)| format!(", in `{name}` called at {}:{line}", self.texts.name(*file)))
            .collect();
        shown.concat()
    }

    /// All complaints, with names that were perhaps meant.
    pub fn faults(&mut self) -> Vec<Diagnostic> {
        let mut list = Vec::new();
        for (mut diagnostic, name) in std::mem::take(&mut self.faults) {
            if let Some(meant) = name.and_then(|name| self.meant(&name, diagnostic.code)) {
                diagnostic.hint = format!("did you mean `{}`?", show(&meant));
            }
            list.push(diagnostic);
        }
        for (count, what) in [(self.more, "errors"), (self.more_remarks, "warnings and notes")] {
            if count > 0 {
                let cause = format!("{count} more {what} are not shown");
                let (file, hint) = (self.texts.name(0), "mend the first ones");
                list.push(Diagnostic::new(Severity::Note, "ASM029", file, Pos::default(), cause, hint));
            }
        }
        list
    }

    /// The name that was perhaps meant: of an instruction or directive, or of a value.
    fn meant(&self, name: &str, code: &str) -> Option<String> {
        let macros = self.macros.values().map(|found| found.name.as_str());
        let own = self.table.mnemonics().chain(self.d.names()).map(|name| -> &str { name });
        let words = own.chain(macros);
        if code == "ASM001" {
            return nearest(name.trim_start_matches(['.', '#']), words).map(str::to_owned);
        }
        let values = self.symbols.names().chain(self.known.names()).filter(|name| !name.contains('\u{1}'));
        nearest(name, values).or_else(|| nearest(name, words)).map(str::to_owned)
    }

    /// True where an error stops everything: names are not read on.
    pub fn stopped(&self) -> bool {
        self.faults.iter().any(|(fault, _)| fault.code == "ASM017")
    }

    /// The value of `text[range]`; complaints are told.
    pub fn value(&mut self, text: &str, range: Range<usize>) -> Option<Value> {
        let d = self.d;
        let found = evaluate(d, text, range, self);
        let missing = std::mem::take(&mut self.undefined);
        missing.into_iter().for_each(|fault| self.tell(fault));
        found.map_err(|fault| self.tell(fault)).ok()
    }

    /// The value of a condition of C's preprocessor, where names without a value are 0.
    pub fn c_value(&mut self, text: &str, range: Range<usize>) -> i64 {
        let found = evaluate(self.d, text, range, self);
        self.undefined.clear();
        found.map_err(|fault| self.tell(fault)).map_or(0, |value| value.n)
    }

    /// The value of `text[range]` where it decides about addresses or lines: 0 while it is not known.
    pub fn number(&mut self, text: &str, range: Range<usize>) -> Option<i64> {
        self.value(text, range).map(|value| if value.unknown { 0 } else { value.n })
    }

    /// The address of `text[range]`, at which the program goes on; none, and nothing that lies wrong is told, where it cannot be read.
    pub fn place_of(&mut self, text: &str, range: Range<usize>) -> Option<i64> {
        let found = self.value(text, range).filter(|value| !value.unknown);
        self.astray |= found.is_none();
        found.map(|value| value.n)
    }

    /// Gives a name a value; `at` is where the name stands.
    pub fn define(&mut self, name: &str, value: Value, kind: Kind, at: Range<usize>) {
        let place = self.line.as_ref().map_or((0, 0), |line| (line.file, line.number));
        // From the next pass on the program's own goes before the chip's.
        self.late |= self.chips.contains(self.as_read(name).as_ref());
        if let Err((file, line)) = self.symbols.define(name, value, kind, self.pass, place) {
            let cause = format!("`{name}` is already given at {}:{line}", self.texts.name(file));
            let hint = "choose another name, or give it with set instead of equ in both places";
            self.tell(Fault::new("ASM007", at, cause, hint));
        }
    }

    /// The name as `chips` has it.
    pub fn as_read<'n>(&self, name: &'n str) -> Cow<'n, str> {
        if self.d.any_case { Cow::Owned(name.to_ascii_lowercase()) } else { Cow::Borrowed(name) }
    }

    /// Gives the label `name` the address that comes next.
    pub fn label(&mut self, name: &str, at: Range<usize>) {
        let (space, addr) = self.out.label_place();
        let value = Value { label: true, ..Value::of(self.out.here()) };
        self.define(name, value, Kind::Label { space, addr }, at);
    }

    /// Tells of names of other modules, which stand for 0 here.
    fn tell_externals(&mut self) {
        for (name, (line, at)) in std::mem::take(&mut self.externals) {
            self.line = line;
            let cause = format!("`{name}` is a name of another module: 0 stands for it");
            let hint =
                "link the modules with their own linker and load the HEX file that comes of it, or give the name here";
            self.tell(Fault::new("ASM036", at, cause, hint).warning());
        }
        self.line = None;
    }

    /// Byte address in the image file of what comes next.
    pub fn image_address(&self) -> u64 {
        self.out.image_address()
    }
}
