; A timer interrupt every 1,000 cycles, at 12 MHz 1 kHz, while the program shifts a register: R3:R2 is the register, 32h to
; 34h count its shifts, 30h and 31h the ticks.
        ljmp main
        .org 0x0B
        ljmp tick
main:   clr  A
        mov  0x30, A
        mov  0x31, A
        mov  0x32, A
        mov  0x33, A
        mov  0x34, A
        mov  R2, #1
        mov  R3, A
        mov  SP, #0x40
        mov  TMOD, #0x01
        mov  TH0, #0xFC         ; -1,000
        mov  TL0, #0x18
        mov  IE, #0x82
        setb TR0
shift:  clr  C                  ; register = register >> 1 ^ (carry ? B400h : 0)
        mov  A, R3
        rrc  A
        mov  R3, A
        mov  A, R2
        rrc  A
        mov  R2, A
        jnc  count
        mov  A, R3
        xrl  A, #0xB4
        mov  R3, A
count:  inc  0x32
        mov  A, 0x32
        jnz  shift
        inc  0x33
        mov  A, 0x33
        jnz  shift
        inc  0x34
        sjmp shift
tick:   push ACC
        push PSW
        clr  TR0                ; on from where it is: 1,000 cycles less the seven in which it is stopped
        mov  A, TL0
        add  A, #0x1F
        mov  TL0, A
        mov  A, TH0
        addc A, #0xFC
        mov  TH0, A
        setb TR0
        inc  0x30
        mov  A, 0x30
        jnz  done
        inc  0x31
done:   pop  PSW
        pop  ACC
        reti
