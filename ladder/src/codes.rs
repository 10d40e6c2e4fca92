//! Diagnostic codes of this crate: LD0xx from the reader, LD1xx from the checks.

diag::codes! {
    /// All diagnostic codes of this crate, in order of their numbers.
    CODES;

    EMPTY "LD001" "the file is empty"
        "The file is empty, or has only blank lines and lines that start with `;`. A program begins with the line LDmicro0.1 or LDmicro0.2.";
    BINARY "LD002" "the file is not text"
        "The file contains a control character, or characters of two bytes (UTF-16). A .ld file is plain text, in UTF-8 or an 8-bit code page. Perhaps you gave the name of an image or an executable. Fix: save a UTF-16 file as UTF-8.";
    BOM "LD003" "the file begins with a byte order mark"
        "A note: an editor put the invisible mark U+FEFF before the header. emu ignores it, but LDmicro does not read such a file. Fix: save it as UTF-8 without the mark.";
    NO_HEADER "LD004" "the header is missing"
        "The first line that is not blank must be LDmicro0.1, LDmicro0.2 or, from LDmicro 5.4, LDmicro alone. It sets the default dialect: 0.1 means ldmicro-2.3, all others mean ldmicro-5. Another text after LDmicro is a note: as in LDmicro 5 it means 0.2.";
    TOO_LARGE "LD005" "the program is too large"
        "The size is limited so that a damaged file cannot exhaust the memory of the computer: 4 MiB of text, 2,000 rungs, 20,000 elements, 4,000 lines in a list. LDmicro 2.3 itself has a limit of 99 rungs.";
    UNKNOWN_SETTING "LD006" "unknown line before PROGRAM"
        "The lines before PROGRAM are MICRO=, CYCLE=, CRYSTAL=, BAUD=, COMPILER=, COMPILED= and the lists IO LIST, VAR LIST and PULL-UP LIST. Spelling and capitals matter. In `ldmicro-5` another line is a warning, because LDmicro 5 ignores it.";
    SETTING_MISSING "LD007" "CYCLE= or CRYSTAL= is missing"
        "Timers count scans, so they need the time of a scan (CYCLE=, microseconds) and the clock (CRYSTAL=, Hz). There is no default, because it would change every delay.";
    SETTING_NUMBER "LD008" "a setting is not a number in its range"
        "CYCLE= takes microseconds (optionally followed by `us ..`; another text is a warning, because it has no effect), CRYSTAL= and BAUD= take Hz (optionally followed by `Hz ..`). All are decimal, at most 1,000,000,000,000; CRYSTAL is at least 1. In `ldmicro-5` a CYCLE= without a number is 10000 (warning).";
    SETTING_TWICE "LD009" "a setting or list occurs twice"
        "Each setting and each list may occur once. With two lines of one name it would be unclear which one counts.";
    IO_LINE "LD010" "a line of IO LIST is malformed"
        "A line of IO LIST has the form `name at pin`, in LDmicro 5 `name at pin slave address`. Pins are 0 (not assigned) to 255, slaves 0 to 255, addresses 0 to 65535. emu skips another line with a warning. Text after the numbers is a note, because it has no effect.";
    IO_NAME_TWICE "LD011" "a name occurs twice in IO LIST"
        "A symbol has one pin. Remove one of the lines.";
    PIN_TWICE "LD012" "two names at one pin"
        "Two symbols are assigned to the same package pin, which cannot serve both. Pin 0 means not assigned and may occur several times.";
    IO_KIND "LD013" "a name of IO LIST is neither input, output nor analog"
        "The first letter gives the kind: X input, Y output, A analog, in ldmicro-5 also P pulse width output. emu keeps the line and writes it back, but it has no effect here. In ldmicro-5 the kinds of Modbus, SPI and I2C are a note.";
    LIST_LINE "LD014" "a line of VAR LIST or PULL-UP LIST is malformed"
        "VAR LIST takes `n bytes name` with n from 1 to 4, or `name signed n bit variable` with n one of 8, 16, 24, 32, and any text after it. Other widths, names that no element can have (`#PORTB`, `148`), repeated names, remarks, lines of more than 63 characters and widths that a timer or counter does not keep are notes: LDmicro 5 gives 2 bytes to widths above 4, and the last line of a name counts. PULL-UP LIST takes a port, a colon and a mask, such as `PB: 0x0F`. A line without effect is a note or a warning. A port that the chip of MICRO= cannot have is an error.";
    LIST_OPEN "LD015" "a list is not closed"
        "IO LIST, VAR LIST and PULL-UP LIST end with a line END before the next section starts.";
    NO_PROGRAM "LD016" "the line PROGRAM is missing"
        "After the settings and lists the line PROGRAM starts the rungs. Without it there is nothing to run.";
    OUTSIDE_RUNG "LD017" "an element is outside a rung"
        "After PROGRAM there are only rungs: RUNG, its elements, END. For LDmicro 5 a line that only contains RUNG begins a rung (note).";
    REWRITTEN "LD018" "writing the program back changes this line"
        "The program is valid, but the writer writes this line differently (text after the header, leading zeros, other order of the settings, no IO LIST). The meaning does not change.";
    TOO_MANY_ERRORS "LD019" "further errors are not shown"
        "The reader reports at most 100 errors. Fix: correct these first.";
    UNKNOWN_KEYWORD "LD020" "unknown keyword"
        "The first word of a line in a rung is the keyword of an element, or PARALLEL, SERIES or END. Keywords are in capitals.";
    LDMICRO5_ONLY "LD021" "known in LDmicro 5, not supported here"
        "The keyword (or a special register, `#name`) exists only in LDmicro 5 and has no meaning here. Its code differs from that of a misspelt keyword, because the file is not damaged.";
    TOO_FEW "LD022" "too few arguments"
        "Every element has a fixed list of arguments, which the hint shows. Both headers accept the longer lists of LDmicro 5. In ldmicro-5 missing flags of COIL and a missing resolution of SET_PWM are notes.";
    TOO_MANY "LD023" "too many arguments"
        "Every element has a fixed list of arguments, which the hint shows. A table gives the number of its values itself. In ldmicro-5 words after RUNG or after the last argument are a note: they have no effect.";
    NOT_A_NUMBER "LD024" "not a number"
        "A number is decimal with an optional minus sign, 0x hexadecimal, 0o octal, 0b binary, or a character such as 'a' or '\\n'. In ldmicro-5 a constant has the meaning of C's strtol: 017 is octal (a note), 0o17 and 0b101 are 0, and 5abc is 5 (warnings). The name of a pin in IO LIST is a warning, and the pin is not assigned.";
    OUT_OF_RANGE "LD025" "number out of range"
        "Constants are -32768 to 32767, in ldmicro-5 -2147483648 to 2147483647. Flags are 0 or 1 (in ldmicro-5 any other number is 1, a note), character codes 0 to 255 (LDmicro writes letters beyond ASCII as -128 to -1, a note in ldmicro-5 and a warning in ldmicro-2.3, where they are X), pins 0 to 255, delays 0 to 1,000,000,000,000 microseconds, stages 1 to 256. Modbus numbers of IO LIST that are too large are truncated to 8 and 16 bits with a warning.";
    BAD_NAME "LD026" "bad characters in a name"
        "A name consists of the letters A to Z and a to z, digits and underscores, does not begin with a digit and has at most 127 characters. Capitals matter. In IO LIST emu skips such a line with a warning.";
    CONTACT_KIND "LD027" "a contact needs an X, Y or R name"
        "A contact tests one bit: an input X.., an output Y.. or a relay R... Use the comparisons (EQU, GEQ, ..) for timers, counters and other integers.";
    INTEGER_ON_BIT "LD028" "an integer element on the name of a bit"
        "Names that begin with a capital X, Y or R are bits. Elements that read or write integers need another name.";
    CONSTANT_TARGET "LD029" "a constant instead of a variable"
        "The element writes the first argument of MOVE, ADD and similar elements, so it must be the name of a variable.";
    BIT_AND_INTEGER "LD030" "one name as bit and as integer"
        "A contact, a coil or IO LIST uses the name as one bit, and this element uses it as an integer. These would be two different symbols with one name.";
    UNCLOSED "LD031" "RUNG, PARALLEL or SERIES is not closed"
        "Every RUNG, PARALLEL and SERIES needs its own END. The place is that of the opening line.";
    STRAY_END "LD032" "END without a beginning"
        "No group is open that this END could close. Perhaps there is an extra END above.";
    EMPTY_GROUP "LD033" "RUNG, PARALLEL or SERIES is empty"
        "Each rung and each branch contains at least one element. Write SHORT for a closed connection or OPEN for an open one. In ldmicro-5 an empty rung does nothing and is a note.";
    NESTING "LD034" "SERIES and PARALLEL must alternate"
        "A rung is a series: it may contain PARALLEL, whose branches are single elements or SERIES, which may contain PARALLEL again. LDmicro has no SERIES directly in a rung or SERIES, and no PARALLEL directly in PARALLEL.";
    COIL_KIND "LD035" "a coil needs a Y or R name"
        "A coil writes one bit: an output Y.. or a relay R... The environment sets an input X.., and MOVE and the arithmetic elements write integers.";
    TOO_DEEP "LD036" "nested too deeply"
        "At most 64 groups may be nested. Split the rung, and pass the state between the parts in relays.";
    BAD_STRING "LD037" "FORMATTED_STRING without its text"
        "There are two forms: a length followed by as many decimal character codes, or (LDmicro 5) one text between double quotes.";
    TAKEN_AS_LDMICRO5 "LD038" "treated as a program of LDmicro 5"
        "A note: the header is that of release 2.3, but the file has something that only LDmicro 5 writes: an element, an argument more, a CTC that is not last in its rung, VAR LIST, PULL-UP LIST, COMPILER=, a unit after a number of the head, Modbus numbers, a number after RUNG. The program therefore has the meaning of the dialect ldmicro-5. Choose a dialect on the command line to override this.";
    REGISTER_ADDRESS "LD039" "a register is named by its address"
        "A note: `#0x25` and the like are addresses in the data memory of the chip that MICRO= names. Those of the registers of ports are read as their names #PORTx, #PINx, #TRISx; others have no meaning here.";
    OTHER_NOTATION "LD040" "a notation that is not read"
        "The file is a program in a notation that emu recognises by its content but does not read: Structured Text, or ladder as JSON of another editor than OpenPLC Editor 4. The file is not damaged. --format names the notations that are read: LDmicro's .ld text, Instruction List, PLCopen XML, OpenPLC Editor 4, neutral text of Allen-Bradley, grids of CSLadder.";
    IGNORED_SETTING "LD041" "a setting that has no effect here"
        "A note: YPlcCycleDuty:1 (an output that shows how long a scan takes), ConfigurationWord(s) (compiled images have the word that LC041 names), a MICRO= that is no name of LDmicro's list, and a mask of PULL-UP LIST that leaves an input without its pull-up: compiled images turn on the pull-ups of all inputs that have one.";
    DRAWING "LD042" "the wires of a diagram are not sound"
        "In a graphical notation every contact, coil and block has a connection on its left side that comes from the left power rail, no wire leads around to its own beginning, and branches are nested at most 64 deep. A diagram has at most 5,000 elements.";
    XML "LD043" "an XML or JSON file is damaged"
        "The file is XML or JSON by its first character, but a tag, an attribute, an entity or a bracket is wrong, or the file ends too early. Files are read up to 4 MiB, 200,000 elements and a depth of 64.";
    PART_NOT_READ "LD044" "a part of this notation is not read"
        "The file is sound, but has something that no program here can have: bodies in Structured Text, FBD or SFC, functions and function blocks by the user, several programs, arrays and structures, instructions of a vendor that the page of the notation does not list. The message names it. docs/languages/ says what is read.";
    NEUTRAL_TEXT "LD045" "neutral text of Allen-Bradley is malformed"
        "A rung is instructions with their operands, such as XIC(a), and branches [..,..] or BST .. NXB .. BND, up to 64 deep, and ends with `;` or EOR. The message says what is missing, and where.";
    OLD_KEYWORD "LD046" "an older name of an element"
        "A note: LDmicro 5 reads UART_SEND_BUSY and UART_UDRE as UART_SEND_READY, and writes that name.";
    TIMER_RANGE "LD101" "a delay cannot be counted"
        "A timer counts scans: P = delay / cycle, rounded down, less 1, and P must be 1 to 32767. Shorter delays are less than two scans, longer ones do not fit 16 bits. In ldmicro-5 the adjust replaces the 1, a timer with P under 1 expires at once, and one with P beyond its width never expires: both are warnings. Change the delay or CYCLE=.";
    NOT_LAST "LD102" "an element of the right rail is not last"
        "Coils, RES, MOVE, arithmetic, elements that write bits, SHIFT_REGISTER, the tables, READ_ADC, SET_PWM, MASTER_RELAY and PERSIST usually end their path to the right rail. If another element follows, they pass on the power that they get, as in LDmicro's own code.";
    PLACEHOLDER "LD103" "a placeholder remains"
        "LDmicro's editor shows PLACEHOLDER until an element is chosen. The program is not complete.";
    CYCLE_ZERO "LD104" "the scan has no fixed time"
        "With CYCLE=0 LDmicro 5 scans as fast as possible. Timers and the comparison scan by scan need a fixed time.";
    FLAG_LDMICRO5 "LD105" "a flag of LDmicro 5 is set"
        "The third argument of CONTACTS (the input begins as 1 in LDmicro's simulator) and the fifth of COIL (toggle on a rising edge) have a meaning only in the dialect ldmicro-5. In other dialects they must be 0.";
    COIL_FLAGS "LD106" "more than one flag of a coil"
        "A coil is plain, negated, set-only, reset-only or toggling; at most one of the flags may be 1. In ldmicro-5 this is a warning, and the first of negated, set, reset, ttrigger counts.";
    ELEMENT_LDMICRO5 "LD107" "an element that only LDmicro 5 has"
        "The element does not exist in release 2.3, but the dialect of this program is ldmicro-2.3. Choose ldmicro-5.";
    NOT_RISING "LD109" "the x values of PIECEWISE_LINEAR do not rise"
        "The element searches the points from left to right, so each x must be greater than the previous one.";
    ARGUMENT_LDMICRO5 "LD110" "an argument that only LDmicro 5 understands"
        "Every dialect accepts the longer argument lists, but in ldmicro-2.3 their values must match the behaviour of release 2.3: adjust -1, start value 0 on rising edges, constants for delays and limits, one byte without waiting. In ldmicro-5 a variable as the adjust, the reference of READ_ADC, the resolution of SET_PWM, more bytes than the integer has, and waiting for bytes have no meaning here. The hint says what to write in their place.";
    STRING_ESCAPE "LD111" "an invalid escape in FORMATTED_STRING"
        "A backslash begins one of \\r \\n \\b \\f \\t \\v \\a \\\\, \\x with two hexadecimal digits, or the place of a number: \\1 to \\5 for as many digits, \\-1 to \\-5 for a sign and as many digits. A text may contain one number. A character that code page 1252 does not have is not a single byte.";
    STRING_VARIABLE "LD112" "FORMATTED_STRING and its variable do not fit"
        "A text with the place of a number (\\5, \\-5) needs the variable of that number. A text without one takes (none).";
    CURVE "LD113" "PIECEWISE_LINEAR cannot be computed"
        "The value between two points is y + (index - x) * dy / dx, computed in 16 bits (in 32 if LDmicro 5's widths require it). So there must be at least two points, and for each two neighbours dx and dx * dy must fit.";
    PWM "LD114" "SET_PWM without one frequency for each output"
        "The frequency of SET_PWM is a constant of at least 1 Hz, and all SET_PWM of an output name the same; the duty may differ. SET_PWM without a name have one output; then all SET_PWM of the program are without a name.";
    NO_BAUD "LD115" "the serial line has no rate"
        "UART_SEND, UART_RECV and FORMATTED_STRING need BAUD= above the lists, because it determines how many scans a byte takes.";
    SHIFT_COUNT "LD116" "a shift by more bits than there are"
        "A constant count of SHL, SHR, SR0, ROL and ROR is 0 to the number of bits of the shifted value: 8, 16, 24 or 32 by its width. A count in a variable may have any value: 0 and less shift nothing, more bits than there are shift all bits out.";
    COIL_TWICE "LD120" "a coil is driven twice"
        "Two elements write the bit in each scan, so the last one wins and the other has no lasting effect. A set coil together with a reset coil is the usual latch and is not reported.";
    NEVER_DRIVEN "LD121" "a contact is never driven"
        "No coil writes the bit, so the contact is always 0. Often the name is misspelt.";
    SHARED "LD122" "a timer or counter is shared"
        "Two elements use one accumulator. Timers disturb each other. An up and a down counter on one name is LDmicro's usual way to count both ways, with separate edge memories.";
    TRUNCATED "LD123" "the delay is not a multiple of the cycle"
        "The delay is rounded down to whole scans, so the timer ends early.";
    RES_TARGET "LD124" "RES of something that is not a timer or counter"
        "RES stores 0. For a plain variable MOVE is clearer. Often the name is misspelt.";
    TABLE_ALIAS "LD125" "a table writes its own index"
        "Here the element reads the index once, before it stores the result. The code of LDmicro's compilers reads it again and gives a wrong value.";
    DIVISION_BY_ZERO "LD126" "division by the constant 0"
        "The quotient is -1 for a dividend of 0 or more, and 1 for a negative one. The remainder (MOD) is the dividend. This is usually a mistake.";
    STRING_CODE "LD127" "a character code under 32 in FORMATTED_STRING"
        "LDmicro reads such a code as the letter X. Use a backslash escape, written as two codes (92 and the letter).";
    NO_PORT_PIN "LD128" "not a port pin of this package"
        "IO LIST gives package pins of the chip of MICRO=. This pin is a supply, reset or clock pin there, or does not exist.";
    NO_SUCH_BIT "LD129" "a bit that the integer does not have"
        "SET_BIT and CLEAR_BIT of a bit beyond the width of the integer, or of a negative number, do nothing. IF_BIT_SET and IF_BIT_CLEAR read the sign there, and 0 for a negative number.";
    OUTPUTS_DIFFER "LD130" "outputs of LDmicro 5 disagree about this element"
        "A note: LDmicro 5's simulator, C, AVR and PIC code handle this element differently. The message names those that differ from emu.";
    PULSE_FREQUENCY "LD131" "a frequency that NPULSE cannot make"
        "The pulses of NPULSE change from scan to scan, so half a pulse takes at least one scan: the frequency is a constant from 1 Hz to 500000 / CYCLE=. LDmicro 5 has a timer for it on some AVR chips, and refuses the element on PIC and in C. For a faster signal use SET_PWM, which has a timer of its own.";
    NARROW_TARGET "LD132" "a constant that the variable cannot hold"
        "MOVE stores the low bytes of the constant, so the variable gets another number. The width is that of VAR LIST or, for a timer or counter, that of its constants. Fix: a wider variable.";
    REGISTER "LD141" "a register of a port cannot be used like this"
        "#PORTx, #PINx and #TRISx name the latch, the levels and the directions of port x of the chip that MICRO= names; the chip must have the port. #PINx is read only. #TRISx needs a known chip, since 0 is an output on PIC and an input on AVR.";
    DIRECTION "LD142" "a direction that means the opposite on the other family"
        "#TRISx is TRISx on PIC, where a 0 makes an output, and DDRx on AVR, where a 1 does. So MOVE #TRISB 0 makes port B outputs on PIC and inputs on AVR. A warning on AVR, where it stores 0.";
    REGISTER_EFFECT "LD143" "a register of a port that reaches no pin"
        "#PORTx changes no direction: pins that neither IO LIST (a Y) nor #TRISx makes outputs stay inputs. #PINx reads inputs and outputs of IO LIST and pins that #TRISx makes outputs; all other pins read as 0.";
    NO_TARGET "LD150" "a jump or a call leads nowhere"
        "GOTO takes the name of a LABEL or the number of a rung, from 1; a number beyond the last rung is the end of the scan. GOSUB takes the name of a subprogram, which begins with SUBPROG and ends with ENDSUB.";
    LABEL_TWICE "LD151" "a label or subprogram twice"
        "Two LABEL, or two SUBPROG, have one name, so a jump or a call does not say which is meant. LDmicro 5 refuses this too. Fix: rename one.";
    SUBPROGRAM_ENDS "LD152" "SUBPROG and ENDSUB do not pair"
        "A subprogram begins with SUBPROG and ends with ENDSUB of the same name, each alone in its rung. Subprograms cannot contain each other.";
    JUMP_ACROSS "LD153" "a jump into a subprogram or out of it"
        "GOTO stays in the main program, or in one subprogram. A jump across would leave a return address behind, or need one that is not there. Fix: GOSUB to enter, RETURN to leave.";
    RECURSION "LD154" "a subprogram calls itself, or calls nest too deep"
        "A subprogram must not call itself, directly or through others, and at most 8 may be active at the same time, because a PIC16 holds eight return addresses. Memories of edges and timers exist once, so recursion has no use here. Fix: a loop with GOTO.";
    ENDLESS_LOOP "LD155" "a loop without an end"
        "GOTO jumps back without a condition, and nothing in the loop leaves it. On a chip of LDmicro the scan would never end. Fix: put a contact or a comparison before GOTO.";
    JUMP_BACK "LD156" "a jump back"
        "A note: the rungs between the target and GOTO are executed again in the same scan. A scan takes at most 100 jumps back in all; a further one is not taken, so every scan ends. The time of a scan is reckoned with all of them.";
    RETURN_OUTSIDE "LD157" "RETURN outside of a subprogram"
        "It ends the scan, as in LDmicro 5's C output. The chips of LDmicro 5 run away there, because no return address is on the stack. Fix: GOTO with a number beyond the last rung.";
    NO_EFFECT "LD158" "an element without effect"
        "A note. DELAY and SLEEP pass time within a scan in LDmicro 5, and CLRWDT resets the watchdog. Here outputs change at the end of a scan, scans begin by a timer, and the watchdog is off, so none of them can be seen.";
}
