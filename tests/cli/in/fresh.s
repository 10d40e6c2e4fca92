; Writes 0x100, reads it back, then reads 0x101, which nobody wrote.
ldi   r16, 0x5A
sts   0x0100, r16
lds   r17, 0x0100
lds   r18, 0x0101
rjmp  0x000E
