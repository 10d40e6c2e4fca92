; Counts in RAM without end.
ldi   r16, 0x00
inc   r16
sts   0x0100, r16
rjmp  0x0002
