//! The engine: reads the source again until no name changes its value.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::ops::Range;
use std::rc::Rc;
use std::sync::Arc;

use diag::text::{byte_of, to_display_text};
use diag::{Diagnostic, Pos, Severity, nearest};
use emu_core::chip::Chip;

use crate::NamedText;
use crate::chip_names::ChipNames;
use crate::dialect::AsmDialect;
use crate::expression::{evaluate, evaluate_front};
use crate::fault::LineFault;
use crate::files::{IncludeFiles, SourceTexts};
use crate::form_table::FormTable;
use crate::lines::{AsmLine, BACKSLASH, trim};
use crate::output::PassOutput;
use crate::reader::{AsmMacro, OpenCondition, TextFrame};
use crate::statement::code_end;
use crate::symbols::{AsmSymbolKind, AsmSymbols, LineNumber};
use crate::value::AsmValue;

/// Passes without progress after which names that still change are an error; in a chain of names, each may
/// have to wait for the next.
const MAX_UNSETTLED_PASSES: u32 = 20;
/// The maximum number of passes, for any number of names.
const MAX_PASSES: u32 = 1000;
/// The maximum number of reported errors, and of reported warnings and notes.
pub(crate) const MAX_REPORTED: usize = 100;

/// One use of a directive: the line without its comment, and the positions of its parts.
pub(crate) struct DirectiveCall<'t> {
    /// The line.
    pub text: &'t str,
    /// The name before it, for directives that define one.
    pub label: Option<Range<usize>>,
    /// The directive.
    pub word: Range<usize>,
    /// The text after it.
    pub rest: Range<usize>,
}

impl<'t> DirectiveCall<'t> {
    /// Returns the text of a part.
    pub fn get(&self, range: Range<usize>) -> &'t str {
        self.text.get(range).unwrap_or_default()
    }
}

/// The state of the assembler.
pub(crate) struct Assembler<'a> {
    pub chip: &'static Chip,
    pub dialect: &'static AsmDialect,
    pub table: Arc<FormTable>,
    pub chip_names: Arc<ChipNames>,
    /// Finds other chips by name.
    pub find_chip: Option<fn(&str) -> Option<&'static Chip>>,
    /// Undefined names belong to other modules.
    pub undefined_global: bool,
    pub files: &'a mut dyn IncludeFiles,
    pub texts: SourceTexts,
    /// Number of a text, by the name in the include and the file that includes it.
    pub opened_includes: HashMap<(String, u32), OpenedInclude>,
    /// Binary files, by the same key.
    pub binaries: HashMap<(String, u32), Rc<[u8]>>,
    /// Names and texts defined by the caller.
    pub given_defines: Vec<NamedText>,
    pub symbols: AsmSymbols,
    pub pass: u32,
    /// Lines read in all passes.
    pub lines_read: u64,
    /// Undefined names of the expression that is being read.
    pub undefined: Vec<LineFault>,
    /// A name was read in this pass before its definition.
    pub has_forward_reference: bool,
    /// Chip names that were read in this pass, in lower case if case does not matter.
    pub chip_names_read: BTreeSet<String>,
    /// The program defined one of them after that.
    pub chip_name_redefined: bool,
    pub line: Option<AsmLine>,
    pub frames: Vec<TextFrame>,
    pub conditions: Vec<OpenCondition>,
    pub macros: HashMap<String, Rc<AsmMacro>>,
    pub defines: HashMap<String, Rc<crate::macros::TextDefine>>,
    /// Macros called so far, for unique names.
    pub macro_calls: u32,
    pub radix: u32,
    pub ended: bool,
    /// Number of named labels so far; `12$` is known between two of them.
    pub dollar_label_scope: u32,
    /// How often each numbered label was defined in this pass.
    pub numbered: HashMap<String, u32>,
    /// Length of the instruction whose operands are being read, in addresses, for dialects that count from
    /// its end.
    pub instruction_length: i64,
    /// The last instruction was at an odd address.
    pub at_odd_address: bool,
    /// The address of the line.
    pub line_address: i64,
    /// A value that determines an address could not be read in this pass.
    pub address_unknown: bool,
    pub out: PassOutput,
    faults: Vec<(Diagnostic, Option<String>)>,
    /// Number of errors in `faults`.
    errors: usize,
    /// Errors beyond [`MAX_REPORTED`].
    unreported_errors: usize,
    /// Warnings and notes beyond it.
    unreported_remarks: usize,
    /// Remarks about the instruction that is being matched.
    pub notes: Vec<LineFault>,
    /// Names that the source declares as external.
    pub externs: BTreeSet<String>,
    /// Codes of warnings and notes that the source suppresses.
    pub suppressed_codes: BTreeSet<&'static str>,
    /// Severities that the source suppresses: 1 notes, 2 warnings too.
    pub suppressed_below: u32,
    /// The state of each family during a pass.
    pub family_state: crate::dialect::FamilyState,
    /// Names of other modules, with the line and position that first read each.
    pub externals: BTreeMap<String, (Option<AsmLine>, Range<usize>)>,
}

/// The result of opening an include file.
#[derive(Clone)]
pub(crate) enum OpenedInclude {
    /// The number of its text.
    Text(u32),
    /// It cannot be read.
    Unreadable {
        /// The cause, as the diagnostic states it.
        cause: String,
    },
}

impl<'a> Assembler<'a> {
    /// Returns an assembler for a chip, before it reads anything.
    pub fn new(chip: &'static Chip, given: Vec<NamedText>, files: &'a mut dyn IncludeFiles) -> Assembler<'a> {
        let d = AsmDialect::of(chip);
        Assembler {
            chip,
            dialect: d,
            table: FormTable::of(chip.isa),
            chip_names: ChipNames::of(chip),
            find_chip: None,
            undefined_global: false,
            files,
            texts: SourceTexts::default(),
            opened_includes: HashMap::new(),
            binaries: HashMap::new(),
            given_defines: given,
            symbols: AsmSymbols::default(),
            pass: 1,
            lines_read: 0,
            undefined: Vec::new(),
            has_forward_reference: false,
            chip_names_read: BTreeSet::new(),
            chip_name_redefined: false,
            line: None,
            frames: Vec::new(),
            conditions: Vec::new(),
            macros: HashMap::new(),
            defines: HashMap::new(),
            macro_calls: 0,
            radix: d.radix,
            ended: false,
            dollar_label_scope: 0,
            numbered: HashMap::new(),
            instruction_length: 0,
            line_address: 0,
            at_odd_address: false,
            address_unknown: false,
            out: PassOutput::new(chip, d),
            faults: Vec::new(),
            errors: 0,
            unreported_errors: 0,
            unreported_remarks: 0,
            notes: Vec::new(),
            externs: BTreeSet::new(),
            suppressed_codes: BTreeSet::new(),
            suppressed_below: 0,
            family_state: crate::dialect::FamilyState::default(),
            externals: BTreeMap::new(),
        }
    }

    /// Reads text 0 until no value changes.
    pub fn run_passes(&mut self) {
        // The lowest number of unsettled names, and the pass that reached it.
        let (mut least, mut since) = (usize::MAX, 0);
        loop {
            self.begin_pass();
            self.read_file(0);
            (self.dialect.finish_pass)(self);
            let placed_anew = (self.dialect.hooks.place_sections)(self);
            self.report_externals();
            let moving = self.symbols.end_pass(self.pass);
            // Names that were read before their definition have changed, or had no value when they were read.
            let again = self.out.place_behind_each_other()
                || placed_anew
                || self.chip_name_redefined
                || if self.pass == 1 { self.has_forward_reference } else { !moving.is_empty() };
            if !again || self.is_stopped() {
                break;
            }
            let all = self.symbols.all();
            let unknown =
                all.iter().filter(|(name, symbol)| symbol.value.is_unknown && moving.binary_search(name).is_err());
            let open = moving.len() + unknown.count();
            if open < least {
                (least, since) = (open, self.pass);
            }
            if self.pass >= (since + MAX_UNSETTLED_PASSES).min(MAX_PASSES) || self.is_near_line_limit() {
                let names: Vec<String> = moving.iter().take(5).map(|name| format!("`{name}`")).collect();
                let cause = format!("after {} passes {} still changes with every pass", self.pass, names.join(", "));
                let hint = "the place of something hangs on a name whose value hangs on that place";
                self.report_unsettled(moving.first(), cause, hint);
                break;
            }
            self.pass += 1;
        }
        let unknown =
            self.symbols.all().into_iter().find(|(_, symbol)| symbol.value.is_unknown).map(|(name, _)| name.clone());
        if let Some(name) = unknown.filter(|_| self.error_count() == 0) {
            let cause = format!("the value of `{}` hangs on itself", name.split('\u{1}').next().unwrap_or_default());
            self.report_unsettled(Some(&name), cause, "give one of the names that hang on each other a plain number");
        }
        let fault_count = self.faults.len();
        self.place();
        if self.address_unknown {
            // Addresses are not known, so faults that depend on them are not reported.
            let mut index = 0;
            self.faults.retain(|(fault, _)| {
                index += 1;
                index <= fault_count || !matches!(fault.code, "ASM019" | "ASM020")
            });
        }
    }

    /// Reports values that do not settle, at the definition of a name.
    fn report_unsettled(&mut self, name: Option<&Rc<str>>, cause: String, hint: &str) {
        let place = name.and_then(|name| self.symbols.get(name, false)).map(|symbol| symbol.place);
        self.line = place.and_then(|at| self.texts.lines(at.file).get((at.number as usize).checked_sub(1)?).cloned());
        let text = self.line.as_ref().map_or("", |line| &line.text);
        let whole = trim(text, 0..code_end(self.dialect, text));
        self.report(LineFault::new("ASM018", whole, cause, hint));
        self.line = None;
    }

    /// Reads text 0 once, from the program word `pc` on, as a pass that knows all names.
    pub fn run_one_line(&mut self, pc: u32) {
        self.pass = 2;
        self.begin_pass();
        let unit = self.out.unit().max(1);
        self.out.set_address(i64::from(pc) * i64::from(self.chip.word_bytes) / i64::from(unit));
        self.read_file(0);
    }

    fn begin_pass(&mut self) {
        self.undefined.clear();
        self.chip_names_read.clear();
        self.chip_name_redefined = false;
        (self.has_forward_reference, self.ended, self.at_odd_address, self.address_unknown) = Default::default();
        (self.macro_calls, self.dollar_label_scope, self.radix, self.unreported_errors, self.unreported_remarks) =
            (0, 0, self.dialect.radix, 0, 0);
        self.line = None;
        self.frames.clear();
        self.conditions.clear();
        self.macros.clear();
        self.numbered.clear();
        self.faults.clear();
        self.errors = 0;
        (self.notes, self.suppressed_codes, self.suppressed_below, self.externs) = Default::default();
        self.family_state = std::mem::take(&mut self.family_state).state_for_next_pass();
        self.chip_names = ChipNames::of(self.chip);
        self.externals.clear();
        self.out.restart();
        self.define_given();
    }

    /// Reports a fault of the line that is being read.
    pub fn report(&mut self, fault: LineFault) {
        let unwanted = match fault.severity {
            Severity::Error => false,
            Severity::Warning => self.suppressed_below >= 2 || self.suppressed_codes.contains(fault.code),
            Severity::Note => self.suppressed_below >= 1 || self.suppressed_codes.contains(fault.code),
        };
        if unwanted {
            return;
        }
        let fault = self.explain_no_break_space(fault);
        let (file, pos) = match &self.line {
            Some(line) => self.texts.pos(line, &fault.range),
            None => (self.texts.name(0).to_owned(), Pos::default()),
        };
        let cause = fault.cause.replace(BACKSLASH, "\\") + &self.macro_call_chain();
        let diagnostic = Diagnostic::new(fault.severity, fault.code, &file, pos, cause, fault.hint);
        // Each repetition of a line (`rept`, `irp`) finds the same fault.
        if self.faults.iter().any(|(stored, _)| *stored == diagnostic) {
            return;
        }
        let is_error = fault.severity == Severity::Error;
        let stored = if is_error { self.errors } else { self.faults.len() - self.errors };
        // A fault that stops the assembler is always reported.
        if stored >= MAX_REPORTED && fault.code != "ASM017" {
            *(if is_error { &mut self.unreported_errors } else { &mut self.unreported_remarks }) += 1;
            return;
        }
        self.errors += usize::from(is_error);
        self.faults.push((diagnostic, fault.misspelt_name));
    }

    /// Replaces a fault of text with a no-break space, which only looks like a blank, by one that says so.
    fn explain_no_break_space(&self, fault: LineFault) -> LineFault {
        let text = self.line.as_ref().and_then(|line| line.text.get(fault.range.clone())).unwrap_or_default();
        let is_it = |c: char| matches!(c, '\u{A0}' | '\u{2007}' | '\u{202F}') || byte_of(c) == Some(0xA0);
        if !matches!(fault.code, "ASM001" | "ASM002" | "ASM005" | "ASM006") || !text.contains(is_it) {
            return fault;
        }
        let cause = format!("`{}` has a no-break space in it, which is not a blank", text.replace(is_it, "\u{2423}"));
        let hint = "put a plain space in its place; web pages and word processors give the other".to_owned();
        LineFault { cause, hint, misspelt_name: None, ..fault }
    }

    /// Returns the number of errors in this pass so far.
    pub fn error_count(&self) -> usize {
        self.errors + self.unreported_errors
    }

    /// Returns the chain of calls: `, in macro a called at main.asm:3`.
    fn macro_call_chain(&self) -> String {
        let calls = self.frames.iter().rev().filter_map(|frame| frame.called_from.as_ref());
        let shown: Vec<String> = calls
            .take(3)
            .map(|(name, file, line)| format!(", in `{name}` called at {}:{line}", self.texts.name(*file)))
            .collect();
        shown.concat()
    }

    /// Returns all diagnostics, with suggestions for misspelt names.
    pub fn take_diagnostics(&mut self) -> Vec<Diagnostic> {
        let mut list = Vec::new();
        for (mut diagnostic, name) in std::mem::take(&mut self.faults) {
            let meant = name.and_then(|name| {
                self.similar_name(&name, diagnostic.code).filter(|meant| !meant.eq_ignore_ascii_case(&name))
            });
            if let Some(meant) = meant {
                diagnostic.hint = format!("did you mean `{}`?", to_display_text(&meant));
            }
            list.push(diagnostic);
        }
        for (count, what) in [(self.unreported_errors, "errors"), (self.unreported_remarks, "warnings and notes")] {
            if count > 0 {
                let cause = format!("{count} more {what} are not shown");
                let (file, hint) = (self.texts.name(0), "fix the first ones");
                list.push(Diagnostic::new(Severity::Note, "ASM029", file, Pos::default(), cause, hint));
            }
        }
        list
    }

    /// Returns a similar name: of an instruction or directive, or of a value.
    fn similar_name(&self, name: &str, code: &str) -> Option<String> {
        let macros = self.macros.values().map(|found| found.name.as_str());
        let own = self.table.mnemonics().chain(self.dialect.names()).map(|name| -> &str { name });
        let words = own.chain(macros);
        if code == "ASM001" {
            return nearest(name.trim_start_matches(['.', '#']), words).map(str::to_owned);
        }
        let values = self.symbols.names().chain(self.chip_names.names()).filter(|name| !name.contains('\u{1}'));
        nearest(name, values).or_else(|| nearest(name, words)).map(str::to_owned)
    }

    /// Reports whether an error stops the assembler, so that nothing more is read.
    pub fn is_stopped(&self) -> bool {
        self.faults.iter().any(|(fault, _)| fault.code == "ASM017")
    }

    /// Evaluates `text[range]`; reports faults.
    pub fn evaluate(&mut self, text: &str, range: Range<usize>) -> Option<AsmValue> {
        let d = self.dialect;
        let found = evaluate(d, text, range, self);
        let missing = std::mem::take(&mut self.undefined);
        missing.into_iter().for_each(|fault| self.report(fault));
        found.map_err(|fault| self.report(fault)).ok()
    }

    /// Evaluates the expression at the start of `text[range]` and returns its end; reports faults.
    pub fn front_value(&mut self, text: &str, range: Range<usize>) -> Option<(AsmValue, usize)> {
        let found = evaluate_front(self.dialect, text, range, self);
        let missing = std::mem::take(&mut self.undefined);
        missing.into_iter().for_each(|fault| self.report(fault));
        found.map_err(|fault| self.report(fault)).ok()
    }

    /// Evaluates a condition of the C preprocessor, in which unknown names are 0.
    pub fn evaluate_c_condition(&mut self, text: &str, range: Range<usize>) -> i64 {
        let found = evaluate(self.dialect, text, range, self);
        self.undefined.clear();
        found.map_err(|fault| self.report(fault)).map_or(0, |value| value.number)
    }

    /// Evaluates `text[range]` if it determines addresses or lines; a value that is not yet known is 0.
    pub fn evaluate_number(&mut self, text: &str, range: Range<usize>) -> Option<i64> {
        self.evaluate(text, range).map(|value| if value.is_unknown { 0 } else { value.number })
    }

    /// Evaluates `text[range]` as the address at which the program continues; `None` if it cannot be read,
    /// and then faults of addresses are not reported.
    pub fn evaluate_address(&mut self, text: &str, range: Range<usize>) -> Option<i64> {
        let found = self.evaluate(text, range).filter(|value| !value.is_unknown);
        self.address_unknown |= found.is_none();
        found.map(|value| value.number)
    }

    /// Defines a name; `at` is its position.
    pub fn define_symbol(&mut self, name: &str, value: AsmValue, kind: AsmSymbolKind, at: Range<usize>) {
        let place = self
            .line
            .as_ref()
            .map_or(LineNumber::default(), |line| LineNumber { file: line.file, number: line.number });
        // From the next pass on, the program's name overrides the chip's.
        self.chip_name_redefined |= self.chip_names_read.contains(self.folded_name(name).as_ref());
        if let Err(LineNumber { file, number }) = self.symbols.define(name, value, kind, self.pass, place) {
            let cause = format!("`{name}` is already given at {}:{number}", self.texts.name(file));
            let hint = "choose another name, or give it with set instead of equ in both places";
            self.report(LineFault::new("ASM007", at, cause, hint));
        }
    }

    /// Returns the name as the key of a chip name: in lower case if the dialect ignores case.
    pub fn folded_name<'n>(&self, name: &'n str) -> Cow<'n, str> {
        if self.dialect.ignores_case { Cow::Owned(name.to_ascii_lowercase()) } else { Cow::Borrowed(name) }
    }

    /// Defines the label `name` at the next address.
    pub fn define_label(&mut self, name: &str, at: Range<usize>) {
        let (space, addr) = self.out.label_place();
        let value = AsmValue { is_label: true, ..AsmValue::of(self.out.next_address()) };
        self.define_symbol(name, value, AsmSymbolKind::Label { space, addr }, at);
    }

    /// Warns of names of other modules, whose value is 0 here.
    fn report_externals(&mut self) {
        for (name, (line, at)) in std::mem::take(&mut self.externals) {
            self.line = line;
            let cause = format!("`{name}` is a name of another module, so its value is 0");
            let hint = "link the modules with their own linker and load the resulting HEX file, or give the name here";
            self.report(LineFault::new("ASM036", at, cause, hint).warning());
        }
        self.line = None;
    }

    /// Returns the byte address in the image file of what comes next.
    pub fn image_address(&self) -> u64 {
        self.out.image_address()
    }
}
