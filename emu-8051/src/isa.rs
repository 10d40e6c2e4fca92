//! The table of MCS-51 instructions, and what is derived from it: the disassembler and the encoder.
//!
//! Source: user's manual, "MCS-51 instruction set". The rows have the order of its groups (arithmetic, logic,
//! data transfer, bits, branching). A row with an operand that is a byte or bit address names a second kind,
//! for addresses in RAM.

use emu_core::CoreError;
use emu_core::chip::InstructionSet;
use emu_core::table::{
    DisassembledInstruction, EncodeError, FlowKind, InstructionLocation, InstructionRow, MatchedRow, Operand,
    PredecodedOp, SyntaxAlias, alias, disassemble as disassemble_line, instruction_bits, instruction_words,
};

use crate::operands::{Abs, BitAddr, Dir, Imm, Imm16, Page, Rel, Ri, Rn};

/// Passes every row to `callback!`, after the tokens of `{ .. }`. Columns: name, mnemonic, syntax, pattern,
/// operands, machine cycles, flags written (C, A for AC, O for OV), body, kind for operands in RAM.
#[rustfmt::skip]
macro_rules! mcs51_table {
    ($callback:path { $($head:tt)* }) => { $callback! { $($head)* 8; extra {
        /// No row matches: stops the run.
        Illegal,
        /// A breakpoint is set here.
        Breakpoint,
        /// The jump at the end of a loop that can repeat without changing anything.
        PollingLoop,
        /// A MOVX that can write program memory, or that is executed on a chip without a bus.
        RewriteCode,
    }
    // Arithmetic.
    /// Add register.
    AddReg    "add"   "A, r"       "0010 1rrr"                     (r: Rn)                      "1" "CAO" => add(r);
    /// Add direct byte.
    AddDir    "add"   "A, d"       "0010 0101 dddd dddd"           (d: Dir)                     "1" "CAO" => add(d), AddRam;
    /// Add indirect RAM.
    AddInd    "add"   "A, @i"      "0010 011i"                     (i: Ri)                      "1" "CAO" => add(i);
    /// Add constant.
    AddImm    "add"   "A, #k"      "0010 0100 kkkk kkkk"           (k: Imm)                     "1" "CAO" => add(k);
    /// Add register with carry.
    AddcReg   "addc"  "A, r"       "0011 1rrr"                     (r: Rn)                      "1" "CAO" => addc(r);
    /// Add direct byte with carry.
    AddcDir   "addc"  "A, d"       "0011 0101 dddd dddd"           (d: Dir)                     "1" "CAO" => addc(d), AddcRam;
    /// Add indirect RAM with carry.
    AddcInd   "addc"  "A, @i"      "0011 011i"                     (i: Ri)                      "1" "CAO" => addc(i);
    /// Add constant with carry.
    AddcImm   "addc"  "A, #k"      "0011 0100 kkkk kkkk"           (k: Imm)                     "1" "CAO" => addc(k);
    /// Subtract register with borrow.
    SubbReg   "subb"  "A, r"       "1001 1rrr"                     (r: Rn)                      "1" "CAO" => subb(r);
    /// Subtract direct byte with borrow.
    SubbDir   "subb"  "A, d"       "1001 0101 dddd dddd"           (d: Dir)                     "1" "CAO" => subb(d), SubbRam;
    /// Subtract indirect RAM with borrow.
    SubbInd   "subb"  "A, @i"      "1001 011i"                     (i: Ri)                      "1" "CAO" => subb(i);
    /// Subtract constant with borrow.
    SubbImm   "subb"  "A, #k"      "1001 0100 kkkk kkkk"           (k: Imm)                     "1" "CAO" => subb(k);
    /// Increment accumulator.
    IncA      "inc"   "A"          "0000 0100"                     ()                           "1" ""    => inc(AccPlace);
    /// Increment register.
    IncReg    "inc"   "r"          "0000 1rrr"                     (r: Rn)                      "1" ""    => inc(r);
    /// Increment direct byte.
    IncDir    "inc"   "d"          "0000 0101 dddd dddd"           (d: Dir)                     "1" ""    => inc(d), IncRam;
    /// Increment indirect RAM.
    IncInd    "inc"   "@i"         "0000 011i"                     (i: Ri)                      "1" ""    => inc(i);
    /// Increment data pointer.
    IncDptr   "inc"   "DPTR"       "1010 0011"                     ()                           "2" ""    => inc_dptr();
    /// Decrement accumulator.
    DecA      "dec"   "A"          "0001 0100"                     ()                           "1" ""    => dec(AccPlace);
    /// Decrement register.
    DecReg    "dec"   "r"          "0001 1rrr"                     (r: Rn)                      "1" ""    => dec(r);
    /// Decrement direct byte.
    DecDir    "dec"   "d"          "0001 0101 dddd dddd"           (d: Dir)                     "1" ""    => dec(d), DecRam;
    /// Decrement indirect RAM.
    DecInd    "dec"   "@i"         "0001 011i"                     (i: Ri)                      "1" ""    => dec(i);
    /// Multiply A and B.
    MulAb     "mul"   "AB"         "1010 0100"                     ()                           "4" "CO"  => mul();
    /// Divide A by B.
    DivAb     "div"   "AB"         "1000 0100"                     ()                           "4" "CO"  => div();
    /// Decimal adjust accumulator.
    DaA       "da"    "A"          "1101 0100"                     ()                           "1" "C"   => da();
    // Logic.
    /// And register.
    AnlReg    "anl"   "A, r"       "0101 1rrr"                     (r: Rn)                      "1" ""    => anl(AccPlace, r);
    /// And direct byte.
    AnlDir    "anl"   "A, d"       "0101 0101 dddd dddd"           (d: Dir)                     "1" ""    => anl(AccPlace, d), AnlRam;
    /// And indirect RAM.
    AnlInd    "anl"   "A, @i"      "0101 011i"                     (i: Ri)                      "1" ""    => anl(AccPlace, i);
    /// And constant.
    AnlImm    "anl"   "A, #k"      "0101 0100 kkkk kkkk"           (k: Imm)                     "1" ""    => anl(AccPlace, k);
    /// And accumulator to direct byte.
    AnlDirA   "anl"   "d, A"       "0101 0010 dddd dddd"           (d: Dir)                     "1" ""    => anl(d, AccPlace), AnlRamA;
    /// And constant to direct byte.
    AnlDirImm "anl"   "d, #k"      "0101 0011 dddd dddd kkkk kkkk" (d: Dir, k: Imm)             "2" ""    => anl(d, k), AnlRamImm;
    /// Or register.
    OrlReg    "orl"   "A, r"       "0100 1rrr"                     (r: Rn)                      "1" ""    => orl(AccPlace, r);
    /// Or direct byte.
    OrlDir    "orl"   "A, d"       "0100 0101 dddd dddd"           (d: Dir)                     "1" ""    => orl(AccPlace, d), OrlRam;
    /// Or indirect RAM.
    OrlInd    "orl"   "A, @i"      "0100 011i"                     (i: Ri)                      "1" ""    => orl(AccPlace, i);
    /// Or constant.
    OrlImm    "orl"   "A, #k"      "0100 0100 kkkk kkkk"           (k: Imm)                     "1" ""    => orl(AccPlace, k);
    /// Or accumulator to direct byte.
    OrlDirA   "orl"   "d, A"       "0100 0010 dddd dddd"           (d: Dir)                     "1" ""    => orl(d, AccPlace), OrlRamA;
    /// Or constant to direct byte.
    OrlDirImm "orl"   "d, #k"      "0100 0011 dddd dddd kkkk kkkk" (d: Dir, k: Imm)             "2" ""    => orl(d, k), OrlRamImm;
    /// Exclusive-or register.
    XrlReg    "xrl"   "A, r"       "0110 1rrr"                     (r: Rn)                      "1" ""    => xrl(AccPlace, r);
    /// Exclusive-or direct byte.
    XrlDir    "xrl"   "A, d"       "0110 0101 dddd dddd"           (d: Dir)                     "1" ""    => xrl(AccPlace, d), XrlRam;
    /// Exclusive-or indirect RAM.
    XrlInd    "xrl"   "A, @i"      "0110 011i"                     (i: Ri)                      "1" ""    => xrl(AccPlace, i);
    /// Exclusive-or constant.
    XrlImm    "xrl"   "A, #k"      "0110 0100 kkkk kkkk"           (k: Imm)                     "1" ""    => xrl(AccPlace, k);
    /// Exclusive-or accumulator to direct byte.
    XrlDirA   "xrl"   "d, A"       "0110 0010 dddd dddd"           (d: Dir)                     "1" ""    => xrl(d, AccPlace), XrlRamA;
    /// Exclusive-or constant to direct byte.
    XrlDirImm "xrl"   "d, #k"      "0110 0011 dddd dddd kkkk kkkk" (d: Dir, k: Imm)             "2" ""    => xrl(d, k), XrlRamImm;
    /// Clear accumulator.
    ClrA      "clr"   "A"          "1110 0100"                     ()                           "1" ""    => mov(AccPlace, Imm(0));
    /// Complement accumulator.
    CplA      "cpl"   "A"          "1111 0100"                     ()                           "1" ""    => cpl_a();
    /// Rotate accumulator left.
    RlA       "rl"    "A"          "0010 0011"                     ()                           "1" ""    => rl();
    /// Rotate accumulator left through carry.
    RlcA      "rlc"   "A"          "0011 0011"                     ()                           "1" "C"   => rlc();
    /// Rotate accumulator right.
    RrA       "rr"    "A"          "0000 0011"                     ()                           "1" ""    => rr();
    /// Rotate accumulator right through carry.
    RrcA      "rrc"   "A"          "0001 0011"                     ()                           "1" "C"   => rrc();
    /// Swap the halves of the accumulator.
    SwapA     "swap"  "A"          "1100 0100"                     ()                           "1" ""    => swap();
    // Data transfer.
    /// Move register to accumulator.
    MovAReg   "mov"   "A, r"       "1110 1rrr"                     (r: Rn)                      "1" ""    => mov(AccPlace, r);
    /// Move direct byte to accumulator.
    MovADir   "mov"   "A, d"       "1110 0101 dddd dddd"           (d: Dir)                     "1" ""    => mov(AccPlace, d), MovARam;
    /// Move indirect RAM to accumulator.
    MovAInd   "mov"   "A, @i"      "1110 011i"                     (i: Ri)                      "1" ""    => mov(AccPlace, i);
    /// Move constant to accumulator.
    MovAImm   "mov"   "A, #k"      "0111 0100 kkkk kkkk"           (k: Imm)                     "1" ""    => mov(AccPlace, k);
    /// Move accumulator to register.
    MovRegA   "mov"   "r, A"       "1111 1rrr"                     (r: Rn)                      "1" ""    => mov(r, AccPlace);
    /// Move direct byte to register.
    MovRegDir "mov"   "r, d"       "1010 1rrr dddd dddd"           (r: Rn, d: Dir)              "2" ""    => mov(r, d), MovRegRam;
    /// Move constant to register.
    MovRegImm "mov"   "r, #k"      "0111 1rrr kkkk kkkk"           (r: Rn, k: Imm)              "1" ""    => mov(r, k);
    /// Move accumulator to direct byte.
    MovDirA   "mov"   "d, A"       "1111 0101 dddd dddd"           (d: Dir)                     "1" ""    => mov(d, AccPlace), MovRamA;
    /// Move register to direct byte.
    MovDirReg "mov"   "d, r"       "1000 1rrr dddd dddd"           (d: Dir, r: Rn)              "2" ""    => mov(d, r), MovRamReg;
    /// Move direct byte to direct byte; the source comes first in the code.
    MovDirDir "mov"   "d, s"       "1000 0101 ssss ssss dddd dddd" (d: Dir, s: Dir)             "2" ""    => mov(d, s), MovRamRam;
    /// Move indirect RAM to direct byte.
    MovDirInd "mov"   "d, @i"      "1000 011i dddd dddd"           (d: Dir, i: Ri)              "2" ""    => mov(d, i), MovRamInd;
    /// Move constant to direct byte.
    MovDirImm "mov"   "d, #k"      "0111 0101 dddd dddd kkkk kkkk" (d: Dir, k: Imm)             "2" ""    => mov(d, k), MovRamImm;
    /// Move accumulator to indirect RAM.
    MovIndA   "mov"   "@i, A"      "1111 011i"                     (i: Ri)                      "1" ""    => mov(i, AccPlace);
    /// Move direct byte to indirect RAM.
    MovIndDir "mov"   "@i, d"      "1010 011i dddd dddd"           (i: Ri, d: Dir)              "2" ""    => mov(i, d), MovIndRam;
    /// Move constant to indirect RAM.
    MovIndImm "mov"   "@i, #k"     "0111 011i kkkk kkkk"           (i: Ri, k: Imm)              "1" ""    => mov(i, k);
    /// Load data pointer.
    MovDptr   "mov"   "DPTR, #k"   "1001 0000 kkkk kkkk kkkk kkkk" (k: Imm16)                   "2" ""    => mov_dptr(k);
    /// Move code byte relative to DPTR.
    MovcDptr  "movc"  "A, @A+DPTR" "1001 0011"                     ()                           "2" ""    => movc_dptr();
    /// Move code byte relative to the next instruction.
    MovcPc    "movc"  "A, @A+PC"   "1000 0011"                     ()                           "2" ""    => movc_pc();
    /// Move external RAM to accumulator, address in P2 and a register.
    MovxAInd  "movx"  "A, @i"      "1110 001i"                     (i: Ri)                      "2" ""    => movx_a_ind(i);
    /// Move external RAM to accumulator.
    MovxADptr "movx"  "A, @DPTR"   "1110 0000"                     ()                           "2" ""    => movx_a_dptr();
    /// Move accumulator to external RAM, address in P2 and a register.
    MovxIndA  "movx"  "@i, A"      "1111 001i"                     (i: Ri)                      "2" ""    => movx_ind_a(i);
    /// Move accumulator to external RAM.
    MovxDptrA "movx"  "@DPTR, A"   "1111 0000"                     ()                           "2" ""    => movx_dptr_a();
    /// Push direct byte onto the stack.
    Push      "push"  "d"          "1100 0000 dddd dddd"           (d: Dir)                     "2" ""    => push(d), PushRam;
    /// Pop direct byte from the stack.
    Pop       "pop"   "d"          "1101 0000 dddd dddd"           (d: Dir)                     "2" ""    => pop(d), PopRam;
    /// Exchange register with accumulator.
    XchReg    "xch"   "A, r"       "1100 1rrr"                     (r: Rn)                      "1" ""    => xch(r);
    /// Exchange direct byte with accumulator.
    XchDir    "xch"   "A, d"       "1100 0101 dddd dddd"           (d: Dir)                     "1" ""    => xch(d), XchRam;
    /// Exchange indirect RAM with accumulator.
    XchInd    "xch"   "A, @i"      "1100 011i"                     (i: Ri)                      "1" ""    => xch(i);
    /// Exchange the low halves of indirect RAM and accumulator.
    XchdInd   "xchd"  "A, @i"      "1101 011i"                     (i: Ri)                      "1" ""    => xchd(i);
    // Bits.
    /// Clear carry.
    ClrC      "clr"   "C"          "1100 0011"                     ()                           "1" "C"   => set_bit(CarryPlace, false);
    /// Clear bit.
    ClrBit    "clr"   "b"          "1100 0010 bbbb bbbb"           (b: BitAddr)                 "1" ""    => set_bit(b, false), ClrRamBit;
    /// Set carry.
    SetbC     "setb"  "C"          "1101 0011"                     ()                           "1" "C"   => set_bit(CarryPlace, true);
    /// Set bit.
    SetbBit   "setb"  "b"          "1101 0010 bbbb bbbb"           (b: BitAddr)                 "1" ""    => set_bit(b, true), SetbRamBit;
    /// Complement carry.
    CplC      "cpl"   "C"          "1011 0011"                     ()                           "1" "C"   => cpl_bit(CarryPlace);
    /// Complement bit.
    CplBit    "cpl"   "b"          "1011 0010 bbbb bbbb"           (b: BitAddr)                 "1" ""    => cpl_bit(b), CplRamBit;
    /// And bit to carry.
    AnlC      "anl"   "C, b"       "1000 0010 bbbb bbbb"           (b: BitAddr)                 "2" "C"   => anl_c(b, false), AnlCRam;
    /// And complement of bit to carry.
    AnlCNot   "anl"   "C, /b"      "1011 0000 bbbb bbbb"           (b: BitAddr)                 "2" "C"   => anl_c(b, true), AnlCNotRam;
    /// Or bit to carry.
    OrlC      "orl"   "C, b"       "0111 0010 bbbb bbbb"           (b: BitAddr)                 "2" "C"   => orl_c(b, false), OrlCRam;
    /// Or complement of bit to carry.
    OrlCNot   "orl"   "C, /b"      "1010 0000 bbbb bbbb"           (b: BitAddr)                 "2" "C"   => orl_c(b, true), OrlCNotRam;
    /// Move bit to carry.
    MovCBit   "mov"   "C, b"       "1010 0010 bbbb bbbb"           (b: BitAddr)                 "1" "C"   => mov_c_bit(b), MovCRam;
    /// Move carry to bit.
    MovBitC   "mov"   "b, C"       "1001 0010 bbbb bbbb"           (b: BitAddr)                 "2" ""    => mov_bit_c(b), MovRamC;
    // Branching.
    /// Jump if carry is set.
    Jc        "jc"    "t"          "0100 0000 tttt tttt"           (t: Rel)                     "2" ""    => jump_if(CarryPlace, true, t);
    /// Jump if carry is clear.
    Jnc       "jnc"   "t"          "0101 0000 tttt tttt"           (t: Rel)                     "2" ""    => jump_if(CarryPlace, false, t);
    /// Jump if bit is set.
    Jb        "jb"    "b, t"       "0010 0000 bbbb bbbb tttt tttt" (b: BitAddr, t: Rel)         "2" ""    => jump_if(b, true, t), JbRam;
    /// Jump if bit is clear.
    Jnb       "jnb"   "b, t"       "0011 0000 bbbb bbbb tttt tttt" (b: BitAddr, t: Rel)         "2" ""    => jump_if(b, false, t), JnbRam;
    /// Jump if bit is set, and clear it.
    Jbc       "jbc"   "b, t"       "0001 0000 bbbb bbbb tttt tttt" (b: BitAddr, t: Rel)         "2" ""    => jbc(b, t), JbcRam;
    /// Call within the page.
    Acall     "acall" "t"          "ttt1 0001 tttt tttt"           (t: Page)                    "2" ""    => call(t.0);
    /// Call.
    Lcall     "lcall" "t"          "0001 0010 tttt tttt tttt tttt" (t: Abs)                     "2" ""    => call(t.0);
    /// Return.
    Ret       "ret"   ""           "0010 0010"                     ()                           "2" ""    => ret();
    /// Return from interrupt.
    Reti      "reti"  ""           "0011 0010"                     ()                           "2" ""    => reti();
    /// Jump within the page.
    Ajmp      "ajmp"  "t"          "ttt0 0001 tttt tttt"           (t: Page)                    "2" ""    => jmp(t.0);
    /// Jump.
    Ljmp      "ljmp"  "t"          "0000 0010 tttt tttt tttt tttt" (t: Abs)                     "2" ""    => jmp(t.0);
    /// Jump relative.
    Sjmp      "sjmp"  "t"          "1000 0000 tttt tttt"           (t: Rel)                     "2" ""    => sjmp(t);
    /// Jump indirect relative to DPTR.
    JmpDptr   "jmp"   "@A+DPTR"    "0111 0011"                     ()                           "2" ""    => jmp_dptr();
    /// Jump if accumulator is zero.
    Jz        "jz"    "t"          "0110 0000 tttt tttt"           (t: Rel)                     "2" ""    => jz(true, t);
    /// Jump if accumulator is not zero.
    Jnz       "jnz"   "t"          "0111 0000 tttt tttt"           (t: Rel)                     "2" ""    => jz(false, t);
    /// Compare direct byte with accumulator, jump if not equal.
    CjneDir   "cjne"  "A, d, t"    "1011 0101 dddd dddd tttt tttt" (d: Dir, t: Rel)             "2" "C"   => cjne(AccPlace, d, t), CjneRam;
    /// Compare constant with accumulator, jump if not equal.
    CjneImm   "cjne"  "A, #k, t"   "1011 0100 kkkk kkkk tttt tttt" (k: Imm, t: Rel)             "2" "C"   => cjne(AccPlace, k, t);
    /// Compare constant with register, jump if not equal.
    CjneReg   "cjne"  "r, #k, t"   "1011 1rrr kkkk kkkk tttt tttt" (r: Rn, k: Imm, t: Rel)      "2" "C"   => cjne(r, k, t);
    /// Compare constant with indirect RAM, jump if not equal.
    CjneInd   "cjne"  "@i, #k, t"  "1011 011i kkkk kkkk tttt tttt" (i: Ri, k: Imm, t: Rel)      "2" "C"   => cjne(i, k, t);
    /// Decrement register, jump if not zero.
    DjnzReg   "djnz"  "r, t"       "1101 1rrr tttt tttt"           (r: Rn, t: Rel)              "2" ""    => djnz(r, t);
    /// Decrement direct byte, jump if not zero.
    DjnzDir   "djnz"  "d, t"       "1101 0101 dddd dddd tttt tttt" (d: Dir, t: Rel)             "2" ""    => djnz(d, t), DjnzRam;
    /// No operation.
    Nop       "nop"   ""           "0000 0000"                     ()                           "1" ""    => nop();
    } };
}
pub(crate) use mcs51_table;

mcs51_table!(emu_core::define_isa { Mcs51OpKind; });

/// The table for tools. Erased program memory is all ones, which is also the opcode of `mov R7,A`.
pub const ISA: InstructionSet = InstructionSet {
    disassemble,
    erased_word: 0xFF,
    rows: ROWS,
    word_bits: WORD_BITS,
    aliases: ALIASES,
    locate,
    is_missing: |_| false,
    flow,
};

/// How the instruction of a row can change the order of execution. SJMP is the only jump to a relative target
/// without a condition.
fn flow(row: usize) -> FlowKind {
    let relative =
        |row: &InstructionRow| row.operands.iter().any(|slot| slot.kind.name == Rel::KIND.name && !slot.kind.wide);
    match (KINDS.get(row), ROWS.get(row)) {
        (Some(Mcs51OpKind::Reti), _) => FlowKind::EndsInterrupt,
        (Some(Mcs51OpKind::Sjmp), _) => FlowKind::Straight,
        (_, Some(row)) if relative(row) => FlowKind::Conditional,
        _ => FlowKind::Straight,
    }
}

/// Alternative spellings that the assembler accepts: mnemonic, syntax, and the equivalent row.
#[rustfmt::skip]
pub const ALIASES: &[SyntaxAlias] = &[
    // Assemblers accept this as a general call and choose a form; here it is the long one.
    alias("call", "t", "lcall", "t"),
    // as31 accepts the sum in any order, and `!` for the complement of a bit.
    alias("jmp",  "@DPTR+A",    "jmp",  "@A+DPTR"),
    alias("movc", "A, @DPTR+A", "movc", "A,@A+DPTR"),
    alias("movc", "A, @PC+A",   "movc", "A,@A+PC"),
    alias("anl",  "C, !b",      "anl",  "C,/b"),
    alias("orl",  "C, !b",      "orl",  "C,/b"),
];

/// Number of bits of a program word.
pub const WORD_BITS: u32 = 8;

/// Position of the row of every opcode; [`NO_ROW`] for A5h, which has none.
const ROW_BY_OPCODE: [u8; 256] = {
    let mut rows = [NO_ROW; 256];
    let mut i = 0;
    while i < ROWS.len() {
        let pattern = &ROWS[i].pattern;
        let below = (pattern.words() - 1) * WORD_BITS;
        let mut opcode = 0;
        while opcode < 256 {
            if opcode as u32 & pattern.mask >> below == pattern.value >> below {
                assert!(rows[opcode] == NO_ROW, "two rows for one opcode");
                rows[opcode] = i as u8;
            }
            opcode += 1;
        }
        i += 1;
    }
    rows
};
const NO_ROW: u8 = 0xFF;

/// The row of the instruction at the front of `bytes`; `None` for A5h.
#[must_use]
pub fn find_row(bytes: [u8; 3]) -> Option<MatchedRow<Mcs51OpKind>> {
    let i = usize::from(ROW_BY_OPCODE[usize::from(bytes[0])]);
    let row = ROWS.get(i)?;
    Some(MatchedRow { row, kind: KINDS[i], bits: instruction_bits(row, WORD_BITS, &bytes.map(u16::from)) })
}

fn locate(pc: u32, len: u32) -> InstructionLocation {
    InstructionLocation { pc, len, next_len: 1, pc_mask: 0xFFFF }
}

/// Encodes an instruction for the address `pc`. Operands are in row order: registers by number, addresses of
/// bytes and bits, constants, targets as absolute addresses.
///
/// # Errors
/// An operand does not fit; the error says what is allowed.
pub fn encode(kind: Mcs51OpKind, operands: &[i32], pc: u32) -> Result<Vec<u8>, EncodeError> {
    let row = ROWS.get(kind as usize).ok_or(EncodeError { mnemonic: "(none)", cause: CoreError::NotAnInstruction })?;
    let bits = row.encode(operands, &locate(pc, row.len()))?;
    Ok(instruction_words(row, WORD_BITS, bits).iter().map(|&word| word as u8).collect())
}

/// Disassembles the instruction at the start of `words` (bytes), whose address is `pc`.
#[must_use]
pub fn disassemble(words: &[u16], pc: u32) -> DisassembledInstruction {
    disassemble_line(ROWS, WORD_BITS, words, &locate(pc, 1))
}

/// A predecoded instruction.
pub type Mcs51Op = PredecodedOp<Mcs51OpKind>;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_opcode_but_a5_has_one_row_and_comes_back_from_its_text() {
        let chip = crate::chips::chip("8051").expect("8051");
        for opcode in 0..=255u16 {
            assert_eq!(ROW_BY_OPCODE[usize::from(opcode)] == NO_ROW, opcode == 0xA5, "{opcode:02x}");
            for second in 0..=255u16 {
                for third in [0x00, 0x7F, 0xD0, 0xFF] {
                    for pc in [0x07FD, 0xFFFE] {
                        let words = [opcode, second, third];
                        let line = disassemble(&words, pc);
                        // Bytes after the instruction make no difference.
                        if words.get(line.len..).is_some_and(|behind| behind.iter().any(|&byte| byte != 0)) {
                            continue;
                        }
                        let back = emu_asm::assemble_line(chip, &line.text, pc);
                        let back = back.unwrap_or_else(|e| panic!("{words:x?}: {}: {e}", line.text));
                        assert_eq!(back, words[..line.len], "{words:x?} at {pc:04x}: {}", line.text);
                    }
                }
            }
        }
    }

    #[test]
    fn kinds_are_in_the_order_of_rows() {
        assert!(KINDS.iter().enumerate().all(|(i, &kind)| kind as usize == i));
    }
}
