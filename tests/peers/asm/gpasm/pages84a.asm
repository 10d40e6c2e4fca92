; chip: pic16f84a
; linked
; The page of a chip with one page has one name: PROG, but PROG1 on the PIC16F870 to 872. The other is a section as any.
        list    p=16f84a
start   code    0
        goto    main
PROG    code
main    goto    main
PROG1   code
        nop
        nop
PROG2   code
        nop
        nop
        nop
        end
