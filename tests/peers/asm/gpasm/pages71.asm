; chip: pic16c71
; linked
; A chip without EEPROM has no section for it: DEEPROM is a section as any.
        list    p=16c71
start   code    0
        goto    main
DEEPROM code
main    goto    main
        code
        nop
        nop
        end
