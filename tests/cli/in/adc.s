; Converts ADC1 with AVCC as the reference (DS40002061, section 24).
ldi r16, 0x41
sts 0x7C, r16
ldi r16, 0xC7
sts 0x7A, r16
lds r17, 0x7A
sbrc r17, 6
rjmp .-8
rjmp .-2
