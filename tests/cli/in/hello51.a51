; Sends "Hi\n" in mode 0, 8 cycles a byte, and ends with a read of XDATA 7654h.
clr   TI
mov   SBUF, #0x48
jnb   TI, 0x0005
clr   TI
mov   SBUF, #0x69
jnb   TI, 0x000D
clr   TI
mov   SBUF, #0x0A
jnb   TI, 0x0015
mov   DPTR, #0x7654
movx  A, @DPTR
sjmp  0x001C
