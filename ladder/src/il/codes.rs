//! Diagnostic codes of Instruction List: IL0xx from the reader, IL1xx from the type check.

diag::codes! {
    /// All diagnostic codes of Instruction List, in order of their numbers.
    IL_CODES;

    IL_TOO_LARGE "IL001" "the program is too large"
        "The size is limited so that a damaged file cannot exhaust the memory of the computer: 4 MiB of text and 20,000 lines of instructions or variables.";
    IL_TOO_MANY_ERRORS "IL002" "further errors are not shown"
        "The reader reports at most 100 errors. Fix: correct these first.";
    IL_OPEN "IL003" "a comment, a pragma or a string has no end"
        "A comment begins with (* and ends with the next *); comments do not nest. A pragma is between { and }; it has no meaning here and is kept as a comment. A string ends on its line. Fix: add the end.";
    IL_CHARACTER "IL004" "unexpected character or word"
        "The line has a character or a word that does not belong there. Instruction List has one instruction on each line: label, operator, operand, comment.";
    IL_STRUCTURED_TEXT "IL005" "this is Structured Text"
        "The text has statements of Structured Text (ST), another language of IEC 61131-3, such as `x := y;` or IF. Only Instruction List is read here. Fix: give a file in IL.";
    IL_NOT_READ "IL006" "a part of IEC 61131-3 is not read"
        "The standard has this part, but this reader does not read it: bodies of functions and blocks, TYPE, CONFIGURATION, arrays, structures, bits of a variable, and lists of instructions as a parameter. Its code differs from that of a syntax error, because the file is not damaged.";
    IL_REFUSED_TYPE "IL007" "a type is not supported"
        "REAL, LREAL, STRING, DATE, TIME_OF_DAY, DATE_AND_TIME and the types of 64 bits exist in IEC 61131-3, but the small chips have no support for them. Fix: use an integer with a scale, or TIME for durations.";
    IL_DECLARATION "IL008" "a declaration is malformed"
        "A section is VAR (or VAR_INPUT, VAR_OUTPUT, VAR_IN_OUT, VAR_GLOBAL, VAR_TEMP), optionally RETAIN or CONSTANT, declarations and END_VAR. A declaration is `name, name AT %QX0.0 : TYPE := value;`. AT takes one name.";
    IL_NAME "IL009" "bad name"
        "A name consists of letters A to Z, digits and `_`, does not begin with a digit, has at most 127 characters and is no keyword. Case has no meaning.";
    IL_NAME_TWICE "IL010" "a name is declared twice"
        "Each variable has one declaration. Case has no meaning: Motor and MOTOR are the same name.";
    IL_LITERAL "IL011" "a literal is malformed"
        "Numbers are 450, -3, 1_000, 2#1010, 8#17, 16#A5; BOOL is TRUE or FALSE; a prefix gives the type: INT#5, BOOL#1, T#500ms.";
    IL_DURATION "IL012" "a duration is malformed"
        "A duration is T# or TIME# and numbers with the units d, h, m, s, ms, us and ns, from the largest to the smallest, each once; `_` can separate them. Only the first number may exceed its unit (T#90m, but not T#1h90m), and only the last may have a fraction.";
    IL_ADDRESS "IL013" "a direct address is malformed"
        "A direct address is % with an area (I input, Q output, M memory), a size (X bit, B 8 bits, W 16 bits, D 32 bits; none means a bit) and one to eight numbers: %IX0.3, %Q0.0, %QW5, %MD4.23.";
    IL_OTHER_NOTATION "IL014" "this is another notation"
        "The file begins like XML (PLCopen, L5X), JSON or the text of LDmicro, not like Instruction List. Fix: give a file in IL.";

    IL_OPERATOR "IL020" "unknown operator"
        "The first word after the label is an operator of IEC 61131-3, an input operator of a block (CU, PT), a timer or counter in the short form (TON T1,100) or a function with operands. Case has no meaning.";
    IL_VENDOR "IL021" "mnemonic of a vendor"
        "The word is an operator of Siemens, Mitsubishi, Omron or Allen-Bradley; the hint gives the one of IEC 61131-3. Some tables print NA for ANDN; Siemens writes AN.";
    IL_MODIFIER "IL022" "the operator does not have this modifier"
        "N (complement) belongs to LD, ST, AND, OR and XOR; C and CN (conditional) to JMP, CAL and RET; `(` (deferred) to AND, OR, XOR, arithmetic and comparisons.";
    IL_OPERAND_MISSING "IL023" "an operand is missing"
        "The operator needs an operand on the same line, as the hint shows.";
    IL_OPERAND "IL024" "wrong operand"
        "The operator takes another kind of operand: JMP a label, CAL an instance, ST, S and R a variable or an address. NOT, RET and `)` take none.";
    IL_STORE_LITERAL "IL025" "a literal cannot be written"
        "ST, S, R and outputs of a call write a variable or a direct address. A literal has no place in memory.";
    IL_EXTRA "IL026" "more than one instruction on a line"
        "Each instruction begins on a new line (reference 001). Text after an instruction must be a comment.";
    IL_PARAMETER "IL027" "a parameter is malformed"
        "Parameters are separated by commas: `x`, `PT := x`, `Q => x` or `NOT Q => x`. A call has either positional or named parameters, and each name once.";

    IL_LABEL "IL030" "bad label"
        "A label begins with a letter, has letters, digits and `_`, and at most 16 characters (reference 001).";
    IL_LABEL_TWICE "IL031" "a label occurs twice"
        "A program cannot have two labels of the same name (reference 001). Case has no meaning.";
    IL_NO_LABEL "IL032" "a jump to an unknown label"
        "JMP needs a label that exists in the same program.";
    IL_JUMP_PARENTHESIS "IL033" "a jump crosses a parenthesis"
        "An operation waits between `(` and `)`. A jump into the parentheses would find nothing that waits, and a jump or RET out of them would leave something waiting.";
    IL_DEPTH "IL034" "parentheses are nested too deep"
        "Operators with `(` can be nested to a depth of 64.";
    IL_UNCLOSED "IL035" "a parenthesis is not closed"
        "Each operator with `(` needs a `)` on a later line.";
    IL_UNOPENED "IL036" "a closing parenthesis without an opening one"
        "A line `)` executes the operator with `(` that waits. None waits here.";
    IL_NO_BLOCK "IL037" "a call of something that is no block"
        "CAL, the input operators and the short form take an instance of a function block: declare it, for example `T1 : TON;`.";

    IL_NO_TARGET "IL038" "S or R without an operand"
        "A warning: the grammar of IEC 61131-3 (annex B.2.1) allows S and R alone, but they name nothing to set or reset, so the line does nothing. Fix: add the variable, or delete the line.";
    IL_NO_INSTRUCTION "IL039" "a program without instructions"
        "A warning: the file has only declarations, comments or nothing, so there is nothing to run. Fix: give a file with instructions.";

    IL_UNDECLARED "IL101" "a name is not declared"
        "If a program declares variables, it must declare every name that it uses. A program without declarations (as in reference 001) may use any name.";
    IL_TYPE "IL102" "wrong type"
        "The operator does not take the type of the current result or of its operand, or the two types differ. IEC 61131-3, edition 2, converts no type implicitly. Fix: use a conversion such as INT_TO_DINT.";
    IL_RANGE "IL103" "a literal is out of range"
        "The number does not fit the type of its prefix, or the type with which it is used.";
    IL_READ_ONLY "IL104" "the variable cannot be written"
        "The program reads inputs (VAR_INPUT, %I) and constants, and outputs of a block. It cannot write them.";
    IL_NOT_LOADED "IL105" "the current result has no value"
        "The operator uses the current result before anything is loaded: at the beginning of the program, or after a `(` without operand. Fix: begin with LD.";
    IL_AFTER_CALL "IL106" "the current result is used after CAL"
        "A warning: IEC 61131-3 does not define the current result after CAL. Fix: load it again.";
    IL_MIXED "IL107" "the current result has several types"
        "A note: the paths to this label leave results of different types, or of none. Fix: load a value after the label.";
    IL_BLOCK_PART "IL108" "the block has no such input or output"
        "The name is not an input or output of the block, or the call gives too many parameters.";
    IL_FUNCTION "IL109" "unknown function or block"
        "The function or the type of the block is not a standard one, and bodies by users are not read.";
    IL_ARGUMENTS "IL110" "wrong number of arguments"
        "The function takes another number of arguments. Without parentheses the current result is the first one.";
    IL_LOCATION "IL111" "the address does not fit the type"
        "The size letter of the address after AT must have as many bits as the type: X for BOOL, B for 8 bits, W for 16, D for 32. A block has no address.";

    IL_NOT_RUN "IL201" "a part that does not run here"
        "The program is sound, but this part has no meaning here: VAR_TEMP, a label inside parentheses, two variables at one address, one name for two blocks, or the short form of a block without a preset.";
    IL_MILLISECONDS "IL202" "a duration that no timer can count"
        "Timers count whole milliseconds in 32 bits: up to T#24d20h31m23s647ms. Fix: give a duration without microseconds.";
    IL_CYCLE "IL203" "the cycle does not fit the timers"
        "TON, TOF, TP, TONA and TOFA count milliseconds, so a scan must take whole milliseconds. Fix: give such a cycle with --cycle.";
    IL_NUMBER_AT_PIN "IL204" "a number at an address of pins"
        "A note: %I and %Q are the pins of a controller, and a pin holds one bit. A number at such an address is a variable without a pin; addresses do not overlap.";
    IL_RETAIN "IL205" "RETAIN has no effect"
        "A note: at power-up every variable has its initial value here, also one with RETAIN.";
    IL_UNREACHED "IL206" "a line that is never reached"
        "The line follows a JMP or RET without a condition and has no label to which a jump leads.";
}
