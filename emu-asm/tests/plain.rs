//! Plain programs of each family, byte by byte.

use emu_core::chip::Chip;

fn chip(name: &str) -> &'static Chip {
    let found =
        emu_8051::chips::chip(name).or_else(|| emu_avr::chips::chip(name)).or_else(|| emu_pic16::chips::chip(name));
    found.unwrap_or_else(|| panic!("no chip {name}"))
}

fn bytes(name: &str, text: &str) -> String {
    match emu_asm::image(chip(name), text) {
        Ok(image) => image
            .segments
            .iter()
            .map(|s| {
                format!("{} {:x}: {}", s.space, s.addr, s.bytes.iter().map(|b| format!("{b:02x}")).collect::<String>())
            })
            .collect::<Vec<_>>()
            .join("; "),
        Err(e) => e,
    }
}

#[test]
fn plain() {
    let text = "
        org 0
start:  mov a,#5
        mov dptr,#tab   ; forward
        mov c,acc.0
        setb p1.0
        clr flag
flag    bit 20h.3
        sjmp $
        jnb p1.1,start
count   equ 7
        mov r0,#count
        mov a,#LOW(tab)+1
        mov a,#high tab
        cjne a,#-1,start
        orl c,/p1.0
        movx @dptr,a
        push acc
        movc a,@a+dptr
tab:    db 1,2,\"abc\",'d',0FFH,101b
        dw 1234h,start
";
    println!("{}", bytes("8051", text));
    let text = "
main: ldi r16, lo8(main+2) ; c
 ldi r20, 1+2*3
 ldi r21, 1|2&3
 ldi r22, 7 & 3 + 1
 ldi r24, 017
 ldi r25, 'a'
 ldi r26, -1
 rjmp .
 rjmp .-2
 jmp main
 rjmp 1f
1: nop
 rjmp 1b
 out PORTB, r16
 lds r2, TCCR1A
 ldd r3, Y+5
 ld r4, -X
 clr r16
 .set temp, 16
 ldi temp, 3
x = 5
 ldi r16, x
 breq main
 .byte 1,2,3
 .word main, 0x1234
tab: .ascii \"abc\"
 .asciz \"d\\n\"
 .section .eeprom
 .byte 9
 .data
v: .byte 77
";
    println!("{}", bytes("atmega328p", text));
    let text = "
start movlw 20
 movwf PORTB
 bsf STATUS,5
 addwf 20,f
 addwf 20,0
 addwf 20,W
loop: goto loop
 btfss 20,3
 goto start
 call $
 org 2007
 dw 3fff
";
    println!("{}", bytes("pic16f873", text));
    println!(
        "{}",
        bytes(
            "8051",
            "\n mvo a,#5\n mov a,#300\n mov a,#tabb\ntab: mov x\n jb acc,1\nfoo: sjmp faraway\n org 1000\nfaraway: nop\n org 0\n nop\n if 1\n"
        )
    );
    println!("{}", bytes("atmega8", "jmp 0\n ldi r5, 1\n adiw r25, 1\n rjmp 3\n out UDR0, r1\n"));
}
