; chip: atmega8
; A program as people write them: bytes from the serial port drive a servo, without jumps of two words.
RAMEND = 0x045F
SPL = 0x3D
SPH = 0x3E
UBRRL = 0x09
UCSRB = 0x0A
UCSRA = 0x0B
UDR = 0x0C
DDRB = 0x17
TCCR1A = 0x2F
TCCR1B = 0x2E
OCR1AH = 0x2B
OCR1AL = 0x2A
ICR1H = 0x27
ICR1L = 0x26
RXC = 7
UDRE = 5
zero = 2
        .equ    clock, 8000000
        .equ    baud, 9600
        .equ    divisor, clock / (16 * baud) - 1
        .equ    top, clock / 8 / 50

        .text
        .global vectors
vectors:
        rjmp    reset
        .rept   18
        rjmp    unused
        .endr
unused: reti

        .macro  outi port, value
        ldi     r16, \value
        out     \port, r16
        .endm

        .macro  out16 port, value
        outi    \port\()H, hi8(\value)
        outi    \port\()L, lo8(\value)
        .endm

reset:  clr     zero
        outi    SPL, lo8(RAMEND)
        outi    SPH, hi8(RAMEND)
        sbi     DDRB, 1
        out16   ICR1, top
        out16   OCR1A, (clock / 8 / 1000)
        outi    TCCR1A, 0b10000010
        outi    TCCR1B, 0b00011010
        outi    UBRRL, divisor
        outi    UCSRB, (1 << 4) | (1 << 3)
        ldi     ZL, lo8(greeting)
        ldi     ZH, hi8(greeting)
1:      lpm     r16, Z+
        tst     r16
        breq    2f
        rcall   send
        rjmp    1b
2:      sbis    UCSRA, RXC
        rjmp    2b
        in      r16, UDR
        rcall   send
        mov     r18, r16
        clr     r19
        lsl     r18
        rol     r19
        lsl     r18
        rol     r19
        subi    r18, lo8(-(clock / 8 / 1000))
        sbci    r19, hi8(-(clock / 8 / 1000))
        out     OCR1AH, r19
        out     OCR1AL, r18
        rjmp    2b
send:   sbis    UCSRA, UDRE
        rjmp    send
        out     UDR, r16
        ret
greeting:
        .asciz  "servo\r\n"
        .balign 2
        .section .eeprom, "aw", @progbits
        .byte   1, 2, 3
limits: .word   1000, 2000
        .end
