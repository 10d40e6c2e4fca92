//! The diagnostic codes of the image loaders, one row each: code, title, explanation.

use diag::DiagnosticCode;

/// All codes that [`super::load`], [`super::load_hex`] and [`super::load_elf`] report, for `emu explain`.
#[rustfmt::skip]
pub const IMAGE_CODES: &[DiagnosticCode] = &[
    row("HEX001", "a line does not begin with a colon",
        "Every line of Intel HEX begins with ':'. Only spaces may precede it. A line that begins with ';' is a comment. The \
         loader refuses other characters before the colon, and lines of text. It still checks the rest of the line. Fix: remove \
         what precedes the colon, or convert the file to Intel HEX if it is of another kind (Motorola S-records begin with 'S')."),
    row("HEX002", "a character is not a hexadecimal digit",
        "Only 0 to 9 and A to F (or a to f) may follow the colon. A common cause is a letter O instead of a zero, or two lines \
         that were joined, so that a colon is in the middle. Fix: get the file again or correct the character."),
    row("HEX003", "an odd number of digits",
        "Two digits make a byte, so the number of digits in a line is even. Here a digit was lost or added. The line does not \
         show which one. Fix: get the file again."),
    row("HEX004", "too few digits for a record",
        "The shortest record has ten digits: count, address (two bytes), type and checksum, as in :00000001FF. The line \
         was cut off. Fix: get the file again."),
    row("HEX005", "the byte count disagrees with the line",
        "The first byte of a record is the number of its data bytes. The line has more or fewer. The checksum of such a \
         line is not checked, because its place is not known. Fix: get the file again. If every line has twice as many bytes, the \
         file is INHX16, an old format for PICs that counts words: write INHX8M or INHX32 (gpasm -a inhx32; gplink -a)."),
    row("HEX006", "wrong checksum",
        "The sum of all bytes of a record, including its checksum, is 0 modulo 256. The message gives the checksum in the file and \
         the one that the other bytes require. Fix: get the file again. If you edited the line by hand, write the required \
         checksum."),
    row("HEX007", "unknown record type",
        "Types are 00 data, 01 end, 02 segment address, 03 segment start, 04 linear address and 05 linear start. Fix: \
         write the file as Intel HEX (objcopy -O ihex)."),
    row("HEX008", "wrong length for the record's type",
        "An end record (01) has no data bytes, types 02 and 04 have two, types 03 and 05 have four. After an unreadable address \
         record the addresses of the data are unknown, so the loader does not place that data. Fix: write the file again \
         with the tool that made it."),
    row("HEX009", "the file continues after its end record",
        "The end record :00000001FF is the last one. Only comments may follow. Another record usually belongs to a second file that \
         was appended. Data after a ^Z (0x1A), which ends a text in CP/M, is ignored with a note. Fix: \
         merge the files with a suitable tool (srec_cat, mergehex), or remove what follows the end record."),
    row("HEX010", "the end record is missing",
        "A file without :00000001FF as its last line was probably cut off, and part of the program is missing. Fix: \
         get the file again."),
    row("HEX011", "a second end record",
        "A file has one end record. Two of them show that two files were joined. Fix: check that the data before the first end \
         record belongs to the rest, then keep only the last end record."),
    row("HEX012", "the file is empty",
        "The file contains only white space. Some compilers leave an empty file when they fail. Fix: \
         read the messages of the tool that wrote it."),
    row("HEX013", "the file is binary",
        "Intel HEX is text and never contains a byte 0x00. Fix: for a raw memory image use objcopy -I binary -O \
         ihex. An ELF file needs no conversion: its first bytes identify it."),
    row("HEX014", "the file begins with a byte order mark, or is UTF-16",
        "An editor saved the file as UTF-8 with a byte order mark, or as UTF-16. The loader skips the mark with a note, and \
         refuses UTF-16. Fix: save the file as plain ASCII."),
    row("HEX015", "a byte is given twice",
        "Two records give the same address. The message names the line of the first one. This is an error even if both \
         give the same value, because it usually means that two programs with a common part were joined. Fix: remove one."),
    row("HEX016", "data outside the memories of the chip",
        "The message gives the first and last address, and the memories of the chip with their sizes. Lines with consecutive \
         addresses count as one fault. Usually the program was built for a larger chip. Fix: build it for this chip or \
         choose the other chip. On an AVR the EEPROM is at 0x810000, the fuses are at 0x820000, the lock bits at 0x830000 and the \
         signature at 0x840000, as avr-objcopy writes them. Data above these is ignored (HEX026)."),
    row("HEX017", "a record crosses the end of its 64 KB segment",
        "The address field has 16 bits. After a type 02 record the data beyond the segment wraps to its start. After a \
         type 04 record the format lets the addresses continue, but many tools wrap there as well. Because the meaning is \
         ambiguous, the loader refuses the record. Fix: split it at the end of the segment."),
    row("HEX018", "half a word",
        "In a memory of two-byte words, each block of data begins and ends at an even byte address after all \
         records are combined. Otherwise the file gives only half of a word. On an AVR the other half stays erased, as with \
         programmers, and a note reports it. On a PIC16, whose words have 14 bits, the loader refuses the file: no tool writes half \
         of such a word. Fix: pad the image to whole words (. = ALIGN(2) in a linker script, objcopy --gap-fill)."),
    row("HEX019", "a line is too long for a record",
        "The longest record has 255 data bytes, which are 520 digits. A longer line shows that the line breaks were lost. Fix: \
         write one record per line, ended by LF, CR LF or CR."),
    row("HEX020", "more faults than are shown",
        "A report shows at most 100 errors and 100 warnings of a HEX file. The closing note counts the others. Fix: correct the \
         first ones. The others often have the same cause."),
    row("HEX021", "the file contains no data",
        "A warning: the file is well formed but has no data byte, so the memories stay erased. Fix: check \
         that the program was built."),
    row("HEX022", "address field in a record without address",
        "A warning: in types 02 to 05 the address field is not used and is 0000. The loader ignores the value. An \
         end record may contain a start address, as in old files. The loader ignores it too."),
    row("HEX023", "two start addresses",
        "A warning: two records of type 03 or 05 name different start addresses. The loader keeps the first. The chip itself \
         always starts at its reset vector."),
    row("HEX024", "a program word with more bits than program memory has",
        "Words of some chips have fewer bits than the two bytes that contain them in the file: 14 on PIC16, so that the largest \
         is 3FFF. A larger word is not for such a chip. Usually the program is for another family, or a tool filled \
         unused words with FFFF. The message gives the first such word and the number of others. Fix: choose the \
         chip that the program was built for, or fill with 3FFF (mask the words with 0x3FFF)."),
    row("HEX025", "a word with more bits than its memory has",
        "A warning: in PIC16 files a byte of EEPROM occupies a word with the upper byte 00, and configuration words have 14 \
         bits. The loader drops bits that the memory does not have. Fix: check that no tool packed two bytes of EEPROM into one word."),
    row("HEX026", "data for which no AVR has a memory is ignored",
        "A note: at 0x850000 and above a linker for AVR places the user signature and data for other tools. The modelled chips \
         have no memory there. The rest of the file is loaded. No action is necessary. avr-objcopy -R removes the section."),
    row("HEX027", "a record after a semicolon is ignored",
        "A warning: a line that begins with ';' is a comment, and this one is a complete record with a correct checksum. \
         Somebody disabled it by hand, or its colon was damaged. Fix: restore the colon, or remove the line."),
    row("HEX028", "an erased cell gets a value later in the file",
        "A note: the file first gives a cell as erased (FF; on a PIC 3FFF, or 00FF in its EEPROM) and then with another value. The \
         second value counts. Memory dumps of simulators do this with the configuration word. A cell with two different \
         values that are not erased is an error (HEX015). No action is necessary."),
    row("ELF001", "not an ELF file",
        "An ELF file begins with the bytes 7F 45 4C 46. Fix: load an ELF or an Intel HEX file."),
    row("ELF002", "not a 32-bit ELF file",
        "Programs for these chips are of class 1, 32 bits. A 64-bit file is a program for the host computer: the compiler of the \
         host was used instead of the cross compiler. Fix: build with the cross compiler."),
    row("ELF003", "not little-endian",
        "Programs for these chips have byte order 1, least significant byte first. Fix: build with the cross compiler \
         for the chip."),
    row("ELF004", "program for another processor",
        "The message gives the processor number (e_machine) of the file and the required one. AVR is 83. Fix: build for this \
         chip or choose the chip that the program was built for."),
    row("ELF005", "not an executable",
        "Type 2 is an executable. A relocatable object (.o) has no addresses before it is linked. Fix: link it and load the \
         output of the linker."),
    row("ELF006", "truncated or corrupt",
        "A table or a section extends beyond the end of the file or contradicts itself. Fix: build or get the file again."),
    row("ELF007", "a section outside the memories of the chip",
        "The message gives the section, its load addresses and the memories of the chip. Usually the program was linked \
         for a larger chip. Sections without bytes (.bss) are not loaded and need no space. Fix: link for this chip. \
         Sections without code above all memories of AVRs are ignored (ELF015)."),
    row("ELF008", "two sections overlap",
        "Two sections give bytes for the same load address. This is an error even if the bytes are equal. Fix: correct the load \
         addresses in the linker script (AT, --section-start)."),
    row("ELF009", "half a word",
        "A note: a section has an odd number of bytes, so half of a word has no value. Sections that the linker script does not \
         name often have this. The half stays erased, as with programmers. Fix: . = ALIGN(2) at the end of the section in the \
         linker script."),
    row("ELF010", "no code",
        "No executable section contains any bytes, so there is nothing to run. Fix: link a program, and check that \
         --gc-sections did not remove everything."),
    row("ELF011", "more faults than are shown",
        "A report shows at most 100 errors of an ELF file. The closing note counts the others."),
    row("ELF015", "a section for which no AVR has a memory is ignored",
        "A note: the section is at 0x850000 or above, where a linker for AVR places the user signature and data for other tools. \
         The modelled chips have no memory there. The rest of the file is loaded. No action is necessary. avr-objcopy \
         -R removes the section."),
];

/// All codes of the warnings in [`super::SourceLines`], for `emu explain`.
#[rustfmt::skip]
pub const LINE_CODES: &[DiagnosticCode] = &[
    row("ELF012", "damaged debugging information",
        "A warning: source lines were requested, and the debugging information of the file (DWARF, in .debug_info and .debug_line) \
         contradicts itself or extends beyond the end of the file. The readable part is used, so lines may be missing. The \
         program itself is not affected. Fix: build again."),
    row("ELF013", "compressed debugging information",
        "A warning: source lines were requested, and the sections that contain them are compressed. Compressed sections are not \
         supported. Fix: link without -gz, or decompress them: avr-objcopy --decompress-debug-sections app.elf."),
    row("ELF014", "damaged stabs",
        "A warning: source lines were requested, and the stabs of the file are cut off or extend beyond its end. Stabs (.stab and \
         .stabstr) are the format that avr-gcc up to 12 writes for a plain -g. The readable part is used, so lines may be missing. \
         The program itself is not affected. Fix: build again."),
];

/// All codes that [`super::load_symbols`] reports, for `emu explain`.
#[rustfmt::skip]
pub const SYMBOL_CODES: &[DiagnosticCode] = &[
    row("SYM001", "not a symbol file",
        "emu reads symbols from the files that the tools of SDCC write for the 8051: the .map of the linker, the .cdb of a build with \
         --debug, the .rst listings that the linker updates, and .lst listings whose areas are absolute. It also reads the map of \
         Keil's linkers (.m51, or .map of LX51), and the .cod, .map and .lst of gputils for a PIC. The first lines identify the \
         format. Fix: give one of these files. Give an image (HEX, ELF) as the program."),
    row("SYM002", "the file is empty",
        "The file contains only white space. Fix: read the messages of the tool that wrote it."),
    row("SYM003", "a damaged record in a .cdb file",
        "A record is a letter, a colon and fields, one per line, as in L:G$main$0$0:8A. Records of other kinds \
         (M, T and others) are ignored, but symbols (S, F) and link addresses (L) must be complete. Fix: build \
         again."),
    row("SYM004", "an address beyond its memory",
        "On an 8051 program memory and external RAM end at 0xFFFF; internal RAM, registers and bits end at 0xFF. Larger addresses \
         in code belong to banks. On a mid-range PIC program addresses end at 0x21FF, including EEPROM, and data at 0x1FF. \
         Fix: link without banks. Otherwise the file is damaged or for another family."),
    row("SYM005", "a listing without final addresses",
        "The assembler writes a .lst before the linker places the areas, so its addresses count from the start of \
         each area. The linker writes the same listing with final addresses as .rst. emu accepts a .lst only \
         if each area that has an address is absolute (ABS). Fix: give the .rst. With gputils the listing of a module \
         that is not linked yet has the same problem: give the .lst and .map of gplink."),
    row("SYM006", "a map in columns",
        "Without its option for wide maps the linker writes three or four symbols per line and cuts their names to 8 or 9 \
         characters. Fix: link with -w. sdcc sets it by default."),
    row("SYM007", "no link addresses",
        "The compiler writes a .cdb (or .adb) with the symbols of a module, and the linker adds their addresses. Without \
         them no symbol has a known address. Fix: give --debug to the link step too, and use the .cdb that has the \
         name of the image."),
    row("SYM008", "the files disagree",
        "Two of the files give different addresses for the same public name, so they are from different builds. The \
         message names both places. Fix: build again and give the files of one build."),
    row("SYM009", "a damaged line in a map",
        "In a map the line of a symbol has a value, a name and a module. The head of the page names the radix of the value. \
         In a map of gplink a line has a name, an address, a location, a storage and a file. In a map of Keil's linkers it has a \
         value such as C:0183H, a type and a name, and the table of symbols ends with ENDMOD \
         and a line in the first column. A map that is cut off before that causes a warning. Fix: link again."),
    row("SYM010", "a damaged line in a listing",
        "A line of a listing has, left of the source and in fixed columns, an address of 4 to 8 hexadecimal digits or none, bytes \
         of two digits, and the line number. Listings in octal (-q) or decimal (-d) are not supported. Fix: assemble \
         with -l and without -q and -d, and link again."),
    row("SYM011", "names in a map may be cut off",
        "A warning: the linker cuts names in a map to 32 characters, so a name of that length may be the start of a \
         longer one. It is usable if no other name is cut to the same text. Debugging names of that length are \
         ignored. Fix: give the .cdb or the .rst files too."),
    row("SYM012", "more faults than are shown",
        "A report shows at most 100 errors and 100 warnings of one symbol file. The closing note counts the others."),
    row("SYM013", "an incomplete .cod file",
        "A .cod consists of blocks of 512 bytes, and its directory names the blocks of each table. The message names the blocks \
         that the file does not have. Fix: assemble or link again."),
    row("SYM014", "a damaged table in a .cod file",
        "A record extends beyond the end of its block, or a line names a source file that does not exist. The message gives block \
         and offset. Fix: assemble or link again."),
    row("SYM015", "a .cod file for another family",
        "The file names its processor, which is not a mid-range PIC with program words of 14 bits. Fix: give the \
         .cod of the program that you run."),
    row("SYM016", "a map of Keil without symbols",
        "An option of the linker removed its table of symbols, so the map has only segments. Fix: link without NOSYMBOLS, NOPUBLICS, \
         NOLINES and NOPRINT (in the IDE: Options for Target, Listing, all boxes under Linker Listing), and compile with DEBUG."),
    row("SYM018", "a name in a symbol file that is too long",
        "A name, including its module and function, has at most 1024 characters, and so has the name of a source \
         file. Compilers and linkers write much shorter names. Fix: build again. The file is damaged, or no tool wrote it."),
];

/// Makes a row of a table of codes.
pub(super) const fn row(code: &'static str, title: &'static str, explain: &'static str) -> DiagnosticCode {
    DiagnosticCode { code, title, explain }
}
