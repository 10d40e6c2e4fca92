; Wants to write flash.
ldi   r16, 0x01
out   0x37, r16
spm
