//! The driver program that executes the cases in sequence, on either machine.
//!
//! It reads records of [`RECORD`] bytes from code memory, sets up a state from each, and jumps to the
//! instruction under test with RET. After that instruction, control returns to the program from any address:
//! the rest of code memory is a "sea" of the byte 11h, which at any alignment is `acall 0x011` within its
//! page. The call pushes the landing address and reaches an `ljmp` to [`COLLECT`], because every page has one
//! at 011h. For each case, [`RESULT`] bytes go to XDATA, from address 0.
//!
//! All 256 bytes of idata are under test, so the program keeps its own data in registers that no instruction
//! under test names: RCAP2 points to the record, timer 2 to the result, timer 1 holds temporary values, timer
//! 0 counts the cycles.

/// The filler byte of the sea.
pub const SEA: u8 = 0x11;
/// The address that all landings reach. Its bytes are sea as well, so that control may land on the jumps to
/// it.
pub const COLLECT: u16 = 0x1111;
/// Offset of the jump to [`COLLECT`] in every page of 2 KB.
pub const PAD: u16 = 0x011;
/// First address of the XDATA area for MOVX under test.
pub const XDATA: u16 = 0xFC00;

/// Size of a record in bytes; [`at`] gives its layout.
pub const RECORD: usize = 16;
/// Size of a result in bytes; [`gave`] gives its layout.
pub const RESULT: usize = 8;

/// Layout of a record.
pub mod at {
    /// Address of the instruction, low byte first; 0 in the high byte ends the run.
    pub const SITE: usize = 0;
    /// Byte 0 of idata. The program uses it as R0 and therefore sets it last.
    pub const CELL0: usize = 2;
    pub const B: usize = 3;
    pub const PSW: usize = 4;
    pub const SP: usize = 5;
    pub const A: usize = 6;
    pub const DPL: usize = 7;
    /// High byte of DPTR. P2 gets it too, with the bits set that direct MOVX to its part of XDATA.
    pub const DPH: usize = 8;
    /// Three pairs of an idata address and its byte.
    pub const POKES: usize = 9;
    pub const P1: usize = 15;
}

/// Layout of a result. In addition to these constants: at 2 the landing address plus two, high byte first; at
/// 4 SP; at 5 the cycles, with the same constant offset in every case; at 7 a checksum of the 256 bytes of
/// idata.
pub mod gave {
    pub const A: usize = 0;
    pub const PSW: usize = 1;
    /// Checksum of B, DPL, DPH, P1 and P3.
    pub const SFRS: usize = 6;
}

/// Returns the source of the program at [`COLLECT`], with labels, for records at `records`.
fn text(records: u16) -> String {
    let mut t = String::from(
        "
        clr TR0
        mov TH1, A
        mov TL1, PSW
        mov PSW, #0
        mov A, B
        xrl A, DPL
        rl A
        add A, DPH
        rl A
        xrl A, P1
        rl A
        add A, P3
        mov B, A
        mov DPL, TL2
        mov DPH, TH2
        mov A, TH1
        movx @DPTR, A
        inc DPTR
        mov A, TL1
        movx @DPTR, A
        inc DPTR
        pop ACC
        movx @DPTR, A
        inc DPTR
        pop ACC
        movx @DPTR, A
        inc DPTR
        mov A, SP
        movx @DPTR, A
        inc DPTR
        mov A, TL0
        movx @DPTR, A
        inc DPTR
        mov A, B
        movx @DPTR, A
        inc DPTR
        mov PSW, #0
        clr A
    ",
    );
    // The checksum of idata. Exclusive-or and add with carry alternate, so that the order matters.
    let turns = ["xrl", "addc"];
    for cell in 0..0x80 {
        t += &format!("{} A, 0x{cell:02X}\n", turns[cell % 2]);
    }
    t += "mov TH1, 0x00\n mov R0, #0x80\n";
    for cell in 0x80..0x100 {
        t += &format!("{} A, @R0\n inc R0\n", turns[cell % 2]);
    }
    t += "
        mov 0x00, TH1
        movx @DPTR, A
        inc DPTR
        mov TL2, DPL
        mov TH2, DPH
        mov A, RCAP2L
        add A, #16
        mov RCAP2L, A
        jnc next
        inc RCAP2H
      next:
        mov PSW, #0
        mov DPL, RCAP2L
        mov DPH, RCAP2H
        mov A, #1
        movc A, @A+DPTR
        jz stop
        mov TH1, A
        clr A
        movc A, @A+DPTR
        mov TL1, A
    ";
    let take = |from: usize| format!("mov A, #{from}\n movc A, @A+DPTR\n");
    for poke in 0..3 {
        t += &format!("{} mov R0, A\n", take(at::POKES + 2 * poke));
        t += &format!("{} mov @R0, A\n", take(at::POKES + 2 * poke + 1));
    }
    t += &format!("{} mov P1, A\n", take(at::P1));
    t += &format!("{} mov R0, A\n", take(at::CELL0));
    t += &format!("{} mov B, A\n", take(at::B));
    t += &format!("{} mov SP, A\n push TL1\n push TH1\n", take(at::SP));
    t += &format!("{} mov TL1, A\n", take(at::PSW));
    t += &format!("{} mov TH1, A\n", take(at::A));
    t += &format!("{} mov TL0, A\n", take(at::DPL));
    t += &take(at::DPH);
    t += &format!(
        "
        mov DPH, A
        orl A, #0x{:02X}
        mov P2, A
        mov DPL, TL0
        mov TL0, #0
        mov TH0, #0
        mov PSW, TL1
        mov A, TH1
        setb TR0
        ret
      stop:
        sjmp $
      start:
        mov TMOD, #1
        mov DPTR, #0x{records:04X}
        mov R0, #255
      fill:
        clr A
        movc A, @A+DPTR
        inc DPTR
        mov @R0, A
        djnz R0, fill
        mov DPTR, #0x{XDATA:04X}
      extern:
        clr A
        movc A, @A+DPTR
        xrl A, DPL
        movx @DPTR, A
        inc DPTR
        mov A, DPH
        jnz extern
        mov RCAP2L, #0x{:02X}
        mov RCAP2H, #0x{:02X}
        mov TL2, #0
        mov TH2, #0
        ljmp next
    ",
        XDATA >> 8,
        records & 0xFF,
        records >> 8
    );
    t
}

/// The assembled program.
pub struct Program {
    /// The bytes from [`COLLECT`].
    pub bytes: Vec<u8>,
    /// Start address.
    pub start: u16,
    /// End address: a jump to itself.
    pub stop: u16,
}

/// Assembles the program for records at `records`.
pub fn program(records: u16) -> Program {
    let text = format!(".org {COLLECT}\n{}", text(records));
    let chip = emu_8051::chips::chip("8052").expect("a chip");
    let image = emu_asm::assemble_text(chip, &text).unwrap_or_else(|e| panic!("{e}\n{text}"));
    let of = |name: &str| image.symbols.iter().find(|s| s.name == name).map_or(0, |s| s.addr as u16);
    let bytes = image.segments.iter().flat_map(|s| s.bytes.iter().copied()).collect();
    Program { start: of("start"), stop: of("stop"), bytes }
}
