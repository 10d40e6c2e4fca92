; Divides the clock by 1 (DS40002061, section 9.12.2).
ldi r16, 0x80
sts 0x61, r16
ldi r16, 0
sts 0x61, r16
rjmp .-2
