; Sends "Hi\n" at 1 Mbaud (UBRR0 = 0: 16 clocks a bit), waits for the last stop bit, raises PB5 and halts.
sbi   0x04, 5        ; DDRB
ldi   r16, 0x08      ; TXEN0
sts   0x00C1, r16    ; UCSR0B
ldi   r16, 0x48
sts   0x00C6, r16    ; UDR0: the first byte goes to the shift register at once
ldi   r16, 0x69
sts   0x00C6, r16    ; the second waits in the buffer
lds   r17, 0x00C0    ; UCSR0A
sbrs  r17, 5         ; UDRE0
rjmp  0x0014
ldi   r16, 0x0A
sts   0x00C6, r16
lds   r17, 0x00C0
sbrs  r17, 6         ; TXC0
rjmp  0x0022
sbi   0x05, 5        ; PORTB
rjmp  0x002C
