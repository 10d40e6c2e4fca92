; A ladder of 32 rungs over bits: contacts a, b, c of every rung are bits of 30h to 37h, its coil is a bit of 32h to 37h; the inputs
; 30h and 31h are the count of scans, which is also at 20h,21h. A scan begins with a read of port B, kept at 22h, and ends
; with 36h on port C. A scan takes about 215 cycles.
;
; A rung of kind `and`: coil = a and b and not c. `or`: coil = (a or b) and not c. `set`: set by a and b, reset by c.
        processor 16f873
        include <p16f873.inc>
        __config _WDT_OFF & _PWRTE_OFF & _CP_OFF & _LVP_OFF & _BODEN_OFF & _HS_OSC
scanL   equ 20h
scanH   equ 21h
first   equ 30h

; Bit n of the 64 is bit n % 8 of 30h + n / 8.
at      macro op, n
        op first + (n) / 8, (n) % 8
        endm

rand    macro a, b, c, q
        local no, done
        at btfss, a
        goto no
        at btfss, b
        goto no
        at btfsc, c
        goto no
        at bsf, q
        goto done
no      at bcf, q
done
        endm

ror     macro a, b, c, q
        local test, no, done
        at btfsc, a
        goto test
        at btfss, b
        goto no
test    at btfsc, c
        goto no
        at bsf, q
        goto done
no      at bcf, q
done
        endm

rset    macro a, b, c, q
        local reset
        at btfss, a
        goto reset
        at btfsc, b
        at bsf, q
reset   at btfsc, c
        at bcf, q
        endm

        org 0
        bsf STATUS,RP0
        clrf TRISC
        bcf STATUS,RP0
        clrf scanL
        clrf scanH
        movlw first
        movwf FSR
clear   clrf INDF
        incf FSR,f
        btfss FSR,3
        goto clear
scan    movf PORTB,w
        movwf 22h
        incf scanL,f
        btfsc STATUS,Z
        incf scanH,f
        movf scanL,w
        movwf first
        movf scanH,w
        movwf first + 1
        rand    .6, .15, .0, .16
        ror     .7, .2, .16, .19
        rset    .2, .19, .12, .22
        rand    .9, .22, .22, .25
        ror     .12, .19, .7, .28
        rset    .5, .1, .7, .31
        rand    .7, .6, .5, .34
        ror     .12, .28, .1, .37
        rset    .7, .13, .5, .40
        rand    .10, .1, .10, .43
        ror     .5, .15, .3, .46
        rset    .7, .2, .5, .49
        rand    .11, .12, .0, .52
        ror     .0, .1, .28, .55
        rset    .15, .19, .5, .58
        rand    .2, .22, .1, .61
        ror     .4, .3, .22, .16
        rset    .4, .61, .7, .19
        rand    .0, .2, .19, .22
        ror     .2, .37, .8, .25
        rset    .5, .1, .1, .28
        rand    .2, .6, .55, .31
        ror     .7, .37, .6, .34
        rset    .12, .2, .25, .37
        rand    .6, .1, .1, .40
        ror     .2, .3, .9, .43
        rset    .1, .4, .4, .46
        rand    .3, .4, .0, .49
        ror     .4, .22, .22, .52
        rset    .0, .52, .52, .55
        rand    .3, .25, .34, .58
        ror     .6, .55, .43, .61
        movf first + 6,w
        movwf PORTC
        goto scan
        end
