; Ends as programs of compiler tests do: bytes go out in serial mode 0 with TI set by hand at first, and a read of XDATA 7654h says that all is done.
;
;   emu run examples/8051/mode0.hex --mcu 8052 --until 'read xdata:0x7654' --uart -
        setb TI
        mov  R0, #3
        mov  R1, #0
again:  mov  A, R1              ; 3 + 2 + 1
        add  A, R0
        mov  R1, A
        djnz R0, again
        add  A, #0x30
        lcall put
        mov  A, #10
        lcall put
last:   jnb  TI, last
        mov  DPTR, #0x7654
        movx A, @DPTR
stop:   sjmp stop
put:    jnb  TI, put
        clr  TI
        mov  SBUF, A
        ret
