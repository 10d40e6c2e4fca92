; chip: pic16f877a
; linked
; Names that other assemblers have as directives, and sections with values of which some are empty.
        list    p=16f877a, r=dec
va      idata
vb      idata
first   db      1, 2
        udata
byte    res     1
word    res     1
ds      res     1
start   code    0
        goto    main
        code
main    clrf    byte
elif    clrf    word
rept    incf    ds, f
elseif  goto    rept
irp
        goto    elif
vc      idata
        end
