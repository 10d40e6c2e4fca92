//! The diagnostic codes of the loader of OMF-51 object files, one row each: code, title, explanation.

use diag::DiagnosticCode;

use crate::image::codes::row;

/// All codes that [`super::load_omf51`] reports, for `emu explain`.
#[rustfmt::skip]
pub const OMF_CODES: &[DiagnosticCode] = &[
    row("OMF001", "an object file that is cut off",
        "OMF-51 is the object format of the tools of Intel, Keil and others for MCS-51. A file consists of records with a length, and a \
         module end record (type 04) is the last. The message gives the record that extends beyond the end of the file, or reports \
         that the last record is missing. srec_cat does not write the last record; use its Intel HEX output instead. Fix: build or get the \
         file again."),
    row("OMF002", "wrong checksum in an object file",
        "The sum of all bytes of a record, including its checksum, is 0 modulo 256. The message gives the place of the record, the \
         checksum in the file and the one that the other bytes require. Fix: build or get the file again."),
    row("OMF003", "an object file that is not linked",
        "Compilers and assemblers write relocatable modules, whose missing addresses a linker fills in, and libraries of \
         such modules. Only an absolute program can run. Fix: link it, as with BL51 main.obj TO app, and load the output of the \
         linker (Keil gives it no extension), or the .hex made of it."),
    row("OMF004", "an object file of LX51",
        "Keil's linker LX51 writes its own format, which is not published. Fix: convert the program to Intel HEX with OHX51 (in the \
         IDE: Options for Target, Output, Create HEX File), and give the map of the linker for its names: --symbols app.map."),
    row("OMF005", "a damaged record in an object file",
        "The checksum of a record is correct, but its contents do not match its type: a name extends beyond the end, the type is \
         unknown, the module header occurs twice, or the end names another module. Fix: build again. If the tool always writes \
         such a record, convert the program to Intel HEX."),
    row("OMF006", "contents outside the memories of the chip",
        "The message gives the record, the first and last address, and the memories of the chip. Usually the program was linked for a \
         larger chip. Fix: link for this chip or choose the other chip."),
    row("OMF007", "a byte is given twice in an object file",
        "Two content records give the same address. Usually two segments have the same address (CSEG AT, or ?CO? and ?PR? in the \
         directives of the linker). Fix: correct the addresses and link again."),
    row("OMF008", "an object file that continues after its end",
        "Bytes follow the module end record. Usually a second module was appended. Fix: link the modules into one program."),
    row("OMF009", "an object file without code",
        "No content record contains a byte, so there is nothing to run. Fix: link a program."),
    row("OMF010", "more faults than are shown",
        "A report shows at most 100 errors of an object file. The closing note counts the others."),
    row("OMF011", "unreadable names or lines in an object file",
        "A warning: records of debugging information contradict themselves, or are of a kind that Keil has not published. The program \
         is not affected, but names and lines may be missing. Fix: give the map of the linker: --symbols app.m51."),
];
