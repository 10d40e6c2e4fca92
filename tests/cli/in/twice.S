; Twice r24, in r24.
        .text
        .global twice
twice:  add r24, r24
        ret
