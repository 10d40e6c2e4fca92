        ; Raises PB5 after 304 cycles.
        sbi     0x04, 5
        ldi     r16, 100
turn:   dec     r16
        brne    turn
        sbi     0x05, 5
end:    rjmp    end
