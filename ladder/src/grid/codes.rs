//! Diagnostic codes of grids: GR0xx from the reader, GR1xx from the checks of reference 003.

diag::codes! {
    /// All diagnostic codes of grids, in order of their numbers.
    GRID_CODES;

    GRID_SIZE "GR001" "the grids are too large"
        "A grid has at most 64 rows and 63 columns, a program 1000 grids and 4 MiB of text. CSLadder itself has 4 rows and 9 columns.";
    GRID_LINE "GR002" "a line is outside of a grid"
        "A file begins with CSLADDER, optionally INPUTS ACTIVE-LOW; then each grid is GRID, its rows, and END. Lines that begin with `;` are comments.";
    GRID_CELL "GR003" "unknown cell"
        "A cell is a contact (EN0, /EN0), a wire (---), a link (-, +, | or a character of a box), an output (OTE:S8, OTL:F0, OTU:S8, TON:T0:2, CTU:C0:5, RES:C0) or empty (.).";
    GRID_PLACE "GR004" "the cell is in the wrong column"
        "Contacts and wires are in odd columns, links in even ones, and outputs in the last column, as in reference 003.";
    GRID_OPERAND "GR005" "no such input, output, timer, counter or flag"
        "There are EN0 to EN7, S8 to S13, T0 to T4, C0 to C7 and F0 to F15. Contacts take all of them; OTE, OTL and OTU take S and F, TON takes T, CTU takes C, and RES takes T and C.";
    GRID_PRESET "GR006" "a bad preset"
        "TON takes seconds, 0.001 to 1000000 with up to three decimals; CTU takes a number of 1 to 32767.";
    GRID_NO_PATH "GR007" "no path leads to the output"
        "An output needs a path from the left bar: contacts, wires and links without a gap. CSLadder's editor does not allow such a grid.";
    GRID_PATHS "GR008" "too many paths"
        "The paths of an output are listed one by one; more than 1000 are refused. Fix: split the grid with a flag.";
    GRID_NO_OUTPUT "GR009" "a grid without an output"
        "A note: the grid does nothing, and CSLadder leaves it out of the program.";
    GRID_OPEN "GR010" "a grid is not closed"
        "Each GRID ends with a line END. The file ends, or another GRID begins, before it.";

    GRID_RES "GR101" "RES of a timer or counter that no grid uses"
        "The first check of CSLadder: RES needs a TON or CTU of its name as an output of some grid.";
    GRID_TON_TWICE "GR102" "a timer is used by two TON"
        "The second check of CSLadder: each timer belongs to one TON.";
    GRID_CTU_TWICE "GR103" "a counter is used by two CTU"
        "The third check of CSLadder: each counter belongs to one CTU.";
    GRID_NEVER_DRIVEN "GR104" "a contact is never driven"
        "The fourth check of CSLadder: a contact of S, F, T or C needs an output of its name in some grid.";
    GRID_ERRORS "GR105" "the number of errors"
        "A note: CSLadder counts the errors of its four checks, and compiles only if there are none.";
}
