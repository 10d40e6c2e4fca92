value   equ     55h
