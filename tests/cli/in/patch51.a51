; Makes CLR P1.0 of the SETB at 0Ch where XDATA is program memory too.
mov   DPTR, #0x000C
mov   A, #0xC2
movx  @DPTR, A
nop
nop
nop
nop
nop
nop
setb  P1.0
sjmp  0x000E
