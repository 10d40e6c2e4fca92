; Names of all kinds, for another chip than the programs beside it: gpasm -o names16.hex names16.asm
	list p=16f877
	__config 0x3F31
LIMIT	equ 5
count	equ 0x25
	org 0
	goto start
	org 0x40
start	movlw LIMIT
	movwf count
	goto $
	end
