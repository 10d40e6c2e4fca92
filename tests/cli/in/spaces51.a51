; Writes and reads every memory. Cycles in front of each.
mov   0x30, #0x5A     ;  0 idata
mov   P1, #0xF0       ;  2 sfr
setb  0x20.3          ;  4 bit
mov   DPTR, #0x1234   ;  5
mov   A, #0x77        ;  7
movx  @DPTR, A        ;  8 xdata
mov   A, 0x30         ; 10
jnb   0x20.3, 0x0000  ; 11
clr   P1.7            ; 13
movx  A, @DPTR        ; 14
mov   R5, A           ; 16
sjmp  0x0017          ; 17
