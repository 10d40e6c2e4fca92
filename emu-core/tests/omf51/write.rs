//! A writer of absolute object files, made from Intel's specification (V5.0, appendix 3) alone.

/// Makes a record: type, length of the rest, contents, check sum.
#[must_use]
pub fn record(kind: u8, contents: &[u8]) -> Vec<u8> {
    let mut bytes = vec![kind];
    bytes.extend((contents.len() as u16 + 1).to_le_bytes());
    bytes.extend(contents);
    bytes.push(0u8.wrapping_sub(bytes.iter().fold(0, |sum, byte| sum.wrapping_add(*byte))));
    bytes
}

/// Corrects the check sums of all records, as far as the bytes can be split into records.
#[must_use]
pub fn right(bytes: &[u8]) -> Vec<u8> {
    let (mut out, mut rest) = (Vec::new(), bytes);
    while let [kind, low, high, after @ ..] = rest {
        let length = usize::from(u16::from_le_bytes([*low, *high]));
        if length == 0 || length > after.len() {
            break;
        }
        out.extend(record(*kind, &after[..length - 1]));
        rest = &after[length..];
    }
    out.extend(rest);
    out
}

/// A name with its address.
pub struct Item {
    info: u8,
    offset: u16,
    name: &'static str,
}

impl Item {
    /// Makes an item from its info byte, offset and name.
    #[must_use]
    pub fn new(info: u8, offset: u16, name: &'static str) -> Item {
        Item { info, offset, name }
    }

    /// The bytes of the item, with `between` bytes between offset and name.
    fn bytes(&self, between: usize) -> Vec<u8> {
        let [low, high] = self.offset.to_le_bytes();
        let mut bytes = vec![0, self.info, low, high];
        bytes.extend(std::iter::repeat_n(0, between));
        bytes.extend(counted(self.name));
        bytes
    }
}

fn counted(name: &str) -> Vec<u8> {
    let mut bytes = vec![name.len() as u8];
    bytes.extend(name.as_bytes());
    bytes
}

/// A file that is being written.
pub struct Module {
    name: &'static str,
    bytes: Vec<u8>,
}

impl Module {
    /// Starts a file with the header of the module `name`, as made by RL51.
    #[must_use]
    pub fn new(name: &'static str) -> Module {
        Module { name, bytes: record(0x02, &[counted(name), vec![0xFF, 0]].concat()) }
    }

    /// Number of bytes written so far.
    #[must_use]
    pub fn written(&self) -> usize {
        self.bytes.len()
    }

    /// Writes a record of any type.
    pub fn push(&mut self, kind: u8, contents: &[u8]) {
        self.bytes.extend(record(kind, contents));
    }

    /// Writes a scope definition: 0 module, 1 do, 2 procedure; 3 to 5 their ends.
    pub fn scope(&mut self, kind: u8, name: &str) {
        self.push(0x10, &[vec![kind], counted(name)].concat());
    }

    /// Writes debug items: 0 local symbols, 1 public ones, 2 segments.
    pub fn items(&mut self, kind: u8, items: &[Item]) {
        let each: Vec<u8> = items.iter().flat_map(|item| item.bytes(1)).collect();
        self.push(0x12, &[vec![kind], each].concat());
    }

    /// Writes Keil's debug items, with `more` additional bytes before names.
    pub fn keil(&mut self, kind: u8, more: usize, items: &[Item]) {
        let each: Vec<u8> = items.iter().flat_map(|item| item.bytes(1 + more)).collect();
        self.push(0x22, &[vec![kind], each].concat());
    }

    /// Writes line numbers: address and line.
    pub fn lines(&mut self, lines: &[(u16, u16)]) {
        let each =
            lines.iter().flat_map(|(addr, line)| [0].into_iter().chain(addr.to_le_bytes()).chain(line.to_le_bytes()));
        self.push(0x12, &[3].into_iter().chain(each).collect::<Vec<u8>>());
    }

    /// Writes bytes at an address.
    pub fn content(&mut self, addr: u16, bytes: &[u8]) {
        let [low, high] = addr.to_le_bytes();
        self.push(0x06, &[&[0, low, high], bytes].concat());
    }

    /// Returns the file. The module end record names the module and the register banks that it uses.
    #[must_use]
    pub fn finish(mut self) -> Vec<u8> {
        self.push(0x04, &[counted(self.name), vec![0, 0, 1, 0]].concat());
        self.bytes
    }
}
