; reverse-next behind a call stops at the call again, not in the subroutine.
        ldi r16,1
        call f
        ldi r17,2
l:      rjmp l
f:      ldi r20,5
        ldi r21,6
        ret
