; reverse-next behind a call stops at the call again, not in the subroutine.
        movlw 1
        call f
        movlw 2
l       goto l
f       movwf 20h
        movwf 21h
        return
        end
