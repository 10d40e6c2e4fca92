; Arithmetic on registers: a 32-bit sum, products, quotients, decimal corrections and rotations, in an endless loop of 50
; cycles; R2 to R5 hold the sum (low byte first), R6 and R7 count the iterations, 30h to 33h hold the other results.
        clr  A
        mov  R2, A
        mov  R3, A
        mov  R4, A
        mov  R5, A
        mov  R6, A
        mov  R7, A
        mov  R0, #0x30
        mov  0x30, A
        mov  0x31, A
        mov  0x32, A
        mov  0x33, A
turn:   mov  A, R2              ; sum += 9E35C64Dh
        add  A, #0x4D
        mov  R2, A
        mov  A, R3
        addc A, #0xC6
        mov  R3, A
        mov  A, R4
        addc A, #0x35
        mov  R4, A
        mov  A, R5
        addc A, #0x9E
        mov  R5, A
        xrl  A, R2              ; 30h = (30h rotated left + R5 ^ R2) ^ low half of R3 * R5
        xch  A, @R0
        rl   A
        add  A, @R0
        mov  @R0, A
        mov  A, R5
        mov  B, R3
        mul  AB
        xrl  A, @R0
        mov  @R0, A
        mov  A, R4              ; 31h = quotient of R4 by 10 in the high half, remainder in the low one
        mov  B, #10
        div  AB
        swap A
        orl  A, B
        mov  0x31, A
        mov  A, 0x32            ; 32h counts the turns in decimal
        add  A, #1
        da   A
        mov  0x32, A
        mov  A, 0x33            ; 33h = ~(33h - R2) & 7Fh, exchanged by halves
        clr  C
        subb A, R2
        cpl  A
        anl  A, #0x7F
        swap A
        mov  0x33, A
        inc  R6
        cjne R6, #0, turn
        inc  R7
        sjmp turn
