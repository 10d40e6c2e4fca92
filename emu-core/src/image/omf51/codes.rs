//! The diagnostic codes of the loader of OMF-51 object files, one row each: code, title, explanation.

use diag::DiagnosticCode;

use crate::image::codes::row;

/// All codes that [`super::load_omf51`] reports, for `emu explain`.
#[rustfmt::skip]
pub const OMF_CODES: &[DiagnosticCode] = &[
    row("OMF001", "an object file that is cut off",
        "A file of OMF-51, the object format of Intel's, Keil's and other tools for MCS-51, is made of records with a length, and a module \
         end record (type 04) is the last. The message says where a record goes beyond the end of the file, or that the last one is \
         missing. srec_cat leaves it out: have it write Intel HEX. Mend: build or get the file again."),
    row("OMF002", "wrong check sum in an object file",
        "All bytes of a record, its check sum included, add up to 0 modulo 256. The message gives the place of the record, the check sum \
         found and the one that the other bytes want. Mend: build or get the file again."),
    row("OMF003", "an object file that is not linked",
        "Compilers and assemblers write relocatable modules, in which addresses are missing that a linker fills in, and libraries of \
         such modules. A program to be run is absolute. Mend: link it, as with BL51 main.obj TO app, and load the file that the linker \
         writes (Keil gives it no extension), or the .hex made of it."),
    row("OMF004", "an object file of LX51",
        "Keil's linker LX51 writes a format of its own, which is not published. Mend: convert the program to Intel HEX with OHX51 (in the \
         IDE: Options for Target, Output, Create HEX File), and give the linker's map for its names: --symbols app.map."),
    row("OMF005", "a damaged record in an object file",
        "The check sum of a record is right and its contents are not what its type says: a name goes beyond the end, the type is unknown, \
         the module header comes twice, or the end names another module. Mend: build anew; if the tool that wrote it always writes \
         such a record, convert the program to Intel HEX."),
    row("OMF006", "contents outside the memories of the chip",
        "The message gives the record, the first and last address, and the memories of the chip. Mostly the program was linked for a \
         larger chip. Mend: link for this chip or choose the other one."),
    row("OMF007", "a byte is given twice in an object file",
        "Two content records give the same address. Mostly two segments were put at one address (CSEG AT, or ?CO? and ?PR? in the \
         linker's directives). Mend: correct the addresses and link anew."),
    row("OMF008", "an object file that goes on after its end",
        "Bytes follow the module end record: most often a second module was appended. Mend: link the modules into one program."),
    row("OMF009", "an object file without code",
        "No content record holds a byte, so there is nothing to run. Mend: link a program."),
    row("OMF010", "more faults than are shown",
        "At most 100 errors of an object file are shown. The closing note counts the others."),
    row("OMF011", "names or lines of an object file that cannot be read",
        "A warning: records of debugging information contradict themselves, or are of a kind that Keil has not published. The program is \
         not touched by that; names and lines may be missing. Mend: give the linker's map: --symbols app.m51."),
];
