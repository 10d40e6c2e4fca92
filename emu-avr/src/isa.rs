//! The table of AVR instructions, and all functions that read it.
//!
//! The rows are in the order of the groups of the instruction set manual: arithmetic and logic, branches,
//! bits, data transfer, control.

use emu_core::CoreError;
use emu_core::chip::InstructionSet;
use emu_core::table::{
    DisassembledInstruction, EncodeError, FlowKind, FoundRow, InstructionLocation, MatchedRow, PredecodedOp,
    SyntaxAlias, alias, disassemble as disassemble_line,
};

use crate::operands::{A, Abs, B, D16, K, Q, R, Rel, Rh, Rm, Rp, Rw, Skip};

/// Passes every row to `callback!`, after the tokens in `{ .. }`. Columns: name, mnemonic, syntax, pattern,
/// operands, cycles (`/` between outcomes), flags written, body.
#[rustfmt::skip]
macro_rules! avr_table {
    ($callback:path { $($head:tt)* }) => { $callback! { $($head)* 16; extra {
        /// Not an instruction: no row matches the word. It stops the run.
        Illegal,
        /// A word with a breakpoint.
        Breakpoint,
        /// The last instruction of a loop that may repeat without changing anything.
        PollingLoop,
    }
    // Arithmetic and logic.
    /// Add without carry.
    Add    "add"    "d, r"   "0000 11rd dddd rrrr" (d: R, r: R)           "1"     "HSVNZC"   => add(d, r);
    /// Add with carry.
    Adc    "adc"    "d, r"   "0001 11rd dddd rrrr" (d: R, r: R)           "1"     "HSVNZC"   => adc(d, r);
    /// Add constant to pair.
    Adiw   "adiw"   "d, k"   "1001 0110 kkdd kkkk" (d: Rw, k: K)          "2"     "SVNZC"    => adiw(d, k);
    /// Subtract without carry.
    Sub    "sub"    "d, r"   "0001 10rd dddd rrrr" (d: R, r: R)           "1"     "HSVNZC"   => sub(d, r);
    /// Subtract constant.
    Subi   "subi"   "d, k"   "0101 kkkk dddd kkkk" (d: Rh, k: K)          "1"     "HSVNZC"   => subi(d, k);
    /// Subtract with carry.
    Sbc    "sbc"    "d, r"   "0000 10rd dddd rrrr" (d: R, r: R)           "1"     "HSVNZC"   => sbc(d, r);
    /// Subtract constant with carry.
    Sbci   "sbci"   "d, k"   "0100 kkkk dddd kkkk" (d: Rh, k: K)          "1"     "HSVNZC"   => sbci(d, k);
    /// Subtract constant from pair.
    Sbiw   "sbiw"   "d, k"   "1001 0111 kkdd kkkk" (d: Rw, k: K)          "2"     "SVNZC"    => sbiw(d, k);
    /// And.
    And    "and"    "d, r"   "0010 00rd dddd rrrr" (d: R, r: R)           "1"     "SVNZ"     => and(d, r);
    /// And with constant.
    Andi   "andi"   "d, k"   "0111 kkkk dddd kkkk" (d: Rh, k: K)          "1"     "SVNZ"     => andi(d, k);
    /// Or.
    Or     "or"     "d, r"   "0010 10rd dddd rrrr" (d: R, r: R)           "1"     "SVNZ"     => or(d, r);
    /// Or with constant.
    Ori    "ori"    "d, k"   "0110 kkkk dddd kkkk" (d: Rh, k: K)          "1"     "SVNZ"     => ori(d, k);
    /// Exclusive or.
    Eor    "eor"    "d, r"   "0010 01rd dddd rrrr" (d: R, r: R)           "1"     "SVNZ"     => eor(d, r);
    /// One's complement.
    Com    "com"    "d"      "1001 010d dddd 0000" (d: R)                 "1"     "SVNZC"    => com(d);
    /// Two's complement.
    Neg    "neg"    "d"      "1001 010d dddd 0001" (d: R)                 "1"     "HSVNZC"   => neg(d);
    /// Increment.
    Inc    "inc"    "d"      "1001 010d dddd 0011" (d: R)                 "1"     "SVNZ"     => inc(d);
    /// Decrement.
    Dec    "dec"    "d"      "1001 010d dddd 1010" (d: R)                 "1"     "SVNZ"     => dec(d);
    /// Multiply unsigned.
    Mul    "mul"    "d, r"   "1001 11rd dddd rrrr" (d: R, r: R)           "2"     "ZC"       => mul(d, r);
    /// Multiply signed.
    Muls   "muls"   "d, r"   "0000 0010 dddd rrrr" (d: Rh, r: Rh)         "2"     "ZC"       => muls(d.0, r.0, true, true, 0);
    /// Multiply signed with unsigned.
    Mulsu  "mulsu"  "d, r"   "0000 0011 0ddd 0rrr" (d: Rm, r: Rm)         "2"     "ZC"       => muls(d.0, r.0, true, false, 0);
    /// Fractional multiply unsigned.
    Fmul   "fmul"   "d, r"   "0000 0011 0ddd 1rrr" (d: Rm, r: Rm)         "2"     "ZC"       => muls(d.0, r.0, false, false, 1);
    /// Fractional multiply signed.
    Fmuls  "fmuls"  "d, r"   "0000 0011 1ddd 0rrr" (d: Rm, r: Rm)         "2"     "ZC"       => muls(d.0, r.0, true, true, 1);
    /// Fractional multiply signed with unsigned.
    Fmulsu "fmulsu" "d, r"   "0000 0011 1ddd 1rrr" (d: Rm, r: Rm)         "2"     "ZC"       => muls(d.0, r.0, true, false, 1);
    // Branches.
    /// Relative jump.
    Rjmp   "rjmp"   "k"      "1100 kkkk kkkk kkkk" (k: Rel)               "2"     ""         => jmp(k.0);
    /// Indirect jump to Z.
    Ijmp   "ijmp"   ""       "1001 0100 0000 1001" ()                     "2"     ""         => ijmp();
    /// Jump.
    Jmp    "jmp"    "k"      "1001 010k kkkk 110k kkkk kkkk kkkk kkkk" (k: Abs) "3" ""       => jmp(k.0);
    /// Relative call.
    Rcall  "rcall"  "k"      "1101 kkkk kkkk kkkk" (k: Rel)               "3"     ""         => call(k.0);
    /// Indirect call to Z.
    Icall  "icall"  ""       "1001 0101 0000 1001" ()                     "3"     ""         => icall();
    /// Call.
    Call   "call"   "k"      "1001 010k kkkk 111k kkkk kkkk kkkk kkkk" (k: Abs) "4" ""       => call(k.0);
    /// Return.
    Ret    "ret"    ""       "1001 0101 0000 1000" ()                     "4"     ""         => ret();
    /// Return from interrupt.
    Reti   "reti"   ""       "1001 0101 0001 1000" ()                     "4"     "I"        => reti();
    /// Compare, skip if equal.
    Cpse   "cpse"   "d, r"   "0001 00rd dddd rrrr" (d: R, r: R, n: Skip)  "1/2/3" ""         => cpse(d, r, n);
    /// Compare.
    Cp     "cp"     "d, r"   "0001 01rd dddd rrrr" (d: R, r: R)           "1"     "HSVNZC"   => cp(d, r);
    /// Compare with carry.
    Cpc    "cpc"    "d, r"   "0000 01rd dddd rrrr" (d: R, r: R)           "1"     "HSVNZC"   => cpc(d, r);
    /// Compare with constant.
    Cpi    "cpi"    "d, k"   "0011 kkkk dddd kkkk" (d: Rh, k: K)          "1"     "HSVNZC"   => cpi(d, k);
    /// Skip if bit in register is clear.
    Sbrc   "sbrc"   "r, b"   "1111 110r rrrr 0bbb" (r: R, b: B, n: Skip)  "1/2/3" ""         => sbr(r, b, n, false);
    /// Skip if bit in register is set.
    Sbrs   "sbrs"   "r, b"   "1111 111r rrrr 0bbb" (r: R, b: B, n: Skip)  "1/2/3" ""         => sbr(r, b, n, true);
    /// Skip if bit in I/O register is clear.
    Sbic   "sbic"   "a, b"   "1001 1001 aaaa abbb" (a: A, b: B, n: Skip)  "1/2/3" ""         => sbi_skip(a, b, n, false);
    /// Skip if bit in I/O register is set.
    Sbis   "sbis"   "a, b"   "1001 1011 aaaa abbb" (a: A, b: B, n: Skip)  "1/2/3" ""         => sbi_skip(a, b, n, true);
    /// Branch if carry is set (also: lower).
    Brcs   "brcs"   "k"      "1111 00kk kkkk k000" (k: Rel)               "1/2"   ""         => br(SregFlag::C, true, k);
    /// Branch if zero is set (equal).
    Breq   "breq"   "k"      "1111 00kk kkkk k001" (k: Rel)               "1/2"   ""         => br(SregFlag::Z, true, k);
    /// Branch if negative is set (minus).
    Brmi   "brmi"   "k"      "1111 00kk kkkk k010" (k: Rel)               "1/2"   ""         => br(SregFlag::N, true, k);
    /// Branch if overflow is set.
    Brvs   "brvs"   "k"      "1111 00kk kkkk k011" (k: Rel)               "1/2"   ""         => br(SregFlag::V, true, k);
    /// Branch if sign is set (less than, signed).
    Brlt   "brlt"   "k"      "1111 00kk kkkk k100" (k: Rel)               "1/2"   ""         => br(SregFlag::S, true, k);
    /// Branch if half carry is set.
    Brhs   "brhs"   "k"      "1111 00kk kkkk k101" (k: Rel)               "1/2"   ""         => br(SregFlag::H, true, k);
    /// Branch if T is set.
    Brts   "brts"   "k"      "1111 00kk kkkk k110" (k: Rel)               "1/2"   ""         => br(SregFlag::T, true, k);
    /// Branch if interrupts are enabled.
    Brie   "brie"   "k"      "1111 00kk kkkk k111" (k: Rel)               "1/2"   ""         => br(SregFlag::I, true, k);
    /// Branch if carry is clear (also: same or higher).
    Brcc   "brcc"   "k"      "1111 01kk kkkk k000" (k: Rel)               "1/2"   ""         => br(SregFlag::C, false, k);
    /// Branch if zero is clear (not equal).
    Brne   "brne"   "k"      "1111 01kk kkkk k001" (k: Rel)               "1/2"   ""         => br(SregFlag::Z, false, k);
    /// Branch if negative is clear (plus).
    Brpl   "brpl"   "k"      "1111 01kk kkkk k010" (k: Rel)               "1/2"   ""         => br(SregFlag::N, false, k);
    /// Branch if overflow is clear.
    Brvc   "brvc"   "k"      "1111 01kk kkkk k011" (k: Rel)               "1/2"   ""         => br(SregFlag::V, false, k);
    /// Branch if sign is clear (greater or equal, signed).
    Brge   "brge"   "k"      "1111 01kk kkkk k100" (k: Rel)               "1/2"   ""         => br(SregFlag::S, false, k);
    /// Branch if half carry is clear.
    Brhc   "brhc"   "k"      "1111 01kk kkkk k101" (k: Rel)               "1/2"   ""         => br(SregFlag::H, false, k);
    /// Branch if T is clear.
    Brtc   "brtc"   "k"      "1111 01kk kkkk k110" (k: Rel)               "1/2"   ""         => br(SregFlag::T, false, k);
    /// Branch if interrupts are disabled.
    Brid   "brid"   "k"      "1111 01kk kkkk k111" (k: Rel)               "1/2"   ""         => br(SregFlag::I, false, k);
    // Bits.
    /// Set bit in I/O register.
    Sbi    "sbi"    "a, b"   "1001 1010 aaaa abbb" (a: A, b: B)           "2"     ""         => io_bit(a, b, true);
    /// Clear bit in I/O register.
    Cbi    "cbi"    "a, b"   "1001 1000 aaaa abbb" (a: A, b: B)           "2"     ""         => io_bit(a, b, false);
    /// Logical shift right.
    Lsr    "lsr"    "d"      "1001 010d dddd 0110" (d: R)                 "1"     "SVNZC"    => lsr(d);
    /// Rotate right through carry.
    Ror    "ror"    "d"      "1001 010d dddd 0111" (d: R)                 "1"     "SVNZC"    => ror(d);
    /// Arithmetic shift right.
    Asr    "asr"    "d"      "1001 010d dddd 0101" (d: R)                 "1"     "SVNZC"    => asr(d);
    /// Swap nibbles.
    Swap   "swap"   "d"      "1001 010d dddd 0010" (d: R)                 "1"     ""         => swap(d);
    /// Set carry.
    Sec    "sec"    ""       "1001 0100 0000 1000" ()                     "1"     "C"        => flag(SregFlag::C, true);
    /// Set zero.
    Sez    "sez"    ""       "1001 0100 0001 1000" ()                     "1"     "Z"        => flag(SregFlag::Z, true);
    /// Set negative.
    Sen    "sen"    ""       "1001 0100 0010 1000" ()                     "1"     "N"        => flag(SregFlag::N, true);
    /// Set overflow.
    Sev    "sev"    ""       "1001 0100 0011 1000" ()                     "1"     "V"        => flag(SregFlag::V, true);
    /// Set sign.
    Ses    "ses"    ""       "1001 0100 0100 1000" ()                     "1"     "S"        => flag(SregFlag::S, true);
    /// Set half carry.
    Seh    "seh"    ""       "1001 0100 0101 1000" ()                     "1"     "H"        => flag(SregFlag::H, true);
    /// Set T.
    Set    "set"    ""       "1001 0100 0110 1000" ()                     "1"     "T"        => flag(SregFlag::T, true);
    /// Enable interrupts, from after the next instruction.
    Sei    "sei"    ""       "1001 0100 0111 1000" ()                     "1"     "I"        => flag(SregFlag::I, true);
    /// Clear carry.
    Clc    "clc"    ""       "1001 0100 1000 1000" ()                     "1"     "C"        => flag(SregFlag::C, false);
    /// Clear zero.
    Clz    "clz"    ""       "1001 0100 1001 1000" ()                     "1"     "Z"        => flag(SregFlag::Z, false);
    /// Clear negative.
    Cln    "cln"    ""       "1001 0100 1010 1000" ()                     "1"     "N"        => flag(SregFlag::N, false);
    /// Clear overflow.
    Clv    "clv"    ""       "1001 0100 1011 1000" ()                     "1"     "V"        => flag(SregFlag::V, false);
    /// Clear sign.
    Cls    "cls"    ""       "1001 0100 1100 1000" ()                     "1"     "S"        => flag(SregFlag::S, false);
    /// Clear half carry.
    Clh    "clh"    ""       "1001 0100 1101 1000" ()                     "1"     "H"        => flag(SregFlag::H, false);
    /// Clear T.
    Clt    "clt"    ""       "1001 0100 1110 1000" ()                     "1"     "T"        => flag(SregFlag::T, false);
    /// Disable interrupts.
    Cli    "cli"    ""       "1001 0100 1111 1000" ()                     "1"     "I"        => flag(SregFlag::I, false);
    /// Copy a bit of a register to T.
    Bst    "bst"    "d, b"   "1111 101d dddd 0bbb" (d: R, b: B)           "1"     "T"        => bst(d, b);
    /// Copy T to a bit of a register.
    Bld    "bld"    "d, b"   "1111 100d dddd 0bbb" (d: R, b: B)           "1"     ""         => bld(d, b);
    // Data transfer.
    /// Copy register.
    Mov    "mov"    "d, r"   "0010 11rd dddd rrrr" (d: R, r: R)           "1"     ""         => mov(d, r);
    /// Copy register pair.
    Movw   "movw"   "d, r"   "0000 0001 dddd rrrr" (d: Rp, r: Rp)         "1"     ""         => movw(d, r);
    /// Load constant.
    Ldi    "ldi"    "d, k"   "1110 kkkk dddd kkkk" (d: Rh, k: K)          "1"     ""         => ldi(d, k);
    /// Load through X.
    LdX    "ld"     "d, X"   "1001 000d dddd 1100" (d: R)                 "2"     ""         => ld(d, X, 0);
    /// Load through X, then increment X.
    LdXi   "ld"     "d, X+"  "1001 000d dddd 1101" (d: R)                 "2"     ""         => ld_inc(d, X);
    /// Decrement X, then load through X.
    LdXd   "ld"     "d, -X"  "1001 000d dddd 1110" (d: R)                 "2"     ""         => ld_dec(d, X);
    /// Load through Y.
    LdY    "ld"     "d, Y"   "1000 000d dddd 1000" (d: R)                 "2"     ""         => ld(d, Y, 0);
    /// Load through Y, then increment Y.
    LdYi   "ld"     "d, Y+"  "1001 000d dddd 1001" (d: R)                 "2"     ""         => ld_inc(d, Y);
    /// Decrement Y, then load through Y.
    LdYd   "ld"     "d, -Y"  "1001 000d dddd 1010" (d: R)                 "2"     ""         => ld_dec(d, Y);
    /// Load through Y with displacement.
    LddY   "ldd"    "d, Y+q" "10q0 qq0d dddd 1qqq" (d: R, q: Q)           "2"     ""         => ld(d, Y, q.0);
    /// Load through Z.
    LdZ    "ld"     "d, Z"   "1000 000d dddd 0000" (d: R)                 "2"     ""         => ld(d, Z, 0);
    /// Load through Z, then increment Z.
    LdZi   "ld"     "d, Z+"  "1001 000d dddd 0001" (d: R)                 "2"     ""         => ld_inc(d, Z);
    /// Decrement Z, then load through Z.
    LdZd   "ld"     "d, -Z"  "1001 000d dddd 0010" (d: R)                 "2"     ""         => ld_dec(d, Z);
    /// Load through Z with displacement.
    LddZ   "ldd"    "d, Z+q" "10q0 qq0d dddd 0qqq" (d: R, q: Q)           "2"     ""         => ld(d, Z, q.0);
    /// Load direct.
    Lds    "lds"    "d, k"   "1001 000d dddd 0000 kkkk kkkk kkkk kkkk" (d: R, k: D16) "2" "" => lds(d, k);
    /// Store through X.
    StX    "st"     "X, r"   "1001 001r rrrr 1100" (r: R)                 "2"     ""         => st(X, 0, r);
    /// Store through X, then increment X.
    StXi   "st"     "X+, r"  "1001 001r rrrr 1101" (r: R)                 "2"     ""         => st_inc(X, r);
    /// Decrement X, then store through X.
    StXd   "st"     "-X, r"  "1001 001r rrrr 1110" (r: R)                 "2"     ""         => st_dec(X, r);
    /// Store through Y.
    StY    "st"     "Y, r"   "1000 001r rrrr 1000" (r: R)                 "2"     ""         => st(Y, 0, r);
    /// Store through Y, then increment Y.
    StYi   "st"     "Y+, r"  "1001 001r rrrr 1001" (r: R)                 "2"     ""         => st_inc(Y, r);
    /// Decrement Y, then store through Y.
    StYd   "st"     "-Y, r"  "1001 001r rrrr 1010" (r: R)                 "2"     ""         => st_dec(Y, r);
    /// Store through Y with displacement.
    StdY   "std"    "Y+q, r" "10q0 qq1r rrrr 1qqq" (q: Q, r: R)           "2"     ""         => st(Y, q.0, r);
    /// Store through Z.
    StZ    "st"     "Z, r"   "1000 001r rrrr 0000" (r: R)                 "2"     ""         => st(Z, 0, r);
    /// Store through Z, then increment Z.
    StZi   "st"     "Z+, r"  "1001 001r rrrr 0001" (r: R)                 "2"     ""         => st_inc(Z, r);
    /// Decrement Z, then store through Z.
    StZd   "st"     "-Z, r"  "1001 001r rrrr 0010" (r: R)                 "2"     ""         => st_dec(Z, r);
    /// Store through Z with displacement.
    StdZ   "std"    "Z+q, r" "10q0 qq1r rrrr 0qqq" (q: Q, r: R)           "2"     ""         => st(Z, q.0, r);
    /// Store direct.
    Sts    "sts"    "k, r"   "1001 001r rrrr 0000 kkkk kkkk kkkk kkkk" (r: R, k: D16) "2" "" => sts(k, r);
    /// Load program memory through Z into r0.
    Lpm    "lpm"    ""       "1001 0101 1100 1000" ()                     "3"     ""         => lpm(R(0), false);
    /// Load program memory through Z.
    LpmZ   "lpm"    "d, Z"   "1001 000d dddd 0100" (d: R)                 "3"     ""         => lpm(d, false);
    /// Load program memory through Z, then increment Z.
    LpmZi  "lpm"    "d, Z+"  "1001 000d dddd 0101" (d: R)                 "3"     ""         => lpm(d, true);
    /// Load program memory through RAMPZ and Z into r0.
    Elpm   "elpm"   ""       "1001 0101 1101 1000" ()                     "3"     ""         => elpm(R(0), false);
    /// Load program memory through RAMPZ and Z.
    ElpmZ  "elpm"   "d, Z"   "1001 000d dddd 0110" (d: R)                 "3"     ""         => elpm(d, false);
    /// Load program memory through RAMPZ and Z, then increment them as one number.
    ElpmZi "elpm"   "d, Z+"  "1001 000d dddd 0111" (d: R)                 "3"     ""         => elpm(d, true);
    /// Store program memory.
    Spm    "spm"    ""       "1001 0101 1110 1000" ()                     "1"     ""         => spm();
    /// In from I/O.
    In     "in"     "d, a"   "1011 0aad dddd aaaa" (d: R, a: A)           "1"     ""         => in_(d, a);
    /// Out to I/O.
    Out    "out"    "a, r"   "1011 1aar rrrr aaaa" (a: A, r: R)           "1"     ""         => out(a, r);
    /// Push on the stack.
    Push   "push"   "r"      "1001 001r rrrr 1111" (r: R)                 "2"     ""         => push(r);
    /// Pop from the stack.
    Pop    "pop"    "d"      "1001 000d dddd 1111" (d: R)                 "2"     ""         => pop(d);
    // Control.
    /// Do nothing.
    Nop    "nop"    ""       "0000 0000 0000 0000" ()                     "1"     ""         => nop();
    /// Sleep.
    Sleep  "sleep"  ""       "1001 0101 1000 1000" ()                     "1"     ""         => sleep();
    /// Reset the watchdog.
    Wdr    "wdr"    ""       "1001 0101 1010 1000" ()                     "1"     ""         => wdr();
    /// Break: does nothing without an on-chip debugger.
    Break  "break"  ""       "1001 0101 1001 1000" ()                     "1"     ""         => nop();
    } };
}
pub(crate) use avr_table;

avr_table!(emu_core::define_isa { AvrOpKind; });

/// Alternative spellings that the assembler accepts: mnemonic, syntax, then mnemonic and operands that they
/// mean.
#[rustfmt::skip]
pub const ALIASES: &[SyntaxAlias] = &[
    alias("lsl",  "d",    "add",  "d,d"),
    alias("rol",  "d",    "adc",  "d,d"),
    alias("tst",  "d",    "and",  "d,d"),
    alias("clr",  "d",    "eor",  "d,d"),
    alias("ser",  "d",    "ldi",  "d,0xFF"),
    alias("sbr",  "d, k", "ori",  "d,k"),
    alias("cbr",  "d, k", "andi", "d,0xFF&~(k)"),
    // Instructions that name a flag of SREG by its number.
    alias("bset", "0", "sec", ""), alias("bset", "1", "sez", ""), alias("bset", "2", "sen", ""), alias("bset", "3", "sev", ""),
    alias("bset", "4", "ses", ""), alias("bset", "5", "seh", ""), alias("bset", "6", "set", ""), alias("bset", "7", "sei", ""),
    alias("bclr", "0", "clc", ""), alias("bclr", "1", "clz", ""), alias("bclr", "2", "cln", ""), alias("bclr", "3", "clv", ""),
    alias("bclr", "4", "cls", ""), alias("bclr", "5", "clh", ""), alias("bclr", "6", "clt", ""), alias("bclr", "7", "cli", ""),
    alias("brbs", "0, k", "brcs", "k"), alias("brbs", "1, k", "breq", "k"), alias("brbs", "2, k", "brmi", "k"), alias("brbs", "3, k", "brvs", "k"),
    alias("brbs", "4, k", "brlt", "k"), alias("brbs", "5, k", "brhs", "k"), alias("brbs", "6, k", "brts", "k"), alias("brbs", "7, k", "brie", "k"),
    alias("brbc", "0, k", "brcc", "k"), alias("brbc", "1, k", "brne", "k"), alias("brbc", "2, k", "brpl", "k"), alias("brbc", "3, k", "brvc", "k"),
    alias("brbc", "4, k", "brge", "k"), alias("brbc", "5, k", "brhc", "k"), alias("brbc", "6, k", "brtc", "k"), alias("brbc", "7, k", "brid", "k"),
    alias("brlo", "k",    "brcs", "k"),
    alias("brsh", "k",    "brcc", "k"),
    // A displacement of 0 is encoded as the form without displacement.
    alias("ldd",  "d, Y", "ld",   "d,Y"),
    alias("ldd",  "d, Z", "ld",   "d,Z"),
];

/// Returns the instruction set of a chip with `FLASH` bytes of flash, a power of two.
pub const fn instruction_set<const FLASH: u32>() -> InstructionSet {
    InstructionSet {
        disassemble: disassemble_in::<FLASH>,
        erased_word: 0xFFFF,
        rows: ROWS,
        word_bits: WORD_BITS,
        aliases: ALIASES,
        locate: |pc, len| InstructionLocation { pc, len, next_len: 1, pc_mask: FLASH / 2 - 1 },
        is_missing: |row| matches!(KINDS.get(row), Some(&kind) if is_missing(FLASH, kind)),
        flow,
    }
}

/// Returns the effect of a row on the program flow. An instruction is conditional exactly if its number of
/// cycles varies.
fn flow(row: usize) -> FlowKind {
    match (KINDS.get(row), ROWS.get(row)) {
        (Some(AvrOpKind::Reti), _) => FlowKind::EndsInterrupt,
        (_, Some(row)) if row.has_variable_cycles() => FlowKind::Conditional,
        _ => FlowKind::Straight,
    }
}

/// Reports whether a chip with `flash` bytes of flash lacks an instruction: JMP and CALL need more than 8 KB,
/// ELPM more than 64 KB (instruction set manual, core descriptions).
#[must_use]
pub const fn is_missing(flash: u32, kind: AvrOpKind) -> bool {
    match kind {
        AvrOpKind::Jmp | AvrOpKind::Call => flash <= 0x2000,
        AvrOpKind::Elpm | AvrOpKind::ElpmZ | AvrOpKind::ElpmZi => flash <= 0x1_0000,
        _ => false,
    }
}

/// Number of bits in an AVR program word.
pub const WORD_BITS: u32 = 16;

/// The program words of one instruction, one or two.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InstructionWords {
    words: [u16; 2],
    len: usize,
}

impl std::ops::Deref for InstructionWords {
    type Target = [u16];
    fn deref(&self) -> &[u16] {
        &self.words[..self.len]
    }
}

/// Program words of the ATmega328P minus one. Jump targets wrap with this mask unless another chip is named.
pub const PC_MASK: u32 = 0x3FFF;

/// Encodes an instruction for the word address `pc`. Operands are in row order: registers by number, targets
/// as absolute word addresses, I/O addresses from 0 to 63.
///
/// # Errors
/// Fails if an operand does not fit; the error gives the allowed values.
pub fn encode(kind: AvrOpKind, operands: &[i32], pc: u32) -> Result<InstructionWords, EncodeError> {
    let row = ROWS.get(kind as usize).ok_or(EncodeError { mnemonic: "(none)", cause: CoreError::NotAnInstruction })?;
    let bits = row.encode(operands, &InstructionLocation { pc, len: row.len(), next_len: 1, pc_mask: PC_MASK })?;
    Ok(match row.len() {
        2 => InstructionWords { words: [(bits >> WORD_BITS) as u16, bits as u16], len: 2 },
        _ => InstructionWords { words: [bits as u16, 0], len: 1 },
    })
}

/// Disassembles the instruction at the start of `words`, at the word address `pc` of an ATmega328P. Targets
/// print as byte addresses.
#[must_use]
pub fn disassemble(words: &[u16], pc: u32) -> DisassembledInstruction {
    disassemble_in::<{ 2 * (PC_MASK + 1) }>(words, pc)
}

fn disassemble_in<const FLASH: u32>(words: &[u16], pc: u32) -> DisassembledInstruction {
    let lacking = words.first().and_then(|&word| find_row(word, 0)).is_some_and(|found| is_missing(FLASH, found.kind));
    let rows = if lacking { &[] } else { ROWS };
    disassemble_line(rows, WORD_BITS, words, &InstructionLocation { pc, len: 1, next_len: 1, pc_mask: FLASH / 2 - 1 })
}

/// Returns the row, kind and bits of the instruction that starts with the word `first`; None if no row
/// matches.
#[must_use]
pub fn find_row(first: u16, second: u16) -> Option<MatchedRow<AvrOpKind>> {
    let FoundRow { index: i, bits } = emu_core::table::find_row(ROWS, WORD_BITS, &[first, second])?;
    Some(MatchedRow { row: &ROWS[i], kind: KINDS[i], bits })
}

/// A predecoded AVR instruction.
pub type AvrOp = PredecodedOp<AvrOpKind>;

#[cfg(test)]
mod tests {
    use super::*;

    /// Every word, also with a word after it for two-word instructions, disassembles to a text that assembles
    /// to the same word.
    #[test]
    fn every_word_survives_its_own_text() {
        for second in [0x0000u16, 0x1234, 0xFFFF] {
            for first in 0..=0xFFFFu16 {
                let words = [first, second];
                let line = disassemble(&words, 0x100);
                let back = emu_asm::assemble_line(&crate::chips::ATMEGA328P, &line.text, 0x100);
                let back = back.unwrap_or_else(|e| panic!("{first:04x}: {}: {e}", line.text));
                assert_eq!(back, words[..line.len], "{first:04x}: {}", line.text);
            }
        }
    }

    /// Two rows overlap only if one is the form without displacement and the other has a displacement of 0.
    #[test]
    fn rows_are_disjoint_but_for_the_displacements_of_zero() {
        let wanted = [("LdY", "LddY"), ("LdZ", "LddZ"), ("StY", "StdY"), ("StZ", "StdZ")];
        for (i, a) in ROWS.iter().enumerate() {
            for b in &ROWS[i + 1..] {
                let shift = |r: &emu_core::table::InstructionRow, v: u32| if r.len() == 2 { v >> 16 } else { v };
                let both = shift(a, a.pattern.mask) & shift(b, b.pattern.mask);
                let overlap = (shift(a, a.pattern.value) ^ shift(b, b.pattern.value)) & both == 0;
                assert_eq!(overlap, wanted.contains(&(a.name, b.name)), "{} and {}", a.name, b.name);
            }
        }
    }
}
