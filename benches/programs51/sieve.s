; The sieve of the odd numbers 3 to 16385 in 8 KB of XDATA, in an endless loop: 30h (low) and 31h hold the number of primes, 1899;
; 32h counts the rounds.
        mov  0x32, #0
round:  mov  DPTR, #0
        mov  R7, #0x20
fill:   mov  A, #1
        movx @DPTR, A
        inc  DPTR
        mov  A, DPH
        cjne A, #0x20, fill
        clr  A
        mov  R2, A              ; i
        mov  R3, A
        mov  R6, A              ; primes
        mov  R7, A
outer:  mov  DPL, R2
        mov  DPH, R3
        movx A, @DPTR
        jz   next
        mov  A, R2              ; step = 2 i + 3
        add  A, R2
        mov  R4, A
        mov  A, R3
        addc A, R3
        mov  R5, A
        mov  A, R4
        add  A, #3
        mov  R4, A
        clr  A
        addc A, R5
        mov  R5, A
cross:  mov  A, DPL
        add  A, R4
        mov  DPL, A
        mov  A, DPH
        addc A, R5
        mov  DPH, A
        add  A, #0xE0           ; 2000h and more: over the end
        jc   prime
        clr  A
        movx @DPTR, A
        sjmp cross
prime:  inc  R6
        cjne R6, #0, next
        inc  R7
next:   inc  R2
        cjne R2, #0, outer
        inc  R3
        cjne R3, #0x20, outer
        mov  0x30, R6
        mov  0x31, R7
        inc  0x32
        sjmp round
