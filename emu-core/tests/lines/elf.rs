//! ELF files of nothing but sections, for debugging information made by hand.

/// A section: name, flags, bytes.
pub type Section<'a> = (&'a str, u32, &'a [u8]);

const HEADER: usize = 52;
const PROGBITS: u32 = 1;

/// An AVR executable that has these sections and no program headers.
pub fn build(sections: &[Section<'_>]) -> Vec<u8> {
    let mut names = vec![0];
    let mut bytes = vec![0; HEADER];
    let mut headers = vec![[0u32; 10]];
    for (name, flags, data) in sections.iter().copied().chain([(".shstrtab", 0, &[][..])]) {
        let at = names.len() as u32;
        names.extend(name.as_bytes());
        names.push(0);
        let data = if name == ".shstrtab" { &names[..] } else { data };
        headers.push([at, PROGBITS, flags, 0, bytes.len() as u32, data.len() as u32, 0, 0, 1, 0]);
        bytes.extend(data);
        bytes.resize(bytes.len().next_multiple_of(4), 0);
    }
    let table = bytes.len() as u32;
    bytes.extend(headers.iter().flatten().flat_map(|field| field.to_le_bytes()));
    let mut head = vec![0x7F, b'E', b'L', b'F', 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0];
    let halves = |head: &mut Vec<u8>, fields: &[u16]| head.extend(fields.iter().flat_map(|f| f.to_le_bytes()));
    halves(&mut head, &[2, 83]);
    for word in [1, 0, 0, table, 0] {
        head.extend(u32::to_le_bytes(word));
    }
    let count = headers.len() as u16;
    halves(&mut head, &[HEADER as u16, 32, 0, 40, count, count - 1]);
    bytes[..HEADER].copy_from_slice(&head);
    bytes
}
