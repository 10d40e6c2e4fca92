; chip: pic16f877a
; linked
; Values that variables begin with, by all directives that give some.
        list    p=16f877a
v       idata
a       dt      4, 5
b       dt      "abc", 0
c       db      6, "de"
d       dw      7
start   code    0
        goto    start
        end
