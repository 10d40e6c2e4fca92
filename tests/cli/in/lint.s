; What lints tell of on an AVR, one after the other. There are vectors, but no service routines.
rjmp  0x0070
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
rjmp  0x0000         ; TIMER0_OVF, at 0x40
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
nop
lds   r16, 0x0105    ; 0x70, cycle 2: a cell that nobody wrote
out   0x05, r16      ; 0x74, cycle 4: it makes a difference: PORTB
out   0x05, r20      ; 0x76, cycle 5: a register
ldi   r16, 8         ; 0x78
sts   0x00C4, r16    ; 0x7A: UBRR0L: 111111 baud
sts   0x00C1, r16    ; 0x7E: UCSR0B: TXEN0
sts   0x00C6, r16    ; 0x82, cycle 11: UDR0
in    r17, 0x09      ; 0x86: PIND
andi  r17, 4         ; 0x88
breq  0x008C         ; 0x8A, cycle 15: PD2; r17 is 0, so it goes on after two cycles
sts   0x00E0, r16    ; 0x8C, cycle 17: reserved
out   0x25, r16      ; 0x90, cycle 19: TCCR0B gets WGM02, which it has
ldi   r18, 0x31      ; 0x92
out   0x25, r18      ; 0x94, cycle 21: bits 4 and 5 it has not; the clock is on
ldi   r18, 1         ; 0x96
sts   0x006E, r18    ; 0x98: TIMSK0: TOIE0
ldi   r18, 0xFF      ; 0x9C
out   0x3D, r18      ; 0x9E, cycle 26: SPL
ldi   r18, 0         ; 0xA0
out   0x3E, r18      ; 0xA2, cycle 28: SPH: the stack begins below RAM
push  r18            ; 0xA4, cycle 29
ldi   r18, 0xFE      ; 0xA6
out   0x3E, r18      ; 0xA8
ldi   r19, 2         ; 0xAA
out   0x3E, r19      ; 0xAC: back in RAM
sei                  ; 0xAE, cycle 35
rjmp  0x00B0         ; 0xB0, cycle 36: TIMER0_OVF may come
