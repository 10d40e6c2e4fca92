//! Types out of the texts of stabs: `(0,4)=ar(0,1);0;7;(0,2)` is an array of eight.
//!
//! A type is called by a number within a header file of its unit. A header that several units include is
//! written once: the linker leaves of the others where it is among their headers. A number may be used before
//! it is defined.

mod bounds;
mod fields;

use std::collections::{BTreeMap, HashMap};

use super::MAX_NAME;
use crate::image::debug_info::{BaseEncoding, CType, TypeId};
use bounds::{builtin, range_type};

/// Bytes of a pointer, and of an `enum` without a size.
const POINTER_BYTES: u32 = 2;
/// Deepest nesting of types in a text.
const MAX_DEPTH: u32 = 64;
/// Most dimensions of an array.
const MAX_DIMENSIONS: usize = 16;

/// A text and how far it was read.
#[derive(Debug, Clone)]
pub(super) struct TypeText<'b> {
    rest: &'b [u8],
    depth: u32,
}

impl<'b> TypeText<'b> {
    pub fn new(rest: &'b [u8]) -> TypeText<'b> {
        TypeText { rest, depth: 0 }
    }

    fn peek(&self) -> Option<u8> {
        self.rest.first().copied()
    }

    fn take(&mut self) -> Option<u8> {
        let (first, rest) = self.rest.split_first()?;
        self.rest = rest;
        Some(*first)
    }

    /// Skips a character, if it comes next.
    pub fn skip(&mut self, wanted: u8) -> bool {
        let is = self.peek() == Some(wanted);
        if is {
            _ = self.take();
        }
        is
    }

    fn expect(&mut self, wanted: u8) -> Option<()> {
        self.skip(wanted).then_some(())
    }

    /// What is before a character, which is skipped.
    fn until(&mut self, end: u8) -> Option<&'b [u8]> {
        let at = self.rest.iter().position(|byte| *byte == end)?;
        let (before, rest) = (self.rest.get(..at)?, self.rest.get(at + 1..)?);
        self.rest = rest;
        Some(before)
    }

    /// What is before the next colon that belongs to no `::`.
    fn name(&mut self) -> Option<String> {
        let text = super::split_name(self.rest)?;
        self.rest = text.description;
        Some(readable(text.name))
    }

    fn number(&mut self) -> Option<i64> {
        let digits = self.rest.iter().skip(usize::from(self.peek() == Some(b'-')));
        let count = digits.take_while(|byte| byte.is_ascii_digit()).count() + usize::from(self.peek() == Some(b'-'));
        let (digits, rest) = (self.rest.get(..count)?, self.rest.get(count..)?);
        self.rest = rest;
        std::str::from_utf8(digits).ok()?.parse().ok()
    }

    fn is_number(&self) -> bool {
        self.peek().is_some_and(|byte| byte.is_ascii_digit() || byte == b'-')
    }

    /// What a symbol is: a letter; nothing where its type comes at once.
    pub fn letter(&mut self) -> Option<u8> {
        if self.peek()? == b'(' || self.is_number() { None } else { self.take() }
    }
}

fn readable(bytes: &[u8]) -> String {
    let bytes = bytes.get(..bytes.len().min(MAX_NAME)).unwrap_or_default();
    diag::text::printable(&String::from_utf8_lossy(bytes)).into()
}

/// What the type that a text defines is called.
#[derive(Debug, Clone, Copy)]
pub(super) enum TypeNaming<'a> {
    /// It has no name, or its own.
    None,
    /// The name of a base type or a `typedef`.
    Typedef(&'a str),
    /// The tag of a struct, union or enum.
    Tag(&'a str),
}

/// What the text of a type defines.
enum Definition {
    /// Another one by a name.
    Alias(Option<TypeId>),
    Type(CType),
}

/// The number of a type.
#[derive(Clone, Copy)]
struct TypeNumber {
    /// Header file of the unit.
    file: i64,
    /// Number in it.
    within: i64,
}

/// All types.
pub(super) struct StabTypes {
    types: BTreeMap<usize, CType>,
    next: usize,
    /// Types by number, of every header of the program; nothing is `void`.
    headers: Vec<HashMap<i64, Option<TypeId>>>,
    /// Headers by name and sum of their content.
    known: HashMap<(Vec<u8>, u32), usize>,
    /// Those of the unit, its main file first.
    unit: Vec<usize>,
    /// Structs, unions and enums that are defined elsewhere.
    references: Vec<(TypeId, &'static str, String)>,
    /// Types that are others.
    same: HashMap<usize, Option<TypeId>>,
}

/// The value of a constant in a stab.
#[derive(Debug, Clone)]
pub struct StabConstant {
    /// The value, lowest byte first.
    pub bytes: Vec<u8>,
    /// The type, if the stab names one.
    pub type_id: Option<TypeId>,
}

/// The types of all stabs of a file.
#[derive(Debug, Clone)]
pub struct FinishedTypes {
    /// The types by their numbers.
    pub types: BTreeMap<usize, CType>,
    /// The numbers of types that are other types, with the numbers of those.
    pub same: HashMap<usize, usize>,
}

impl StabTypes {
    pub fn new(first: usize) -> StabTypes {
        StabTypes {
            types: BTreeMap::new(),
            next: first,
            headers: Vec::new(),
            known: HashMap::new(),
            unit: Vec::new(),
            references: Vec::new(),
            same: HashMap::new(),
        }
    }

    pub fn begin_unit(&mut self) {
        self.unit = vec![self.headers.len()];
        self.headers.push(HashMap::new());
    }

    /// A header begins whose types are defined here.
    pub fn begin_header(&mut self, name: &[u8], sum: u32) {
        let at = self.headers.len();
        self.headers.push(HashMap::new());
        self.unit.push(at);
        self.known.insert((name.to_vec(), sum), at);
    }

    /// A header whose types another unit has defined.
    pub fn excluded_header(&mut self, name: &[u8], sum: u32) {
        match self.known.get(&(name.to_vec(), sum)) {
            Some(at) => self.unit.push(*at),
            None => self.begin_header(name, sum),
        }
    }

    /// A type that is no other.
    pub fn fresh(&mut self) -> TypeId {
        self.next += 1;
        TypeId(self.next - 1)
    }

    fn add(&mut self, kind: CType) -> TypeId {
        let id = self.fresh();
        self.types.insert(id.0, kind);
        id
    }

    fn header(&mut self, file: i64) -> Option<&mut HashMap<i64, Option<TypeId>>> {
        self.headers.get_mut(*self.unit.get(usize::try_from(file).ok()?)?)
    }

    fn type_number(text: &mut TypeText<'_>) -> Option<TypeNumber> {
        if !text.skip(b'(') {
            return Some(TypeNumber { file: 0, within: text.number()? });
        }
        let file = text.number()?;
        text.expect(b',')?;
        let within = text.number()?;
        text.expect(b')')?;
        Some(TypeNumber { file, within })
    }

    /// The type that a text begins with; within, nothing is `void`.
    ///
    /// Returns nothing where the text is damaged.
    pub fn read(&mut self, text: &mut TypeText<'_>, naming: TypeNaming<'_>) -> Option<Option<TypeId>> {
        text.depth += 1;
        let found = if text.depth > MAX_DEPTH { None } else { self.read_inner(text, naming) };
        text.depth = text.depth.saturating_sub(1);
        found
    }

    fn read_inner(&mut self, text: &mut TypeText<'_>, naming: TypeNaming<'_>) -> Option<Option<TypeId>> {
        if text.peek()? != b'(' && !text.is_number() {
            return match self.definition(text, None)? {
                Definition::Alias(to) => Some(to),
                Definition::Type(kind) => Some(Some(self.add(kind))),
            };
        }
        let number @ TypeNumber { file, within } = Self::type_number(text)?;
        if within < 0 {
            return Some(builtin(within).map(|kind| self.add(kind)));
        }
        let known = self.header(file)?.get(&within).copied();
        if !text.skip(b'=') {
            let of = match known {
                Some(known) => known,
                None => self.forward(number),
            };
            // A second name for a type that has its number already.
            if let TypeNaming::Typedef(name) = naming {
                return Some(Some(self.add(CType::Named { name: name.to_owned(), of })));
            }
            return Some(of);
        }
        let id = known.flatten().filter(|id| !self.types.contains_key(&id.0)).unwrap_or_else(|| self.fresh());
        self.header(file)?.insert(within, Some(id));
        match (self.definition(text, Some(id))?, naming) {
            (Definition::Alias(Some(to)), _) if to == id => {
                self.header(file)?.insert(within, None);
                return Some(None);
            }
            (Definition::Alias(to), TypeNaming::Typedef(name)) => {
                self.types.insert(id.0, CType::Named { name: name.to_owned(), of: to });
            }
            (Definition::Alias(to), _) => {
                self.header(file)?.insert(within, to);
                // Where the number was used already, it means the same.
                self.same.insert(id.0, to);
                return Some(to);
            }
            (Definition::Type(CType::Base { bytes, encoding, .. }), TypeNaming::Typedef(name)) => {
                self.types.insert(id.0, CType::Base { name: name.to_owned(), bytes, encoding });
            }
            (Definition::Type(kind), TypeNaming::Typedef(name)) => {
                let of = Some(self.add(kind));
                self.types.insert(id.0, CType::Named { name: name.to_owned(), of });
            }
            (Definition::Type(mut kind), naming) => {
                if let (TypeNaming::Tag(tag), CType::Record { name, .. } | CType::Enum { name, .. }) =
                    (naming, &mut kind)
                {
                    *name = Some(tag.to_owned()).filter(|tag| !tag.trim().is_empty());
                }
                self.types.insert(id.0, kind);
            }
        }
        Some(Some(id))
    }

    /// A type that is used before its definition.
    fn forward(&mut self, TypeNumber { file, within }: TypeNumber) -> Option<TypeId> {
        let id = self.fresh();
        self.header(file)?.insert(within, Some(id));
        Some(id)
    }

    /// What is behind the equals sign; `own` is the type that it defines.
    fn definition(&mut self, text: &mut TypeText<'_>, own: Option<TypeId>) -> Option<Definition> {
        let mut size = None;
        while text.peek() == Some(b'@') {
            let mut ahead = text.clone();
            _ = ahead.take();
            if ahead.peek() == Some(b'(') || ahead.is_number() {
                break;
            }
            *text = ahead;
            let letter = text.take()?;
            let value = text.until(b';')?;
            if letter == b's' {
                size = std::str::from_utf8(value).ok()?.parse::<u32>().ok().map(|bits| bits.div_ceil(8));
            }
        }
        if text.peek()? == b'(' || text.is_number() {
            let negative = text.peek() == Some(b'-');
            let to = self.read(text, TypeNaming::None)?;
            // A type of the compiler's own, of another size.
            return Some(match self.get(to) {
                Some(CType::Base { name, bytes, encoding }) if negative || size.is_some() => {
                    let (name, encoding, bytes) = (name.clone(), *encoding, size.unwrap_or(*bytes).min(16));
                    Definition::Type(CType::Base { name, bytes, encoding })
                }
                _ => Definition::Alias(to),
            });
        }
        self.described(text, own, size)
    }

    fn described(&mut self, text: &mut TypeText<'_>, own: Option<TypeId>, size: Option<u32>) -> Option<Definition> {
        let mut of = |text: &mut TypeText<'_>| self.read(text, TypeNaming::None);
        let kind = match text.take()? {
            b'*' | b'&' => CType::Pointer { to: of(text)?, bytes: POINTER_BYTES },
            b'@' => {
                of(text)?;
                text.expect(b',')?;
                CType::Pointer { to: of(text)?, bytes: POINTER_BYTES }
            }
            b'k' => CType::Qualified { word: "const", of: of(text)? },
            b'B' => CType::Qualified { word: "volatile", of: of(text)? },
            b'f' => CType::Function { result: of(text)?, parameters: Vec::new(), prototyped: false },
            b'#' => self.method(text)?,
            b'a' => self.array(text)?,
            b'e' => fields::read_enum(text, size)?,
            b's' => self.record(text, "struct")?,
            b'u' => self.record(text, "union")?,
            b'x' => self.reference(text, own)?,
            b'r' => return self.range(text, own, size),
            b'R' => {
                text.until(b';')?;
                let bytes = u32::try_from(text.number()?).ok()?.min(16);
                text.expect(b';')?;
                text.until(b';')?;
                CType::Base { name: String::new(), bytes, encoding: BaseEncoding::Float }
            }
            b'S' => {
                of(text)?;
                CType::Base { name: String::new(), bytes: size.unwrap_or(1).min(16), encoding: BaseEncoding::Unsigned }
            }
            _ => return None,
        };
        Some(Definition::Type(kind))
    }

    /// A method: `##` and what it returns, or `#`, its class, what it returns and its parameters.
    fn method(&mut self, text: &mut TypeText<'_>) -> Option<CType> {
        let short = text.skip(b'#');
        if !short {
            self.read(text, TypeNaming::None)?;
            text.expect(b',')?;
        }
        let result = self.read(text, TypeNaming::None)?;
        let mut parameters = Vec::new();
        while !short && text.skip(b',') {
            parameters.push(self.read(text, TypeNaming::None)?);
        }
        text.expect(b';')?;
        Some(CType::Function { result, parameters, prototyped: true })
    }

    /// An array: the type of its index, the first and the last one, its elements.
    fn array(&mut self, text: &mut TypeText<'_>) -> Option<CType> {
        text.expect(b'r')?;
        self.read(text, TypeNaming::None)?;
        text.expect(b';')?;
        // Bounds that are not known begin with a letter.
        let mut bound = || {
            let known = text.is_number();
            let value = std::str::from_utf8(text.until(b';')?).ok()?.parse::<i64>().ok();
            Some(value.filter(|_| known))
        };
        let (first, last) = (bound()?, bound()?);
        let count =
            first.zip(last).and_then(|(first, last)| u32::try_from(last.checked_sub(first)?.checked_add(1)?).ok());
        let of = self.read(text, TypeNaming::None)?;
        // Arrays of arrays are one of several dimensions.
        match self.get(of) {
            Some(CType::Array { of, counts }) if counts.len() < MAX_DIMENSIONS => {
                let counts = std::iter::once(count).chain(counts.iter().copied()).collect();
                Some(CType::Array { of: *of, counts })
            }
            _ => Some(CType::Array { of, counts: vec![count] }),
        }
    }

    fn range(&mut self, text: &mut TypeText<'_>, own: Option<TypeId>, size: Option<u32>) -> Option<Definition> {
        let of = self.read(text, TypeNaming::None)?;
        text.expect(b';')?;
        let (low, high) = (text.until(b';')?, text.until(b';')?);
        let of_itself = own.is_some() && of == own;
        Some(match range_type(low, high, size, of_itself) {
            Some(kind) => Definition::Type(kind),
            None => Definition::Alias(of.filter(|_| !of_itself)),
        })
    }

    /// A struct, union or enum by its tag, which is defined elsewhere.
    fn reference(&mut self, text: &mut TypeText<'_>, own: Option<TypeId>) -> Option<CType> {
        let keyword = match text.take()? {
            b's' => "struct",
            b'u' => "union",
            b'e' => "enum",
            _ => return None,
        };
        let name = text.name()?;
        if let Some(own) = own {
            self.references.push((own, keyword, name.clone()));
        }
        Some(match keyword {
            "enum" => CType::Enum { name: Some(name), bytes: POINTER_BYTES, values: Vec::new() },
            _ => CType::Record { keyword, name: Some(name), bytes: 0, members: Vec::new() },
        })
    }

    /// A constant: its bytes and its type.
    pub fn constant(&mut self, text: &mut TypeText<'_>) -> Option<StabConstant> {
        text.expect(b'=')?;
        match text.take()? {
            b'i' => {
                let kind = CType::Base { name: "int".to_owned(), bytes: POINTER_BYTES, encoding: BaseEncoding::Signed };
                Some(StabConstant { bytes: text.number()?.to_le_bytes().to_vec(), type_id: Some(self.add(kind)) })
            }
            b'e' => {
                let of = self.read(text, TypeNaming::None)?;
                text.expect(b',')?;
                Some(StabConstant { bytes: text.number()?.to_le_bytes().to_vec(), type_id: of })
            }
            _ => None,
        }
    }

    /// A type that was already defined.
    fn get(&self, id: Option<TypeId>) -> Option<&CType> {
        let mut at = id?;
        // A damaged file may have types that go round in circles.
        for _ in 0..MAX_DEPTH {
            match self.same.get(&at.0) {
                Some(of) => at = (*of)?,
                None => break,
            }
        }
        self.types.get(&at.0)
    }

    /// All types, and those that are others of them. A type with a definition elsewhere is the first of its
    /// tag that has members.
    pub fn finish(mut self) -> FinishedTypes {
        let mut tags: HashMap<(&str, &str), usize> = HashMap::new();
        for (id, kind) in &self.types {
            let tag = match kind {
                CType::Record { keyword, name: Some(name), members, .. } if !members.is_empty() => (*keyword, name),
                CType::Enum { name: Some(name), values, .. } if !values.is_empty() => ("enum", name),
                _ => continue,
            };
            tags.entry((tag.0, tag.1)).or_insert(*id);
        }
        for (id, keyword, name) in &self.references {
            if let Some(of) = tags.get(&(*keyword, name.as_str())).filter(|of| **of != id.0) {
                self.same.insert(id.0, Some(TypeId(*of)));
            }
        }
        let end = |id: usize| {
            let mut at = Some(TypeId(id));
            for _ in 0..MAX_DEPTH {
                match at.and_then(|at| self.same.get(&at.0)) {
                    Some(of) => at = *of,
                    None => break,
                }
            }
            at.map_or(usize::MAX, |at| at.0)
        };
        let same = self.same.keys().map(|id| (*id, end(*id))).collect();
        FinishedTypes { types: self.types, same }
    }
}
