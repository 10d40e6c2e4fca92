; chip: atmega328p
; Sections out of order, with odd lengths: the linker puts them in its own.
 .section .text.b,"ax"
 .byte 3
 .text
 nop
main: lds r16, d
 lds r17, dx
 lds r18, r
 lds r19, rx
 lds r20, bq
 lds r21, b
 lds r22, n
 lds r23, b2
 ldi r30, lo8(p)
 ldi r31, lo8(pg)
 ldi r29, lo8(f9)
 rjmp f0
 rcall i3
 .section .rodata,"a"
r: .byte 5
 .data
d: .byte 4
 .section .rodata.x,"a"
rx: .byte 6
 .section .data.x,"aw"
dx: .byte 8
 .section .vectors,"ax"
 vec:
 rjmp main
 .byte 1
 .section .progmem.data,"a"
p: .byte 0xa1
 .section .progmem.gcc_sw,"a"
pg: .byte 0xa2
 .section .init3,"ax"
i3: nop
 .section .init1,"ax"
i1: .byte 0xb1, 0
 .section .fini0,"ax"
f0: rjmp .-2
 .section .fini9,"ax"
f9: ret
 .section .bss.q
bq: .skip 1
 .section .bss
b: .skip 1
 .section .noinit
 n: .skip 1
 .section .bss
 b2: .skip 1
 .section .eeprom.b,"aw"
 .byte 1
 .section .eeprom,"aw"
 .byte 2, 3
 .section .eeprom.b,"aw"
 .byte 4
 .pushsection .progmem.data,"a"
q: .asciz "kept"
 .popsection
 .byte 5
 .previous
 .byte 6
 .text
 ldi r30, lo8(q)
 .byte 9
