        ; Converts PC0 once, against the supply, to r21:r20.
        ldi     r16, 0x40
        sts     0x7C, r16       ; ADMUX: AVCC
        ldi     r16, 0xC7
        sts     0x7A, r16       ; ADCSRA: ADEN, ADSC, clock / 128
wait:   lds     r17, 0x7A
        sbrc    r17, 6
        rjmp    wait
        lds     r20, 0x78
        lds     r21, 0x79
end:    rjmp    end
