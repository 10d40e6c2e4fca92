; Asks for a clock that its chip does not have, and ends in a word that is no instruction:
; gpasm -c clock16.asm && gplink -o clock16.hex clock16.o
	list p=16f84
start	code 0
	.direct "e", ".frequency=12e6"
	movlw 0x35
	.direct "a", "W == 0x35, '*** FAILED movlw'"
	nop
	.direct "a", ".frequency == d'4000000', '*** FAILED frequency'"
	dw 1
	end
