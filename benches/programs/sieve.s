; Computes the primes below 1024 with the sieve of Eratosthenes in bytes at data 0x0100 to 0x04FF, 1 for a prime, and writes their number to
; data 0x0500 and 0x0501, low byte first.
        ldi  r16, 1
        ldi  r20, 0
; start
        ldi  r26, 0x00          ; X = 0x0100
        ldi  r27, 0x01
        ldi  r24, 0x00          ; 1024 bytes
        ldi  r25, 0x04
; fill
        st   X+, r16
        sbiw r24, 1
        brne .-6                ; to fill
        sts  0x0100, r20        ; 0 and 1 are none
        sts  0x0101, r20
        ldi  r18, 2
; number
        ldi  r30, 0x00          ; Z = 0x0100 + number
        ldi  r31, 0x01
        add  r30, r18
        ld   r17, Z
        tst  r17
        breq .+18               ; to next, if it is crossed out
        mul  r18, r18           ; Z = 0x0100 + its square
        movw r30, r0
        subi r31, 0xFF
; cross
        cpi  r31, 5
        brcc .+8                ; to next, behind the end
        st   Z, r20
        add  r30, r18
        adc  r31, r20
        rjmp .-12               ; to cross
; next
        inc  r18
        cpi  r18, 32
        brne .-36               ; to number
        ldi  r26, 0x00          ; count them
        ldi  r27, 0x01
        ldi  r24, 0x00
        ldi  r25, 0x04
        ldi  r22, 0
        ldi  r23, 0
; count
        ld   r17, X+
        add  r22, r17
        adc  r23, r20
        sbiw r24, 1
        brne .-10               ; to count
        sts  0x0500, r22
        sts  0x0501, r23
        rjmp .-92               ; to start
