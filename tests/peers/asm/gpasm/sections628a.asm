; chip: pic16f628a
; linked
; Three banks of different size, one page.
        list    p=16f628a, r=dec
        include <p16f628a.inc>
        errorlevel -302
ra      udata
a1      res     30
rb      udata
b1      res     60
rc      udata
c1      res     20
rd      udata   0x20
d1      res     4
        udata_shr
e1      res     3
start   code    0
        goto    main
        code
main    banksel a1
        clrf    a1
        banksel b1
        clrf    b1
        banksel c1
        clrf    c1
        clrf    e1
        movlw   d1
        goto    main
gap     res     2
small   code
        nop
        end
