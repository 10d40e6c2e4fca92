; Sends each byte that comes in again, plus one. 9600 baud at 11.0592 MHz.
mov   TMOD, #0x20
mov   TH1, #0xFD
mov   TL1, #0xFD
mov   SCON, #0x50
setb  TR1
jnb   RI, 0x000E
clr   RI
mov   A, SBUF
inc   A
mov   SBUF, A
sjmp  0x000E
