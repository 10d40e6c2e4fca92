; chip: pic16f877a
; linked
; Sections of a module, large and small, with and without addresses.
        list    p=16f877a, r=dec
        include <p16f877a.inc>
        errorlevel -302
        __config _HS_OSC & _WDT_OFF & _LVP_OFF
        extern  elsewhere
        global  main, sum
first   udata
sum     res     10
second  udata
block   res     60
third   udata
buffer  res     30
here    udata   0x30
fixed   res     4
        udata_ovr
one     res     3
two     res     5
        udata_shr
count   res     2
top     udata_shr 0x78
mark    res     2
        udata_ovr
three   res     4
texts   idata
hello   db      "hi", 0
limit   dw      1000
        res     1
reset   code    0
        pagesel main
        goto    main
service code    4
        retfie
work    code
main    banksel buffer
        clrf    buffer
        bankisel buffer
        movlw   buffer
        movwf   FSR
        incf    count, f
        movlw   mark
        movlw   hello+1
        movlw   high main
        movlw   low(main+300)
        movlw   two-one
        pagesel large
        call    large
        pagesel $
        goto    main
room    code
large   nop
        fill    (nop), 1899
        return
middle  code
        fill    (nop), 700
table.a dt      "ab", low table.a
        data    table.a, table.a+1
PROG3   code
        goto    $
cells   code    0x2100
        de      "cells", 1
        org     0x60
        sleep
        end
