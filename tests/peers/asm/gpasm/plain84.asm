; chip: pic16f84
; The HEX file of 8 bits, names of the words of other assemblers, and a line for debuggers.
        list    p=16f84, f=inhx8m, r=dec
        include <p16f84.inc>
        __fuses _CP_OFF & _WDT_OFF & _HS_OSC
        cblock  0x0c
byte
word
        ds:2
        endc
ifeq    macro   f, k
        movlw   k
        xorwf   f, w
        endm
        org     3
        nop
        if      0
        ifeq    byte, 1
        endif
        ifeq    byte, 1
ascii
        addwf   PCL, f
        dt      "twelve words", 0
rept
        movf    word, w
        call    ascii
        goto    rept
        __idlocs 0x2468
        org     0x2100
        de      1, 2, "end"
        end
