//! The codes of the assembler's diagnostics.

use diag::DiagnosticCode;

/// All codes. ASM040 to ASM059 belong to the PIC16 dialect, ASM060 to ASM079 to that of AP101.
#[rustfmt::skip]
pub const CODES: &[DiagnosticCode] = &[
    DiagnosticCode { code: "ASM001", title: "unknown mnemonic",
        explain: "The word is no instruction of this chip, no directive of its dialect, and no macro that was defined before this \
                  line. docs/isa lists the instructions, docs/formats/asm.md the directives. A label in front of an instruction \
                  needs a colon in most dialects. Mend: correct the word, or give the chip that has the instruction." },
    DiagnosticCode { code: "ASM002", title: "operands fit no form of the instruction",
        explain: "The instruction exists, but not with operands of these kinds, this number or this order. The hint lists its forms; \
                  lower-case letters stand for operands, everything else is written as shown. Example: `mov @r0,@r1` on the 8051." },
    DiagnosticCode { code: "ASM003", title: "operand out of range",
        explain: "The operand has the right kind but the instruction or directive has no room for this value: `ldi` takes r16 to r31, \
                  a relative branch reaches 64 words, a constant byte is -128 to 255. The message says what is allowed. Mend: use a \
                  value in range, take the part that is meant with low() or &, or an instruction that reaches further." },
    DiagnosticCode { code: "ASM004", title: "empty line",
        explain: "There is nothing to assemble on the line but a comment or white space." },
    DiagnosticCode { code: "ASM005", title: "a line or an expression cannot be read",
        explain: "A value, an operator or a bracket is missing or stands where none can stand. A line is `label: word operands ; \
                  comment`; operators and their order are those of the family's usual assembler and are listed in \
                  docs/formats/asm.md." },
    DiagnosticCode { code: "ASM006", title: "a name is not defined",
        explain: "The name is no label, no name given with equ, set or =, and no register, bit or constant of the chip. Names of \
                  the program are the same in upper and lower case on the 8051 and AP101 and differ on AVR and PIC16. Mend: \
                  correct the name, define it, or include the file that does." },
    DiagnosticCode { code: "ASM007", title: "a name is defined twice",
        explain: "A label, or a name given with equ, has one value in the whole program. The message says where the other \
                  definition stands. Mend: choose another name; labels within macros are made different for each call with \
                  `local`, or with \\@; a value that changes is given with set." },
    DiagnosticCode { code: "ASM008", title: "a register of the core in the place of a number or a label",
        explain: "Words such as A, DPTR, r16 or X belong to the instructions. They can stand in no expression and cannot be labels. \
                  Mend: choose another name. A register can be given a name of its own: `count equ r7`." },
    DiagnosticCode { code: "ASM009", title: "division by zero",
        explain: "The right side of / or of the remainder is 0." },
    DiagnosticCode { code: "ASM010", title: "a number cannot be read",
        explain: "A number has a digit that its radix does not have, a form that the family does not know, or more than 32 bits. \
                  Hexadecimal is written 0x1F everywhere; docs/formats/asm.md lists the other forms. On PIC16 numbers without a \
                  mark are hexadecimal unless `radix dec` says otherwise, and begin with a digit." },
    DiagnosticCode { code: "ASM011", title: "a text or character cannot be read",
        explain: "A quote is not closed, is empty, or a text stands where a number is wanted. Characters stand in single quotes, \
                  texts in double ones; a quote inside is written with a backslash." },
    DiagnosticCode { code: "ASM012", title: "if, else and endif do not match",
        explain: "Every if, ifdef or ifndef ends with endif in the same file, or in the same macro, and has at most one else." },
    DiagnosticCode { code: "ASM013", title: "a macro or repetition is not closed, or closed without a beginning",
        explain: "A macro ends with endm, a repetition with endr or endm, a while with endw, in the same file." },
    DiagnosticCode { code: "ASM014", title: "macros are nested too deep",
        explain: "A macro calls itself, or others that do, without a condition that ends it; 64 calls within each other are taken. \
                  A text of #define that doubles itself is told by the same code." },
    DiagnosticCode { code: "ASM015", title: "a file cannot be included",
        explain: "The file does not exist or cannot be read, or it is one for another chip. Paths count from the file that includes. \
                  Files that list a chip's registers (avr/io.h, m328Pdef.inc, p16f873.inc, reg52.inc) need not exist: the chip \
                  gives those names anyway." },
    DiagnosticCode { code: "ASM016", title: "includes are nested too deep",
        explain: "A file includes itself, or others that do; 32 includes within each other are taken." },
    DiagnosticCode { code: "ASM017", title: "the program grows too large",
        explain: "Macros, repetitions and includes come to more than 1,000,000 lines, a `while` to more than 65,536 turns, or the bytes to more than 16 MB. Mend: look for a \
                  repetition with a wrong count or a macro that goes on for ever." },
    DiagnosticCode { code: "ASM018", title: "values do not settle",
        explain: "The source is read again until no name moves. Here the place of something hangs on a name whose value hangs on that \
                  place, as in `org x` with `x: equ $+1`, and in 20 passes nothing more has settled (or 1000 were not enough); or names hang on each other in a circle. Mend: give one of them a plain number." },
    DiagnosticCode { code: "ASM019", title: "two parts of the program overlap",
        explain: "Something was put at an address before. The message says by which line. Mend: move one of them with org." },
    DiagnosticCode { code: "ASM020", title: "there is no memory here",
        explain: "The program puts bytes where the chip has no memory that an image fills: behind the end of program memory, or in RAM. \
                  Mend: make the program smaller, take a larger chip, correct org, or reserve RAM with ds (res on the PIC16)." },
    DiagnosticCode { code: "ASM021", title: "a word has bits that its memory has not",
        explain: "Program words of the PIC16 have 14 bits, so nothing above 3FFFh can lie there." },
    DiagnosticCode { code: "ASM022", title: "an instruction at an odd address",
        explain: "Instructions of the AVR stand at even byte addresses, and an odd number of data bytes lies before this one. Mend: put \
                  `.balign 2` in front of it." },
    DiagnosticCode { code: "ASM023", title: "a directive lacks something",
        explain: "The directive needs a name, a value or a word that is not there, or has too many. docs/formats/asm.md says what each takes." },
    DiagnosticCode { code: "ASM024", title: "the program says that it is wrong",
        explain: "The source has an `error` directive here, most often behind a condition that its author wanted to hold." },
    DiagnosticCode { code: "ASM025", title: "the program warns",
        explain: "The source has a `warning` directive here." },
    DiagnosticCode { code: "ASM026", title: "the chip does not have the instruction",
        explain: "Smaller chips of a family lack some instructions: jmp and call come with more than 8 KB of flash, elpm with more than \
                  64 KB. Mend: rjmp and rcall reach all of a small chip." },
    DiagnosticCode { code: "ASM027", title: "a directive without effect",
        explain: "A note: the directive is for a linker or a listing of another assembler, and nothing follows from it here." },
    DiagnosticCode { code: "ASM029", title: "more errors, or more warnings and notes",
        explain: "At most 100 errors are shown, and 100 warnings and notes; this note counts the others. `errorlevel -302` in a source of PIC16 leaves out \
                  the notes of registers in other banks." },
    DiagnosticCode { code: "ASM030", title: "a value is cut off",
        explain: "A warning: a value of db or dw has more bits than the place for it, and only the lower ones are kept. Mend: write the part \
                  that is meant with low() or &." },
    DiagnosticCode { code: "ASM031", title: "org in a section that lies behind others",
        explain: "The linker puts the sections of the AVR behind each other: .vectors, .progmem, .init0 to .init9, .text, .fini9 to .fini0, and \
                  .data, .rodata, .bss, .noinit in RAM. Where such a section begins is known only when those before it are full, so \
                  org in it would mean nothing certain. Mend: reserve room with .space, or take .balign; in the first section that is used \
                  org counts from 0." },
    DiagnosticCode { code: "ASM035", title: "a file in an encoding that is not read",
        explain: "Sources are UTF-8, of which ASCII is a part. The first bytes of this file say that it is UTF-16, as some editors \
                  save texts. Mend: save it as UTF-8." },
    DiagnosticCode { code: "ASM036", title: "a name of another module",
        explain: "A warning: the source is one module of a program for sdas8051, and no line of it gives this name. sdld puts 0 in its \
                  place, and so does emu: the program runs up to the first use of it. Other modules are not read. Mend: link all \
                  modules with sdcc or sdld, and load the HEX file that comes of it." },
    DiagnosticCode { code: "ASM037", title: "no room for an area",
        explain: "The areas of a source for sdas8051 are placed as the linker sdld does it: DSEG, OSEG and ISEG each in the first gap of \
                  RAM that holds the whole area, SSEG in the largest one, bits in the bytes 20h to 2Fh. No gap is large enough for \
                  this one. Mend: reserve less, or move it to XDATA." },
    DiagnosticCode { code: "ASM038", title: "areas share memory",
        explain: "A warning: the linker sdld puts an area where another one lies, without a word. It knows the areas of RAM by the names \
                  that SDCC gives them (DSEG, OSEG, ISEG, SSEG, BSEG, BIT_BANK, REG_BANK_0 to 3); one of another name begins behind \
                  the register banks whatever lies there. Mend: put its bytes into DSEG, or give it the attribute ABS and an \
                  address by .org. Also told of an area with PAG on two pages of 256 bytes." },
    DiagnosticCode { code: "ASM039", title: "a byte where a bit is wanted, or a bit for a byte",
        explain: "A warning: `cpl P1` changes bit 0 of P1 alone, as P1 and P1.0 have the same address, and `mov a,TI` reads SBUF, the byte at \
                  the address of the bit. as31 and sdas8051 take both without a word, AX51 and ASEM-51 refuse them. Also told of labels of \
                  the program in front of which a `#` is missing. Fix: name the bit, or use an instruction for bytes." },
    DiagnosticCode { code: "ASM040", title: "instruction in column 1",
        explain: "Words in column 1 are labels, unless an instruction has that name; then it is taken as one, and told. \
                  gpasm and MPASM call this warning 203." },
    DiagnosticCode { code: "ASM041", title: "directive in column 1",
        explain: "As ASM040, for a directive; warning 205 of gpasm and MPASM." },
    DiagnosticCode { code: "ASM042", title: "register not in bank 0",
        explain: "The operand is the address of a register in bank 1, 2 or 3, of which the instruction holds the lower \
                  seven bits. It reaches the register only where RP0 and RP1 of STATUS select that bank; `banksel` \
                  writes the instructions that do. Message 302 of gpasm and MPASM." },
    DiagnosticCode { code: "ASM043", title: "source for another chip",
        explain: "A line `list p=..` or `processor ..` names another chip than the one that the source is assembled for. \
                  Registers and memory may differ." },
    DiagnosticCode { code: "ASM044", title: "nothing to select",
        explain: "The chip has one page of program memory, so `pagesel` writes nothing. Message 312 of gpasm and MPASM." },
    DiagnosticCode { code: "ASM045", title: "word cut",
        explain: "A value or two characters have more bits than a program word; the upper ones are left out. Message 303 \
                  of gpasm and MPASM." },
    DiagnosticCode { code: "ASM046", title: "a value is cut to its field",
        explain: "A warning: a constant beyond -255 to 255, the number of a bit beyond 0 to 7, or a destination other than 0 and 1. The \
                  instruction gets the bits that fit, as with gpasm and MPASM, whose warning 202 this is. `movlw .1000` loads E8h. \
                  Fix: write the part that is meant, as `low(value)` or `value & 0xFF`." },
    DiagnosticCode { code: "ASM047", title: "no register has this address",
        explain: "A warning: file registers lie at 000h to 1FFh, and the operand lies elsewhere. The instruction gets its lower seven bits, as \
                  with gpasm, whose warning 219 this is. Fix: look for a name that was given with a wrong number." },
    DiagnosticCode { code: "ASM048", title: "a jump behind the program memory",
        explain: "A warning: CALL and GOTO hold eleven bits of an address, and PCLATH gives the rest. The target lies where the chip has no \
                  program word, so the processor goes to another one. gpasm does not report it." },
    DiagnosticCode { code: "ASM049", title: "a name that another module gives",
        explain: "The source says `extern` of the name, and uses it. gplink would take it from another object file or a library; one \
                  module is assembled here. Fix: put the sources together with `include`, and take `extern` and `global` away." },
    DiagnosticCode { code: "ASM050", title: "a section that cannot be placed",
        explain: "No memory of the chip has a free stretch as long as the section, or no memory of its kind: `udata` lies in one bank, `code` in one page \
                  of 800h words. `udata_acs`, `idata_acs` and `code_pack` are of chips with 16-bit cores (PIC18). Fix: divide the section \
                  into several, or take a larger chip." },
    DiagnosticCode { code: "ASM051", title: "operands of an instruction that takes none",
        explain: "A warning: `nop`, `clrw`, `return` and their like take no operands, and what is written behind them is left out, as with gpasm \
                  and MPASM, whose warning 211 this is. Fix: take it away, or put a `;` before it if it is a comment." },
    DiagnosticCode { code: "ASM052", title: "a name is asked for above the line that gives it",
        explain: "A warning: `ifdef` or `ifndef` asks for a name that the program gives further down. It is not defined there. gpasm reads a source \
                  twice, takes the name as defined the second time, and makes other code of it. Fix: give the name above the line." },
    DiagnosticCode { code: "ASM060", title: "AP101's configuration cannot be read",
        explain: "One of the directives clock, inputs, mode, period, channels, program, module and TIM lacks a value or has one that the \
                  machine does not have. docs/formats/asm.md lists them; docs/chips/ap101.md says what they mean." },
    DiagnosticCode { code: "ASM061", title: "the configuration of AP101 does not have it",
        explain: "A warning: an instruction names a channel beyond those of `channels`, or a timer or counter that no `module` gives. The \
                  machine reads 0 there, and writing does nothing. Also told of a `program` that ends behind the last word of the \
                  source; the words between are NOPs. Mend: correct the number, or the directive. Indexed addresses are not looked at." },
];
