; reverse-next behind a call stops at the call again, not in the subroutine.
        mov r0,#1
        lcall f
        mov r1,#2
l:      sjmp l
f:      mov r2,#5
        mov r3,#6
        ret
        end
