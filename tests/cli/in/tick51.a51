; Timer 0 overflows every 256 cycles; between, the program is idle.
      ljmp main
      .org 0x0B
      inc  0x30
      reti
main: mov  TMOD, #2
      mov  IE, #0x82
      setb TR0
wait: orl  PCON, #1
      sjmp wait
