; Toggles PB5 every 4 cycles: SBI takes 2, RJMP takes 2.
sbi   0x04, 5
sbi   0x03, 5        ; PINB
rjmp  0x0002
