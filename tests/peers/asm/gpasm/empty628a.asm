; chip: pic16f628a
; linked
; Empty sections with values alone, with an address and without one.
        list    p=16f628a
va      idata   0x30
vb      idata
start   code    0
        goto    main
        code
main    goto    main
        end
