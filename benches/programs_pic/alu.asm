; Registers only: a 16-bit sum of 9E35h per iteration, its rotation, parity folding, and a count of iterations; no waits, no peripherals.
; sumL,sumH at 20h; fold at 22h; turn at 23h,24h; 15 cycles per iteration, one more every 256 iterations.
        processor 16f873
        include <p16f873.inc>
        __config _WDT_OFF & _PWRTE_OFF & _CP_OFF & _LVP_OFF & _BODEN_OFF & _HS_OSC
sumL    equ 20h
sumH    equ 21h
fold    equ 22h
turnL   equ 23h
turnH   equ 24h

        org 0
        clrf sumL
        clrf sumH
        clrf fold
        clrf turnL
        clrf turnH
turn    movlw 35h
        addwf sumL,f
        btfsc STATUS,C
        incf sumH,f
        movlw 9Eh
        addwf sumH,f
        swapf sumL,w
        xorwf sumH,w
        addwf fold,f
        rlf fold,w
        rlf fold,f
        incfsz turnL,f
        goto turn
        incf turnH,f
        goto turn
        end
