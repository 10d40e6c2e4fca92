; Converts ADC6 and ADC7 with AVCC as the reference, at the addresses of ATmega48 to 328: r20 and r21 have ADC6, r22 and r23 ADC7.
        ldi     r16, 0x46
        sts     0x7C, r16
        ldi     r16, 0xC2
        sts     0x7A, r16
first:  lds     r17, 0x7A
        sbrc    r17, 6
        rjmp    first
        lds     r20, 0x78
        lds     r21, 0x79
        ldi     r16, 0x47
        sts     0x7C, r16
        ldi     r16, 0xC2
        sts     0x7A, r16
second: lds     r17, 0x7A
        sbrc    r17, 6
        rjmp    second
        lds     r22, 0x78
        lds     r23, 0x79
end:    rjmp    end
