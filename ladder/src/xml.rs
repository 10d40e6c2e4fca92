//! Reads XML as a tree whose nodes have positions. Size and depth are limited.

use diag::{Diagnostic, Pos, Severity};
use quick_xml::escape::resolve_predefined_entity;
use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, XmlVersion};

use crate::codes;

/// Greatest depth of elements.
const MAX_DEPTH: usize = 64;
/// Largest number of elements.
const MAX_ELEMENTS: usize = 200_000;

/// An element.
#[derive(Debug, Clone, Default)]
pub(crate) struct XmlElement {
    /// Name without the prefix of its namespace.
    pub name: String,
    /// Attributes without prefixes, in file order.
    pub attributes: Vec<(String, String)>,
    /// Elements inside.
    pub children: Vec<XmlElement>,
    /// Text inside, without that of elements inside.
    pub text: String,
    /// Position of the `<`.
    pub pos: Pos,
    /// Position of the first character behind the start tag.
    pub text_pos: Pos,
}

impl XmlElement {
    /// Returns the value of an attribute.
    pub fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(known, _)| known == name).map(|(_, value)| value.as_str())
    }

    /// Whether an attribute is `true`.
    pub fn is_true(&self, name: &str) -> bool {
        self.attribute(name).is_some_and(|value| matches!(value, "true" | "1"))
    }

    /// Returns the first element inside with this name.
    pub fn child(&self, name: &str) -> Option<&XmlElement> {
        self.children.iter().find(|child| child.name == name)
    }

    /// Returns the elements inside with this name.
    pub fn children_named<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a XmlElement> {
        self.children.iter().filter(move |child| child.name == name)
    }

    /// Returns all text inside, also that of elements inside.
    pub fn all_text(&self) -> String {
        self.children.iter().fold(self.text.clone(), |text, child| text + &child.all_text())
    }

    /// Calls `each` for the element and all inside.
    pub fn visit<'a>(&'a self, each: &mut dyn FnMut(&'a XmlElement)) {
        each(self);
        self.children.iter().for_each(|child| child.visit(each));
    }
}

/// Finds lines and columns of byte offsets that rise.
struct Places<'a> {
    text: &'a str,
    offset: usize,
    line: u32,
    column: u32,
}

impl Places<'_> {
    fn pos(&mut self, offset: u64) -> Pos {
        let offset = usize::try_from(offset).unwrap_or(usize::MAX).min(self.text.len());
        while self.offset < offset {
            let Some(next) = self.text.get(self.offset..).and_then(|rest| rest.chars().next()) else { break };
            (self.line, self.column) = if next == '\n' { (self.line + 1, 1) } else { (self.line, self.column + 1) };
            self.offset += next.len_utf8();
        }
        Pos::new(self.line, self.column, 1)
    }
}

/// Reads a document and returns its outermost element.
///
/// # Errors
/// LD043 says what is malformed, and where.
pub(crate) fn read_xml(file: &str, text: &str) -> Result<XmlElement, Diagnostic> {
    let fault = |pos: Pos, cause: String| {
        let hint = "export the file again from its editor";
        Diagnostic::new(Severity::Error, codes::XML, file, pos, cause, hint)
    };
    if text.len() > crate::parse::MAX_BYTES {
        return Err(fault(
            Pos::new(1, 1, 1),
            format!("the file has {} bytes; the limit is {}", text.len(), crate::parse::MAX_BYTES),
        ));
    }
    let text = text.trim_start_matches('\u{feff}');
    let mut places = Places { text, offset: 0, line: 1, column: 1 };
    let mut reader = Reader::from_str(text);
    let mut open: Vec<XmlElement> = Vec::new();
    let mut count = 0_usize;
    let damaged = |pos| move |why: quick_xml::Error| fault(pos, format!("an attribute is damaged: {why}"));
    loop {
        let begin = reader.buffer_position();
        let event = reader.read_event();
        let pos = places.pos(begin);
        let event =
            event.map_err(|why| fault(places.pos(reader.error_position()), format!("the XML is damaged: {why}")))?;
        let mut closed = None;
        match event {
            Event::Start(start) => {
                count += 1;
                let mut element = element_of(&start, pos).map_err(damaged(pos))?;
                element.text_pos = places.pos(reader.buffer_position());
                if open.len() >= MAX_DEPTH || count > MAX_ELEMENTS {
                    let cause = format!(
                        "the file has more than {MAX_ELEMENTS} elements, or more than {MAX_DEPTH} inside one another"
                    );
                    return Err(fault(pos, cause));
                }
                open.push(element);
            }
            Event::Empty(start) => {
                count += 1;
                if count > MAX_ELEMENTS {
                    return Err(fault(pos, format!("the file has more than {MAX_ELEMENTS} elements")));
                }
                closed = Some(element_of(&start, pos).map_err(damaged(pos))?);
            }
            Event::End(_) => closed = open.pop(),
            Event::Text(part) => add_text(&mut open, &part.decode().map_err(|why| fault(pos, why.to_string()))?),
            Event::CData(part) => add_text(&mut open, &part.decode().map_err(|why| fault(pos, why.to_string()))?),
            Event::GeneralRef(part) => {
                let character = part.resolve_char_ref().map_err(|why| fault(pos, why.to_string()))?;
                let name = part.decode().map_err(|why| fault(pos, why.to_string()))?;
                match (character, resolve_predefined_entity(&name)) {
                    (Some(character), _) => add_text(&mut open, character.encode_utf8(&mut [0; 4])),
                    (None, Some(value)) => add_text(&mut open, value),
                    (None, None) => return Err(fault(pos, format!("the entity `&{name};` is not defined"))),
                }
            }
            Event::Comment(_) | Event::Decl(_) | Event::PI(_) | Event::DocType(_) => {}
            Event::Eof => {
                let cause = open
                    .last()
                    .map_or("the file has no element".to_owned(), |last| format!("`<{}>` is not closed", last.name));
                return Err(fault(open.last().map_or(pos, |last| last.pos), cause));
            }
        }
        if let Some(element) = closed {
            match open.last_mut() {
                Some(outer) => outer.children.push(element),
                None => return Ok(element),
            }
        }
    }
}

fn add_text(open: &mut [XmlElement], text: &str) {
    if let Some(element) = open.last_mut() {
        element.text.push_str(text);
    }
}

fn element_of(start: &BytesStart<'_>, pos: Pos) -> Result<XmlElement, quick_xml::Error> {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let mut element =
        XmlElement { name: text(start.local_name().as_ref()), pos, text_pos: pos, ..XmlElement::default() };
    for attribute in start.attributes() {
        let attribute = attribute?;
        let value = attribute.normalized_value(XmlVersion::Implicit1_0)?;
        element.attributes.push((text(attribute.key.local_name().as_ref()), value.into_owned()));
    }
    Ok(element)
}
