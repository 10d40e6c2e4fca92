; Waits for PD2 high, then raises PB5 and halts.
sbi   0x04, 5
sbis  0x09, 2        ; PIND
rjmp  0x0002
sbi   0x05, 5
cli
rjmp  0x000A
