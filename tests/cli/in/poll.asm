        ; Waits for PD2, first low, then high.
up:     sbic    0x09, 2
        rjmp    up
down:   sbis    0x09, 2
        rjmp    down
        sbi     0x05, 5
end:    rjmp    end
