//! The codes of the assembler's diagnostics.

use diag::DiagnosticCode;

/// All codes. ASM040 to ASM059 belong to the PIC16 dialect, ASM060 to ASM079 to that of AP101.
#[rustfmt::skip]
pub const CODES: &[DiagnosticCode] = &[
    DiagnosticCode { code: "ASM001", title: "unknown mnemonic",
        explain: "The word is not an instruction of this chip, a directive of its dialect, or a macro that was defined before this \
                  line. docs/isa lists the instructions, docs/formats/asm.md the directives. In most dialects a label before an \
                  instruction needs a colon. Fix: correct the word, or choose a chip that has the instruction." },
    DiagnosticCode { code: "ASM002", title: "operands match no form of the instruction",
        explain: "The instruction exists, but not with operands of these kinds, this number or this order. The hint lists its forms. \
                  In a form, lower-case letters are operands; write everything else as shown. Example of the error: `mov @r0,@r1` on the 8051." },
    DiagnosticCode { code: "ASM003", title: "operand out of range",
        explain: "The operand has the right kind, but the instruction or directive cannot contain this value: `ldi` takes r16 to r31, \
                  a relative branch reaches 64 words, a constant byte is -128 to 255. The message gives the allowed values. Fix: use a \
                  value in range, select a part of the value with low() or &, or use an instruction with a longer reach." },
    DiagnosticCode { code: "ASM004", title: "empty line",
        explain: "The line contains only a comment or white space, so there is nothing to assemble." },
    DiagnosticCode { code: "ASM005", title: "a line or an expression cannot be read",
        explain: "A value, an operator or a bracket is missing or is in a wrong place. A line is `label: word operands ; \
                  comment`. The operators and their precedence are those of the usual assembler of the family. \
                  docs/formats/asm.md lists them." },
    DiagnosticCode { code: "ASM006", title: "a name is not defined",
        explain: "The name is not a label, not defined by equ, set or =, and not a register, bit or constant of the chip. Upper and lower \
                  case of names are equal on the 8051 and AP101, and different on AVR and PIC16. Fix: \
                  correct the name, define it, or include the file that defines it." },
    DiagnosticCode { code: "ASM007", title: "a name is defined twice",
        explain: "A label, or a name defined by equ, has one value in the whole program. The message gives the place of the other \
                  definition. Fix: choose another name. Use `local` or \\@ for labels in macros, so that each call gets its own. \
                  Use set for a value that changes." },
    DiagnosticCode { code: "ASM008", title: "a core register instead of a number or a label",
        explain: "Words such as A, DPTR, r16 or X belong to the instructions. They cannot be in an expression and cannot be labels. \
                  Fix: choose another name. A register can get its own name: `count equ r7`." },
    DiagnosticCode { code: "ASM009", title: "division by zero",
        explain: "The right operand of / or of the remainder is 0." },
    DiagnosticCode { code: "ASM010", title: "a number cannot be read",
        explain: "A number has a digit that its radix does not have, a form that the family does not have, or more than 32 bits. \
                  Every family accepts hexadecimal as 0x1F. docs/formats/asm.md lists the other forms. On PIC16 numbers without a \
                  prefix or suffix are hexadecimal unless `radix dec` changes it, and begin with a digit." },
    DiagnosticCode { code: "ASM011", title: "a text or character cannot be read",
        explain: "A quote is not closed or is empty, or a text is used as a number. Write characters in single quotes, \
                  texts in double quotes, and a quote inside with a backslash." },
    DiagnosticCode { code: "ASM012", title: "if, else and endif do not match",
        explain: "Every if, ifdef or ifndef ends with endif in the same file, or in the same macro, and has at most one else." },
    DiagnosticCode { code: "ASM013", title: "a macro or repetition is not closed, or closed without a beginning",
        explain: "A macro ends with endm, a repetition with endr or endm, a while with endw, in the same file." },
    DiagnosticCode { code: "ASM014", title: "macros are nested too deep",
        explain: "A macro calls itself, directly or through others, without a condition that ends it. The limit is 64 nested calls. \
                  A text of #define that doubles itself has the same code." },
    DiagnosticCode { code: "ASM015", title: "a file cannot be included",
        explain: "The file does not exist, is not readable, or is for another chip. Paths are relative to the file that includes. \
                  Files that list the registers of a chip (avr/io.h, m328Pdef.inc, p16f873.inc, reg52.inc) need not exist, because \
                  the chip defines these names." },
    DiagnosticCode { code: "ASM016", title: "includes are nested too deep",
        explain: "A file includes itself, directly or through others. The limit is 32 nested includes." },
    DiagnosticCode { code: "ASM017", title: "the program grows too large",
        explain: "Macros, repetitions and includes give more than 1,000,000 lines, a `while` has more than 65,536 iterations, or the \
                  program has more than 16 MB. Fix: look for a repetition with a wrong count or a macro that never ends." },
    DiagnosticCode { code: "ASM018", title: "values do not settle",
        explain: "The assembler reads the source again until no name changes. Here the place of an item depends on a name whose value \
                  depends on that place, as in `org x` with `x: equ $+1`, or names depend on each other in a circle. The assembler stops \
                  after 20 passes without progress, or after 1000 passes. Fix: give one of the names a plain number." },
    DiagnosticCode { code: "ASM019", title: "two parts of the program overlap",
        explain: "An earlier line already filled this address. The message names the line. Fix: move one of them with org." },
    DiagnosticCode { code: "ASM020", title: "there is no memory here",
        explain: "The program puts bytes where the chip has no memory that an image fills: after the end of program memory, or in RAM. \
                  Fix: make the program smaller, choose a larger chip, correct org, or reserve RAM with ds (res on the PIC16)." },
    DiagnosticCode { code: "ASM021", title: "a word has bits that its memory does not have",
        explain: "Program words of the PIC16 have 14 bits, so the largest value is 3FFFh." },
    DiagnosticCode { code: "ASM022", title: "an instruction at an odd address",
        explain: "Instructions of the AVR are at even byte addresses, and an odd number of data bytes precedes this one. Fix: put \
                  `.balign 2` before it." },
    DiagnosticCode { code: "ASM023", title: "a directive has the wrong number of arguments",
        explain: "The directive needs a name, a value or a word that is missing, or has too many, or has a label that it may not have. \
                  docs/formats/asm.md lists the arguments of each directive." },
    DiagnosticCode { code: "ASM024", title: "the program reports an error",
        explain: "The source has an `error` directive here, usually in a conditional block that checks a requirement of the program." },
    DiagnosticCode { code: "ASM025", title: "the program reports a warning",
        explain: "The source has a `warning` directive here." },
    DiagnosticCode { code: "ASM026", title: "the chip does not have the instruction",
        explain: "Smaller chips of a family do not have some instructions: jmp and call need more than 8 KB of flash, elpm more than \
                  64 KB. Fix: use rjmp and rcall, which reach all of a small chip." },
    DiagnosticCode { code: "ASM027", title: "a directive without effect",
        explain: "A note: the directive is for a linker or a listing of another assembler, and has no effect here." },
    DiagnosticCode { code: "ASM029", title: "more errors, or more warnings and notes",
        explain: "The assembler shows at most 100 errors, and 100 warnings and notes. This note counts the others. `errorlevel -302` in a \
                  PIC16 source disables the notes about registers in other banks." },
    DiagnosticCode { code: "ASM030", title: "a value is truncated",
        explain: "A warning: a value of db or dw has more bits than its place, and only the lower ones are kept. Fix: select a part of \
                  the value with low() or &." },
    DiagnosticCode { code: "ASM031", title: "org in a section that follows others",
        explain: "The linker concatenates the sections of the AVR: .vectors, .progmem, .init0 to .init9, .text, .fini9 to .fini0, and \
                  .data, .rodata, .bss, .noinit in RAM. A warning: as with avr-as, org in a section counts from its start, \
                  which moves with the sections before it. Fix: reserve space with .space, or use .balign. In the first used \
                  section org counts from 0." },
    DiagnosticCode { code: "ASM035", title: "a file in an unsupported encoding",
        explain: "Sources are UTF-8, which includes ASCII. By its first bytes this file is UTF-16, as some editors \
                  save texts. Fix: save it as UTF-8." },
    DiagnosticCode { code: "ASM036", title: "a name of another module",
        explain: "A warning: the source is one module of a program for sdas8051, and does not define this name. sdld uses 0 as its \
                  value, and so does emu: the program runs up to the first use of it. emu does not read other modules. Fix: link all \
                  modules with sdcc or sdld, and load the resulting HEX file." },
    DiagnosticCode { code: "ASM037", title: "no space for an area",
        explain: "emu places the areas of a source for sdas8051 as the linker sdld does: DSEG, OSEG and ISEG each in the first gap of \
                  RAM that fits the whole area, SSEG in the largest gap, bits in the bytes 20h to 2Fh. No gap is large enough for \
                  this area. Fix: reserve less, or move it to XDATA." },
    DiagnosticCode { code: "ASM038", title: "areas share memory",
        explain: "A warning: the linker sdld puts an area over another one without a message. It knows the areas of RAM by the names \
                  that SDCC gives them (DSEG, OSEG, ISEG, SSEG, BSEG, BIT_BANK, REG_BANK_0 to 3). An area with another name begins after \
                  the register banks, even over other areas. An area with PAG on two pages of 256 bytes has the same code. Fix: put its \
                  bytes into DSEG, or give it the attribute ABS and an address by .org." },
    DiagnosticCode { code: "ASM039", title: "a byte instead of a bit, or a bit instead of a byte",
        explain: "A warning: `cpl P1` changes only bit 0 of P1, because P1 and P1.0 have the same address, and `mov a,TI` reads SBUF, the byte at \
                  the address of the bit. as31 and sdas8051 accept both without a message, AX51 and ASEM-51 refuse them. Labels of \
                  the program without a `#` have the same code. Fix: name the bit, or use an instruction for bytes." },
    DiagnosticCode { code: "ASM040", title: "instruction in column 1",
        explain: "Words in column 1 are labels. If an instruction has that name, the assembler takes the word as the instruction and \
                  warns. This is warning 203 of gpasm and MPASM." },
    DiagnosticCode { code: "ASM041", title: "directive in column 1",
        explain: "Words in column 1 are labels. If a directive has that name, the assembler takes the word as the directive and \
                  warns. This is warning 205 of gpasm and MPASM." },
    DiagnosticCode { code: "ASM042", title: "register not in bank 0",
        explain: "The operand is the address of a register in bank 1, 2 or 3. The instruction contains only the lower \
                  seven bits of it, so it reaches the register only if RP0 and RP1 of STATUS select that bank. `banksel` \
                  generates the instructions that select it. This is message 302 of gpasm and MPASM." },
    DiagnosticCode { code: "ASM043", title: "source for another chip",
        explain: "A line `list p=..` or `processor ..` names another chip than the one that the source is assembled for. \
                  Registers and memory may differ." },
    DiagnosticCode { code: "ASM044", title: "nothing to select",
        explain: "The chip has one page of program memory, so `pagesel` generates nothing. This is message 312 of gpasm and MPASM." },
    DiagnosticCode { code: "ASM045", title: "word truncated",
        explain: "A value or two characters have more bits than a program word. The upper bits are dropped. This is message 303 \
                  of gpasm and MPASM." },
    DiagnosticCode { code: "ASM046", title: "a value is truncated to its field",
        explain: "A warning: a constant beyond -255 to 255, the number of a bit beyond 0 to 7, or a destination other than 0 and 1. The \
                  instruction gets the bits that fit, as with gpasm and MPASM, whose warning 202 this is. `movlw .1000` loads E8h. \
                  Fix: select a part of the value, as `low(value)` or `value & 0xFF`." },
    DiagnosticCode { code: "ASM047", title: "no register has this address",
        explain: "A warning: file registers are at 000h to 1FFh, and the operand is outside. The instruction gets its lower seven bits, as \
                  with gpasm, whose warning 219 this is. Fix: look for a name that is defined with a wrong number." },
    DiagnosticCode { code: "ASM048", title: "a jump beyond the program memory",
        explain: "A warning: CALL and GOTO contain eleven bits of an address, and PCLATH gives the others. The chip has no \
                  program word at the target, so the processor jumps to another one. gpasm does not report it." },
    DiagnosticCode { code: "ASM049", title: "a name that another module defines",
        explain: "The source declares the name `extern`, and uses it. gplink would take it from another object file or a library, but emu \
                  assembles only one module. Fix: combine the sources with `include`, and remove `extern` and `global`." },
    DiagnosticCode { code: "ASM050", title: "a section that cannot be placed",
        explain: "No memory of the chip has a free block as long as the section, or no memory of its kind: `udata` is in one bank, `code` in one page \
                  of 800h words. `udata_acs`, `idata_acs` and `code_pack` are for chips with 16-bit cores (PIC18). Fix: divide the section \
                  into several, or choose a larger chip." },
    DiagnosticCode { code: "ASM051", title: "operands of an instruction that takes none",
        explain: "A warning: `nop`, `clrw`, `return` and similar instructions take no operands. The assembler ignores the text after them, \
                  as gpasm and MPASM do, whose warning 211 this is. Fix: remove it, or put a `;` before it if it is a comment." },
    DiagnosticCode { code: "ASM052", title: "a test of a name before its definition",
        explain: "A warning: `ifdef` or `ifndef` tests a name that the program defines further down. It is not defined at the test. gpasm reads a source \
                  twice, sees the name as defined in the second pass, and generates other code. Fix: define the name before the test." },
    DiagnosticCode { code: "ASM060", title: "AP101's configuration cannot be read",
        explain: "One of the directives clock, inputs, mode, period, channels, program, module and TIM has no value, or has one that the \
                  machine does not have. docs/formats/asm.md lists them. docs/chips/ap101.md describes their meaning." },
    DiagnosticCode { code: "ASM061", title: "the configuration of AP101 does not have it",
        explain: "A warning: an instruction names a channel beyond those of `channels`, or a timer or counter that no `module` defines. The \
                  machine reads 0 there, and a write does nothing. A `program` that ends after the last word of the source has the same \
                  code; the words between are NOPs. Indexed addresses are not checked. Fix: correct the number, or the directive." },
];
