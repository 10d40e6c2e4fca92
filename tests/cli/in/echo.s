; Sends each byte that comes in again, plus one. 9615 baud at 16 MHz.
ldi   r16, 103
sts   0x00C4, r16    ; UBRR0L
ldi   r16, 0x18      ; RXEN0, TXEN0
sts   0x00C1, r16    ; UCSR0B
lds   r17, 0x00C0    ; UCSR0A
sbrs  r17, 7         ; RXC0
rjmp  0x000C
lds   r16, 0x00C6    ; UDR0
inc   r16
sts   0x00C6, r16
rjmp  0x000C
