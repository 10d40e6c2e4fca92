//! Stabs: records made for the purpose, and what lines, functions, variables and types are made of them.

use emu_core::image::{
    BaseEncoding, ByteLocation, CType, DebugInfo, FrameView, NumberedType, SourceLines, StructMember, VariableInfo,
};

use crate::elf::{build, build_with};
use crate::line_of;

const UNDF: u8 = 0;
const GSYM: u8 = 0x20;
const FUN: u8 = 0x24;
const STSYM: u8 = 0x26;
const OPT: u8 = 0x3C;
const RSYM: u8 = 0x40;
const SLINE: u8 = 0x44;
const SO: u8 = 0x64;
const LSYM: u8 = 0x80;
const BINCL: u8 = 0x82;
const SOL: u8 = 0x84;
const PSYM: u8 = 0xA0;
const LBRAC: u8 = 0xC0;
const EXCL: u8 = 0xC2;
const RBRAC: u8 = 0xE0;

/// A record: type, desc, value, text.
type Record<'a> = (u8, u16, u32, &'a str);

/// The sections of units, each with texts of its own.
fn sections(units: &[&[Record<'_>]]) -> (Vec<u8>, Vec<u8>) {
    let (mut records, mut all) = (Vec::new(), Vec::new());
    for unit in units {
        let mut texts = vec![0];
        let mut own = Vec::new();
        for (kind, desc, value, text) in *unit {
            let at = if text.is_empty() { 0 } else { texts.len() as u32 };
            own.extend(at.to_le_bytes());
            own.extend([*kind, 0]);
            own.extend(desc.to_le_bytes());
            own.extend(value.to_le_bytes());
            if at > 0 {
                texts.extend(text.as_bytes());
                texts.push(0);
            }
        }
        records.extend(0u32.to_le_bytes());
        records.extend([UNDF, 0, unit.len() as u8, 0]);
        records.extend((texts.len() as u32).to_le_bytes());
        records.extend(own);
        all.extend(texts);
    }
    (records, all)
}

fn read(units: &[&[Record<'_>]], symbols: &[(&str, u32)]) -> SourceLines {
    let (records, texts) = sections(units);
    let code = [0u8; 4];
    let all: [(&str, u32, &[u8]); 3] = [(".text", 6, &code), (".stab", 0, &records), (".stabstr", 0, &texts)];
    SourceLines::from_elf("a.elf", build_with(&all, symbols))
}

/// Y is 0x0200, the stack pointer 0x01F0; each other register is its number.
struct Frame(u32);

impl FrameView for Frame {
    fn pc_byte(&self) -> u32 {
        self.0
    }
    fn register(&self, number: u16) -> Option<u32> {
        Some(match number {
            28 => 0x00,
            29 => 0x02,
            32 => 0x01F0,
            other => other.into(),
        })
    }
    fn memory(&self, address: u32) -> Option<u8> {
        Some(address as u8)
    }
    fn cfa(&self) -> Option<u32> {
        None
    }
}

fn places(info: &DebugInfo, variable: &VariableInfo) -> Vec<ByteLocation> {
    info.locate_bytes(variable, info.function_at(0x10), &Frame(0x10))
}

fn typed<'a>(info: &'a DebugInfo, name: &str) -> NumberedType<'a> {
    let named = |kind: &CType| match kind {
        CType::Base { name: own, .. } | CType::Named { name: own, .. } => own == name,
        CType::Record { name: Some(own), members, .. } => own == name && !members.is_empty(),
        CType::Enum { name: Some(own), values, .. } => own == name && !values.is_empty(),
        _ => false,
    };
    info.types().find(|NumberedType { kind, .. }| named(kind)).unwrap_or_else(|| panic!("{name}"))
}

const INT: Record<'_> = (LSYM, 0, 0, "int:t(0,1)=r(0,1);-32768;32767;");
const CHAR: Record<'_> = (LSYM, 0, 0, "char:t(0,2)=r(0,2);0;127;");

/// Two functions in a file that has a line of a header in between, and one that the linker dropped.
#[test]
fn lines_count_from_their_functions() {
    let lines = read(
        &[&[
            (SO, 0, 0x10, "/src/"),
            (SO, 0, 0x10, "a.c"),
            (OPT, 0, 0, "gcc2_compiled."),
            INT,
            (FUN, 0, 0, "gone:F(0,1)"),
            (SLINE, 90, 0, ""),
            (FUN, 0, 8, ""),
            (FUN, 3, 0x10, "first:F(0,1)"),
            // The first line counts from the begin of the function, wherever it is.
            (SLINE, 3, 2, ""),
            (SLINE, 4, 4, ""),
            (SOL, 0, 0x16, "/src/a.h"),
            (SLINE, 7, 6, ""),
            (SOL, 0, 0x18, "a.c"),
            (SLINE, 5, 8, ""),
            // No code is left for it.
            (SLINE, 6, 12, ""),
            (FUN, 0, 12, ""),
            (FUN, 8, 0x20, "second:f(0,1)"),
            (SLINE, 8, 0, ""),
            (SLINE, 9, 0, ""),
            // Of lines of two files at one address that of the main file is the one.
            (SLINE, 10, 2, ""),
            (SOL, 0, 0x22, "/src/a.h"),
            (SLINE, 7, 2, ""),
            (FUN, 0, 6, ""),
            (SO, 0, 0x26, ""),
        ]],
        &[("first", 0x10)],
    );
    let rows = [(0, "-"), (0x10, "a.c:3"), (0x13, "a.c:3"), (0x14, "a.c:4"), (0x16, "a.h:7"), (0x18, "a.c:5")];
    let rows = rows.into_iter().chain([
        (0x1B, "a.c:5"),
        (0x1C, "-"),
        (0x1F, "-"),
        (0x20, "a.c:9"),
        (0x22, "a.c:10"),
        (0x26, "-"),
    ]);
    rows.for_each(|(byte, line)| assert_eq!(line_of(&lines, byte), line, "{byte:#x}"));
    assert!(lines.is_doubled(0x20) && !lines.is_doubled(0x10) && !lines.is_doubled(0x22));
    assert_eq!((lines.folder("a.c"), lines.warnings()), (Some("/src"), &[][..]));
    let info = lines.debug_info();
    let found: Vec<_> = info.functions.iter().map(|own| (own.name.as_str(), own.block.ranges[0].clone())).collect();
    assert_eq!(found, [("first", 0x10..0x1C), ("second", 0x20..0x26)]);
    let file = info.unit_at(0x22).map(|file| (file.name, file.folder));
    assert_eq!(file, Some(("a.c", "/src")));
}

/// Where an assembler or an old compiler gives no ends, functions extend to the next one, to the end of the
/// unit or by their symbols.
#[test]
fn functions_without_ends() {
    let unit: [Record<'_>; 8] = [
        (SO, 0, 0x10, "a.c"),
        INT,
        (FUN, 0, 0x10, "first:F(0,1)"),
        (SLINE, 1, 0, ""),
        (FUN, 0, 0x18, "second:F(0,1)"),
        (SLINE, 2, 0, ""),
        (SO, 0, 0x20, ""),
        (SO, 0, 0x20, "b.s"),
    ];
    let lines =
        read(&[&unit, &[(SO, 0, 0x20, "b.s"), (SLINE, 5, 0x20, ""), (SLINE, 6, 0x22, ""), (SO, 0, 0x24, "")]], &[]);
    let ranges: Vec<_> = lines.debug_info().functions.iter().flat_map(|own| own.block.ranges.clone()).collect();
    assert_eq!(ranges, [0x10..0x18, 0x18..0x20]);
    assert_eq!([0x1F, 0x20, 0x23, 0x24].map(|byte| line_of(&lines, byte)), ["a.c:2", "b.s:5", "b.s:6", "-"]);
}

#[test]
fn variables_have_their_places() {
    let lines = read(
        &[&[
            (SO, 0, 0x10, "a.c"),
            INT,
            CHAR,
            (FUN, 0, 0x10, "f:F(0,1)"),
            (PSYM, 1, 5, "stack:p(0,1)"),
            (RSYM, 1, 24, "fast:P(0,1)"),
            (PSYM, 1, 7, "moved:p(0,1)"),
            (RSYM, 1, 22, "moved:r(0,1)"),
            (RSYM, 1, 26, "by:a(0,1)"),
            (SLINE, 1, 0, ""),
            (LSYM, 2, 0xFFFF_FFFE, "below:(0,1)"),
            (RSYM, 2, 99, "odd:r(0,1)"),
            (STSYM, 3, 0x80_0104, "kept:V(0,1)"),
            (LBRAC, 0, 0, ""),
            (LSYM, 4, 1, "inner:(0,2)"),
            (LSYM, 4, 0, "two:c=i2"),
            (LBRAC, 0, 4, ""),
            (RBRAC, 0, 8, ""),
            (RBRAC, 0, 12, ""),
            (FUN, 0, 12, ""),
            (STSYM, 0, 0x80_0100, "own:S(0,1)"),
            (GSYM, 0, 0, "shared:G(0,1)"),
            (GSYM, 0, 0, "nowhere:G(0,1)"),
            (SO, 0, 0x1C, ""),
        ]],
        &[("shared", 0x80_0102)],
    );
    let info = lines.debug_info();
    let block = &info.functions[0].block;
    let names: Vec<_> = block.variables.iter().map(|own| (own.name.as_str(), own.parameter)).collect();
    let parameters = [("stack", true), ("fast", true), ("moved", true), ("by", true)];
    assert_eq!(names, [&parameters[..], &[("below", false), ("odd", false), ("kept", false)]].concat());
    let found: Vec<_> = block.variables.iter().map(|own| places(info, own)).collect();
    let ram = |at: u32| vec![ByteLocation::Memory(0x80_0000 + at), ByteLocation::Memory(0x80_0001 + at)];
    let pair = |at| vec![ByteLocation::Register(at), ByteLocation::Register(at + 1)];
    let gone = vec![ByteLocation::OptimizedOut; 2];
    assert_eq!(found, [ram(0x205), pair(24), pair(22), ram(0x1B1A), ram(0x1FE), gone, ram(0x104)]);
    assert_eq!((block.blocks.len(), &block.blocks[0].ranges[0]), (1, &(0x14..0x18)));
    let inner: Vec<_> = block.blocks[0].variables.iter().map(|own| (own.name.as_str(), places(info, own))).collect();
    let two = vec![ByteLocation::Value(2), ByteLocation::Value(0)];
    assert_eq!(inner, [("inner", vec![ByteLocation::Memory(0x80_0201)]), ("two", two)]);
    let globals: Vec<_> = info.globals.iter().map(|own| (own.name.as_str(), places(info, own))).collect();
    assert_eq!(globals, [("own", ram(0x100)), ("shared", ram(0x102))]);
}

#[test]
fn types_are_those_of_the_program() {
    let unit: [Record<'_>; 18] = [
        (SO, 0, 0x10, "a.c"),
        INT,
        CHAR,
        (LSYM, 0, 0, "long int:t(0,3)=@s32;r(0,3);020000000000;017777777777;"),
        (LSYM, 0, 0, "unsigned int:t(0,4)=r(0,4);0;0177777;"),
        (LSYM, 0, 0, "long long unsigned int:t(0,5)=@s64;r(0,5);0;01777777777777777777777;"),
        (LSYM, 0, 0, "unsigned char:t(0,6)=@s8;r(0,6);0;255;"),
        (LSYM, 0, 0, "float:t(0,7)=r(0,1);4;0;"),
        (LSYM, 0, 0, "_Bool:t(0,8)=@s8;-16"),
        (LSYM, 0, 0, "void:t(0,9)=(0,9)"),
        (LSYM, 0, 0, "byte:t(0,10)=(0,6)"),
        // Its text goes on in the next record.
        (LSYM, 0, 0, "node:T(0,11)=s9next:(0,12)=*(0,11),0,16;low:(0,6),16,3;\\"),
        (LSYM, 0, 0, "high:(0,6),19,5;grid:(0,13)=ar(0,14)=r(0,14);0;0177777;;0;1;(0,15)=ar(0,14);0;2;(0,2),24,48;;"),
        (LSYM, 0, 0, "kind:T(0,16)=eTEA:0,BREAD:-4,;"),
        (LSYM, 0, 0, "step:t(0,17)=(0,18)=*(0,19)=f(0,9)"),
        (LSYM, 0, 0, "far:t(0,20)=*(0,21)=xslater:"),
        (LSYM, 0, 0, "port:t(0,22)=B(0,6)"),
        (LSYM, 0, 0, "damaged:t(0,23)=s4a:(0,1),0"),
    ];
    let later: [Record<'_>; 3] = [
        (SO, 0, 0x20, "b.c"),
        (LSYM, 0, 0, "int:t(0,1)=r(0,1);-32768;32767;"),
        (LSYM, 0, 0, "later:T(0,2)=u2a:(0,1),0,16;;"),
    ];
    let more: [Record<'_>; 1] = [(LSYM, 0, 0, "later:T(0,3)=s2a:(0,1),0,16;;")];
    let lines = read(&[&unit, &[&later[..], &more].concat()], &[]);
    let info = lines.debug_info();
    let base = |name| match typed(info, name).kind {
        CType::Base { bytes, encoding, .. } => (*bytes, *encoding),
        other => panic!("{name}: {other:?}"),
    };
    use BaseEncoding::{Boolean, Float, Signed, SignedChar, Unsigned, UnsignedChar};
    assert_eq!((base("int"), base("char"), base("long int")), ((2, Signed), (1, SignedChar), (4, Signed)));
    assert_eq!((base("unsigned int"), base("long long unsigned int")), ((2, Unsigned), (8, Unsigned)));
    assert_eq!((base("unsigned char"), base("float"), base("_Bool")), ((1, UnsignedChar), (4, Float), (1, Boolean)));
    let named = |name| match typed(info, name).kind {
        CType::Named { of, .. } => *of,
        other => panic!("{name}: {other:?}"),
    };
    assert_eq!(named("byte"), Some(typed(info, "unsigned char").id));
    let NumberedType { id: node, kind: CType::Record { keyword: "struct", bytes: 9, members, .. } } =
        typed(info, "node")
    else {
        panic!("node")
    };
    let of = |at: usize| info.type_info(members[at].member_type.unwrap());
    assert_eq!(of(0), Some(&CType::Pointer { to: Some(node), bytes: 2 }));
    let bits = |member: &StructMember| (member.offset, member.bit_range.map(|bits| (bits.first, bits.size)));
    assert_eq!(
        members.iter().map(bits).collect::<Vec<_>>(),
        [(0, None), (2, Some((0, 3))), (2, Some((3, 5))), (3, None)]
    );
    let char = Some(typed(info, "char").id);
    assert_eq!(of(3), Some(&CType::Array { of: char, counts: vec![Some(2), Some(3)] }));
    assert_eq!((info.size(Some(node)), info.size(members[3].member_type)), (Some(9), Some(6)));
    let CType::Enum { bytes: 2, values, .. } = typed(info, "kind").kind else { panic!("kind") };
    assert_eq!(values, &[("TEA".to_owned(), 0), ("BREAD".to_owned(), -4)]);
    // A pointer to a function that returns nothing.
    let Some(CType::Pointer { to: Some(to), .. }) = named("step").and_then(|of| info.type_info(of)) else {
        panic!("step")
    };
    assert_eq!(info.type_info(*to), Some(&CType::Function { result: None, parameters: vec![], prototyped: false }));
    // What another unit defines, for this keyword.
    let Some(CType::Pointer { to, .. }) = named("far").and_then(|of| info.type_info(of)) else { panic!("far") };
    assert_eq!(info.size(*to), Some(2));
    assert!(
        matches!(info.type_info(to.unwrap()), Some(CType::Record { keyword: "struct", members, .. }) if members.len() == 1)
    );
    let of = named("port").and_then(|of| info.type_info(of));
    assert_eq!(of, Some(&CType::Qualified { word: "volatile", of: Some(typed(info, "unsigned char").id) }));
}

/// A header of two units is defined in the first one; a number counts within its header.
#[test]
fn headers_are_reported_once() {
    let byte = "unsigned char:t(0,2)=@s8;r(0,2);0;255;";
    let first: [Record<'_>; 6] = [
        (SO, 0, 0x10, "a.c"),
        INT,
        (BINCL, 0, 77, "a.h"),
        (LSYM, 0, 0, "pair:T(1,1)=s4a:(0,1),0,16;b:(0,1),16,16;;"),
        (GSYM, 0, 0, "one:G(1,1)"),
        (SO, 0, 0x20, ""),
    ];
    let second: [Record<'_>; 9] = [
        (SO, 0, 0x20, "b.c"),
        (LSYM, 0, 0, byte),
        (BINCL, 0, 5, "other.h"),
        (LSYM, 0, 0, "count:t(1,1)=(0,2)"),
        (EXCL, 0, 77, "a.h"),
        (EXCL, 0, 78, "lost.h"),
        (GSYM, 0, 0, "two:G(2,1)"),
        (GSYM, 0, 0, "three:G(1,1)"),
        (SO, 0, 0x30, ""),
    ];
    let lines = read(&[&first, &second], &[("one", 0x80_0100), ("two", 0x80_0104), ("three", 0x80_0108)]);
    let info = lines.debug_info();
    let sizes: Vec<_> = info.globals.iter().map(|own| (own.name.as_str(), info.size(own.variable_type))).collect();
    assert_eq!(sizes, [("one", Some(4)), ("two", Some(4)), ("three", Some(1))]);
    assert_eq!(info.globals[0].variable_type, info.globals[1].variable_type);
}

/// Records that all name one long text, and types that refer in circles, come to an end.
#[test]
fn reading_always_ends() {
    let long = format!("{}\0", "(0,1)=*".repeat(20_000));
    let mut records = vec![0, 0, 0, 0, SO, 0, 0, 0, 0, 0, 0, 0];
    for _ in 0..20_000 {
        records.extend([0, 0, 0, 0, LSYM, 0, 0, 0, 0, 0, 0, 0]);
    }
    let texts = [b"x:t".as_slice(), long.as_bytes()].concat();
    let lines = SourceLines::from_elf("a.elf", build(&[(".stab", 0, &records), (".stabstr", 0, &texts)]));
    assert_eq!(lines.all_lines(), []);
    assert_eq!(lines.warnings().iter().map(|warning| warning.code).collect::<Vec<_>>(), ["ELF014"]);
    let circles: [Record<'_>; 5] = [
        (SO, 0, 0x10, "a.c"),
        (LSYM, 0, 0, "a:t(0,1)=(0,2)=(0,3)=(0,1)"),
        (LSYM, 0, 0, "b:t(0,4)=ar(0,4);0;1;(0,4)"),
        (LSYM, 0, 0, "c:T(0,5)=s1a:(0,5),0,8;;"),
        (LSYM, 0, 0, "d:t(9,9)=*(9,9)"),
    ];
    let lines = read(&[&circles], &[]);
    lines.debug_info().types().for_each(|NumberedType { id, .. }| _ = lines.debug_info().size(Some(id)));
}
