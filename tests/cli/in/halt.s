; Writes the last cell of the EEPROM and does not wait for the end.
ldi r16, 0x5A
out 0x20, r16
sbi 0x1F, 2
sbi 0x1F, 1
rjmp .-2
