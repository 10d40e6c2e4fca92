; Runs off its end into erased memory.
ldi   r24, 0x2A
nop
