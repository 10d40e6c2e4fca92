        include "part.asm"
        mov     P1, #value
        sjmp    $
