        ; A subroutine that never returns.
start:  rcall   wait
        nop
end:    rjmp    end
wait:   nop
here:   rjmp    here
