; Waits until P3.2 is low, then lowers P1.0 and stops.
jb    P3.2, 0x0000
clr   P1.0
sjmp  0x0005
