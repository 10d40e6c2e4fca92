        ; The watchdog resets the chip every 16 ms.
        ldi     r16, 0x18       ; WDCE, WDE: a change may come
        sts     0x60, r16       ; WDTCSR
        ldi     r16, 0x08       ; WDE, 16 ms
        sts     0x60, r16
wait:   inc     r17
        rjmp    wait
