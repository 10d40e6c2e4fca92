//! The diagnostic codes of the image loaders, one row each: code, title, explanation.

use diag::DiagnosticCode;

/// All codes that [`super::load`], [`super::load_hex`] and [`super::load_elf`] report, for `emu explain`.
#[rustfmt::skip]
pub const IMAGE_CODES: &[DiagnosticCode] = &[
    row("HEX001", "a line does not begin with a colon",
        "Every line of Intel HEX begins with ':', behind spaces at most; a line that begins with ';' is a comment. Other \
         characters before the colon are refused, and so is a line of text. The rest of the line is still checked. Mend: remove \
         what stands before the colon, or convert the file to Intel HEX if it is of another kind (Motorola S-records begin with 'S')."),
    row("HEX002", "a character is not a hexadecimal digit",
        "Only 0 to 9 and A to F (or a to f) may follow the colon. Often a letter O stands for a zero, or two lines \
         were joined so that a colon stands in the middle. Mend: get the file again or correct the character."),
    row("HEX003", "an odd number of digits",
        "Two digits make a byte, so a line has an even number of them. One was lost or added. Mend: get the file again; \
         which digit it was can seldom be told from the line."),
    row("HEX004", "too few digits for a record",
        "The shortest record has ten digits: count, address (two bytes), type and checksum, as in :00000001FF. The line \
         was cut off. Mend: get the file again."),
    row("HEX005", "the byte count disagrees with the line",
        "The first byte of a record says how many data bytes it has. The line has more or fewer. The checksum of such a \
         line is not judged, because its place is not known. Mend: get the file again. Where every line has twice as many, the \
         file is INHX16, an old format for PICs that counts in words: write INHX8M or INHX32 (gpasm -a inhx32; gplink -a)."),
    row("HEX006", "wrong checksum",
        "All bytes of a record, its checksum included, add up to 0 modulo 256. The message gives the checksum found and \
         the one that the other bytes want. Mend: get the file again; if the line was edited by hand, write the wanted \
         checksum."),
    row("HEX007", "unknown record type",
        "Types are 00 data, 01 end, 02 segment address, 03 segment start, 04 linear address and 05 linear start. Mend: \
         have the file written as Intel HEX (objcopy -O ihex)."),
    row("HEX008", "wrong length for the record's type",
        "An end record (01) has no data bytes, types 02 and 04 have two, types 03 and 05 have four. After an address \
         record that cannot be read the addresses of the data are unknown, so that data is not placed. Mend: have the \
         file written anew."),
    row("HEX009", "the file goes on after its end record",
        "The end record :00000001FF is the last one; only comments may follow. Another record is most often of a second file that \
         was appended. What follows a ^Z (0x1A), which ends a text in CP/M, is left out with a note. Mend: \
         merge the files with a tool for it (srec_cat, mergehex), or remove what follows."),
    row("HEX010", "the end record is missing",
        "A file without :00000001FF as its last line was most likely cut off, and part of the program is missing. Mend: \
         get the file again."),
    row("HEX011", "a second end record",
        "A file has one end record. Two of them show that two files were joined. Mend: leave only the last one, after \
         checking that the data before it belongs together."),
    row("HEX012", "the file is empty",
        "There is nothing but white space in the file. Some compilers leave an empty file behind when they fail. Mend: \
         look at the messages of the tool that wrote it."),
    row("HEX013", "the file is binary",
        "Intel HEX is text, and a byte 0x00 never occurs in it. Mend: for a raw memory image use objcopy -I binary -O \
         ihex; an ELF file is recognised by its first bytes and needs no conversion."),
    row("HEX014", "the file begins with a byte order mark, or is UTF-16",
        "An editor saved the file as UTF-8 with a mark in front, which is passed over with a note, or as UTF-16, which is \
         refused. Mend: save it as plain ASCII."),
    row("HEX015", "a byte is given twice",
        "Two records give the same address. The message names the line that came first. It is a fault even where both \
         say the same, because then two programs that share a part were most likely joined. Mend: remove one."),
    row("HEX016", "data outside the memories of the chip",
        "The message gives the first and last address, and the memories of the chip with their sizes. Lines that go on \
         without a gap are one fault. Mostly the program was built for a larger chip. Mend: build it for this chip or \
         choose the other one. On an AVR the EEPROM lies at 0x810000, fuses at 0x820000, lock bits at 0x830000 and the \
         signature at 0x840000, where avr-objcopy leaves them; what is above is left out (HEX026)."),
    row("HEX017", "a record runs over the end of its 64 KB segment",
        "The address field has 16 bits. After a type 02 record what runs over wraps to the start of the segment; after a \
         type 04 record the format lets it go on, but many tools wrap there as well. As the meaning differs the record \
         is refused. Mend: split it at the end of the segment."),
    row("HEX018", "half a word",
        "In a memory of two-byte words every stretch of data begins at an even byte address and ends before one, after \
         all records are put together. Otherwise the other half of a word is not given. On an AVR it stays erased, as \
         programmers leave it, and a note says so. On a PIC16, whose words have 14 bits, the file is refused: no tool writes half \
         of such a word. Mend: pad the image to whole words (. = ALIGN(2) in a linker script, objcopy --gap-fill)."),
    row("HEX019", "a line is too long for a record",
        "The longest record has 255 data bytes, 520 digits. A longer line shows that the line breaks were lost. Mend: one \
         record a line, ended by LF, CR LF or CR."),
    row("HEX020", "more faults than are shown",
        "At most 100 errors and 100 warnings of a HEX file are shown. The closing note counts the others. Mend the first \
         ones; the others often have the same cause."),
    row("HEX021", "the file holds no data",
        "A warning: the file is well formed but has no data byte, so the memories stay as they are after erasing. Check \
         that the program was built."),
    row("HEX022", "address field in a record without address",
        "A warning: in types 02 to 05 the address field is not used and is 0000. The record is taken as if it were. An \
         end record may hold a start address, as old files do; it is not used."),
    row("HEX023", "two start addresses",
        "A warning: two records of type 03 or 05 name different start addresses. The first is kept. The chip itself \
         starts at its reset vector whatever they say."),
    row("HEX024", "a program word with more bits than program memory has",
        "Words of some chips have fewer bits than the two bytes that hold them in the file: 14 on PIC16, so that none is above \
         3FFF. A word that is above was not meant for such a chip: mostly the file is a program for another family, or \
         unused words were filled with FFFF. The message gives the first one and the number of others. Mend: choose the \
         chip that it was built for, or fill with 3FFF (mask the words with 0x3FFF)."),
    row("HEX025", "a word with more bits than its memory has",
        "A warning: in PIC16 files a byte of EEPROM takes a word, whose upper byte is 00, and configuration words have 14 \
         bits. Bits that the memory lacks are left out. Check that two bytes of EEPROM were not packed into one word."),
    row("HEX026", "data that no AVR has a memory for is left out",
        "A note: at 0x850000 and above a linker for AVR keeps the user signature and what other tools read. The chips that are \
         modelled have no memory there. The rest of the file is taken. Mend: nothing need be done; avr-objcopy -R leaves the \
         section out."),
    row("HEX027", "a record behind a semicolon is left out",
        "A warning: a line that begins with ';' is a comment, and this one is a whole record with the right checksum otherwise. \
         Somebody has taken it out by hand, or its colon was damaged. Mend: write the colon again, or remove the line."),
    row("HEX028", "an erased cell is given a value later in the file",
        "A note: the file gives a cell as erased first (FF; on a PIC 3FFF, or 00FF in its EEPROM) and then with another value, which counts. Dumps of \
         whole memories of simulators do that with the configuration word. A cell given twice with other values is refused \
         (HEX015). Mend: nothing need be done."),
    row("ELF001", "not an ELF file",
        "An ELF file begins with the bytes 7F 45 4C 46. Mend: load an ELF or an Intel HEX file."),
    row("ELF002", "not a 32-bit ELF file",
        "Programs for these chips are of class 1, 32 bits. A 64-bit file is a program for the host computer: the host's \
         compiler was called in place of the cross compiler. Mend: build with the cross compiler."),
    row("ELF003", "not little-endian",
        "Programs for these chips have byte order 1, least significant byte first. Mend: build with the cross compiler \
         for the chip."),
    row("ELF004", "program for another processor",
        "The message gives the number of the processor (e_machine) found and wanted; AVR is 83. Mend: build for this \
         chip or choose the chip it was built for."),
    row("ELF005", "not an executable",
        "Type 2 is an executable. A relocatable object (.o) has no addresses yet; link it. Mend: load the linker's \
         output."),
    row("ELF006", "truncated or corrupt",
        "A table or a section lies beyond the end of the file or contradicts itself. Mend: build or get the file again."),
    row("ELF007", "a section outside the memories of the chip",
        "The message gives the section, its load addresses and the memories of the chip. Mostly the program was linked \
         for a larger chip. Sections without bytes (.bss) are not loaded and need no room. Mend: link for this chip. \
         Sections without code above all memories of AVRs are left out (ELF015)."),
    row("ELF008", "two sections overlap",
        "Two sections give bytes for the same load address, even if the same bytes. Mend: correct the load addresses in \
         the linker script (AT, --section-start)."),
    row("ELF009", "half a word",
        "A note: a section with an odd number of bytes, as one that the linker script does not know, leaves half of a word open. \
         It stays erased, as programmers leave it. Mend: . = ALIGN(2) at the end of the section in the linker script."),
    row("ELF010", "no code",
        "No executable section holds any bytes, so there is nothing to run. Mend: link a program; check that \
         --gc-sections did not drop everything."),
    row("ELF011", "more faults than are shown",
        "At most 100 errors of an ELF file are shown. The closing note counts the others that were seen."),
    row("ELF015", "a section that no AVR has a memory for is left out",
        "A note: the section lies at 0x850000 or above, where a linker for AVR keeps the user signature and what other tools read. \
         The chips that are modelled have no memory there. The rest of the file is taken. Mend: nothing need be done; avr-objcopy \
         -R removes the section."),
];

/// All codes of the warnings in [`super::SourceLines`], for `emu explain`.
#[rustfmt::skip]
pub const LINE_CODES: &[DiagnosticCode] = &[
    row("ELF012", "damaged debugging information",
        "A warning: source lines were asked for, and what the file says of them (DWARF, in .debug_info and .debug_line) contradicts \
         itself or goes beyond its end. What can be read is used, so lines may be missing. The program itself is not touched by \
         that. Mend: build anew."),
    row("ELF013", "compressed debugging information",
        "A warning: source lines were asked for, and the sections that hold them are compressed, which is not read. Mend: link \
         without -gz, or unpack them: avr-objcopy --decompress-debug-sections app.elf."),
    row("ELF014", "damaged stabs",
        "A warning: source lines were asked for, and what the file says of them in stabs (.stab and .stabstr, the format that avr-gcc up to \
         12 writes for a mere -g) is cut off or goes beyond its end. What can be read is used, so lines may be missing. The program itself is \
         not touched by that. Mend: build anew."),
];

/// All codes that [`super::load_symbols`] reports, for `emu explain`.
#[rustfmt::skip]
pub const SYMBOL_CODES: &[DiagnosticCode] = &[
    row("SYM001", "not a file of symbols",
        "Symbols are read from what SDCC's tools write for the 8051: the linker's .map, the .cdb of a build with --debug, \
         the .rst listings that the linker updates, and .lst listings whose areas are absolute; from the map of Keil's linkers (.m51, \
         or .map of LX51); and from the .cod, .map and .lst of gputils for a PIC. They are told apart by their first lines. Mend: give one of these; an image (HEX, ELF) is given as the program."),
    row("SYM002", "the file is empty",
        "There is nothing but white space in the file. Mend: look at the messages of the tool that wrote it."),
    row("SYM003", "a damaged record in a .cdb file",
        "A record is a letter, a colon and fields, one a line, as in L:G$main$0$0:8A. Records of kinds that are not \
         needed (M, T and others) are passed over, but symbols (S, F) and link addresses (L) must be whole. Mend: build \
         anew."),
    row("SYM004", "an address beyond its memory",
        "On an 8051 program memory and external RAM end at 0xFFFF, internal RAM, registers and bits at 0xFF. Larger addresses \
         in code are those of banks. On a mid-range PIC program addresses end at 0x21FF, EEPROM included, data at 0x1FF. \
         Mend: link without banks; otherwise the file is damaged or of another family."),
    row("SYM005", "a listing without final addresses",
        "The assembler writes a .lst before the linker has placed the areas, so its addresses count from the start of \
         each area. The linker writes the same listing with final addresses beside it, as .rst. A .lst is taken only \
         where each area that has an address is absolute (ABS). Mend: give the .rst. With gputils the listing of a module \
         that is to be linked is such a one; mend: give the .lst and .map of gplink."),
    row("SYM006", "a map in columns",
        "Without its option for wide maps the linker writes three or four symbols a line and cuts their names to 8 or 9 \
         characters. Mend: link with -w; sdcc gives it by itself."),
    row("SYM007", "no link addresses",
        "The compiler writes a .cdb (or .adb) with the symbols of a module and the linker adds their addresses. Without \
         them it is not known where anything is. Mend: give --debug to the link step too, and take the .cdb that is \
         named as the image."),
    row("SYM008", "the files disagree",
        "Two of the files give different addresses for the same public name, so they are of different builds. The \
         message names both places. Mend: build anew and give the files of one build."),
    row("SYM009", "a damaged line in a map",
        "In a map the line of a symbol has a value, a name and a module; the value is in the radix that the head of the \
         page names. In one of gplink it has a name, an address, a location, a storage and a file; in one of Keil's linkers a \
         value such as C:0183H, a type and a name, and its table of symbols ends with ENDMOD \
         and a line in the first column: a map that is cut off before that is taken with a warning. Mend: link anew."),
    row("SYM010", "a damaged line in a listing",
        "Left of the source a line of a listing has an address of 4 to 8 hexadecimal digits or none, bytes of two digits \
         and the line's number, in fixed columns. Listings in octal (-q) or decimal (-d) are not read. Mend: assemble \
         with -l and without -q and -d, and link anew."),
    row("SYM011", "names in a map may be cut off",
        "A warning: the linker cuts names in a map to 32 characters, so a name of that length may be the head of a \
         longer one. It can be used as it stands if no other is cut to the same. Debugging names of that length are left \
         out. Mend: give the .cdb or the .rst files too."),
    row("SYM012", "more faults than are shown",
        "At most 100 errors and 100 warnings of one file of symbols are shown. The closing note counts the others."),
    row("SYM013", "a .cod file that is not whole",
        "A .cod is made of blocks of 512 bytes, and its directory names the blocks of each table. The message says which of \
         them the file does not have. Mend: assemble or link anew."),
    row("SYM014", "a damaged table in a .cod file",
        "A record runs over the end of its block, or a line names a source file that is none. The message gives block and \
         offset. Mend: assemble or link anew."),
    row("SYM015", "a .cod file for another family",
        "The file names its processor, and it is no mid-range PIC, whose program memory has words of 14 bits. Mend: give the \
         .cod of the program that is run."),
    row("SYM016", "a map of Keil's without symbols",
        "The linker was told to leave out its table of symbols, so the map has segments alone. Mend: link without NOSYMBOLS, NOPUBLICS, \
         NOLINES and NOPRINT (in the IDE: Options for Target, Listing, all boxes under Linker Listing), and compile with DEBUG."),
    row("SYM018", "a name in a file of symbols that is too long",
        "A name, with the module and the function that stand in front of it, has up to 1024 characters, and so has the name of a source \
         file. Compilers and linkers stay far below. Fix: build anew; the file is damaged, or no tool wrote it."),
];

/// Makes a row of a table of codes.
pub(super) const fn row(code: &'static str, title: &'static str, explain: &'static str) -> DiagnosticCode {
    DiagnosticCode { code, title, explain }
}
