; chip: pic16f877a
; linked
; Values that variables begin with, by all directives that give some.
        list    p=16f877a
v       idata
k1      dt      4, 5
k2      dt      "abc", 0
k3      db      6, "de"
k4      dw      7, "abc"
k5      data    1, "abc"
k6      da      0x1234, "ab"
k7      de      1, "ab"
start   code    0
main    goto    main
        end
