//! Makes ELF files that contain only sections, for hand-made debugging information.

/// A section: name, flags, bytes.
pub type Section<'a> = (&'a str, u32, &'a [u8]);

const HEADER: usize = 52;
const PROGBITS: u32 = 1;
const SYMTAB: u32 = 2;
const STRTAB: u32 = 3;

/// Builds an AVR executable with these sections and no program headers.
pub fn build(sections: &[Section<'_>]) -> Vec<u8> {
    build_with(sections, &[])
}

/// Builds an AVR executable with these sections and with symbols of functions: name and address. The
/// functions are in the first section.
pub fn build_with(sections: &[Section<'_>], functions: &[(&str, u32)]) -> Vec<u8> {
    let mut names = vec![0];
    let mut bytes = vec![0; HEADER];
    let mut headers = vec![[0u32; 10]];
    let (mut table, mut texts) = (vec![0; 16], vec![0]);
    for (name, addr) in functions {
        table.extend([texts.len() as u32, *addr, 0].into_iter().flat_map(u32::to_le_bytes));
        // A global function of section 1.
        table.extend([0x12, 0, 1, 0]);
        texts.extend(name.as_bytes());
        texts.push(0);
    }
    let tables: &[Section<'_>] = &[(".symtab", 0, &table), (".strtab", 0, &texts)];
    let tables = if functions.is_empty() { &[] } else { tables };
    let all = sections.iter().chain(tables).copied().chain([(".shstrtab", 0, &[][..])]);
    for (name, flags, data) in all {
        let at = names.len() as u32;
        names.extend(name.as_bytes());
        names.push(0);
        let data = if name == ".shstrtab" { &names[..] } else { data };
        let (kind, link, info, entry) = match name {
            ".symtab" => (SYMTAB, headers.len() as u32 + 1, 1, 16),
            ".strtab" => (STRTAB, 0, 0, 0),
            _ => (PROGBITS, 0, 0, 0),
        };
        headers.push([at, kind, flags, 0, bytes.len() as u32, data.len() as u32, link, info, 1, entry]);
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
