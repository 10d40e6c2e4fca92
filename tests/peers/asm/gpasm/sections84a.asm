; chip: pic16f84a
; reports: 312
; linked
; One bank of RAM and one page.
        list    p=16f84a, r=dec
        include <p16f84a.inc>
        udata_shr
x       res     2
        code
main    banksel x
        pagesel main
        clrf    x+1
        goto    main
DEEPROM code
        de      1, 2
        end
