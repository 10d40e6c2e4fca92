; Toggles P1.0: 1 cycle and 2 cycles a turn.
cpl   P1.0
sjmp  0x0000
