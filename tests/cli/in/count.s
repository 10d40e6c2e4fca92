; Counts its starts in the last cell of the EEPROM: DS40002061, section 8.4.
ldi r16, 0xFF
out 0x21, r16
ldi r16, 0x03
out 0x22, r16
sbi 0x1F, 0
in r17, 0x20
inc r17
out 0x20, r17
sbi 0x1F, 2
sbi 0x1F, 1
sbic 0x1F, 1
rjmp .-4
rjmp .-2
