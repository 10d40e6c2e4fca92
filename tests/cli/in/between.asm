        ; Counts rounds in which PD2 was high.
loop:   rjmp    next
next:   sbic    0x09, 2
        inc     r18
        rjmp    loop
