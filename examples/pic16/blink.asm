; Turns the lamp at RB0 whenever timer 0 overflows: every 16.384 ms at 4 MHz.
;
;   emu run examples/pic16/blink.hex --mcu pic16f873 --for 1s --vcd blink.vcd
        list    p=16f873, r=dec
        #include <p16f873.inc>
        __CONFIG _XT_OSC & _WDT_OFF & _PWRTE_ON & _BODEN_OFF & _LVP_OFF

w_kept  equ     0x20            ; 0xA0 too, for interrupts that come in bank 1
s_kept  equ     0x21

        org     0
        goto    main

        org     4
        movwf   w_kept
        swapf   STATUS, W       ; leaves the flags alone
        clrf    STATUS
        movwf   s_kept
        bcf     INTCON, T0IF
        movlw   1
        xorwf   PORTB, F
        swapf   s_kept, W
        movwf   STATUS
        swapf   w_kept, F
        swapf   w_kept, W
        retfie

main    clrf    PORTB
        movlw   0x85            ; timer 0 counts instruction cycles, one in 64
        bsf     STATUS, RP0
        movwf   OPTION_REG ^ 0x80
        bcf     TRISB ^ 0x80, 0
        bcf     STATUS, RP0
        movlw   (1 << GIE) | (1 << T0IE)
        movwf   INTCON
wait    goto    wait
        end
