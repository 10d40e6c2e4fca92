; Writes 30h and bit 20h.0, reads both back, then reads bit 20h.1, which nobody wrote.
mov   0x30, #0x5A
setb  0x20.0
mov   A, 0x30
mov   C, 0x20.0
mov   C, 0x20.1
sjmp  0x000B
