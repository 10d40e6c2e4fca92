; An absolute program: names of all kinds, a configuration word, EEPROM.
	list p=16f873
STATUS	equ 3
LIMIT	equ 5
	cblock 0x21
count
pair:2
far:1
	endc
last	equ 0x7f
	__config 0x3FF9
	org 0
start	movlw LIMIT
	movwf count
loop	decfsz count,1
	goto loop
	org 0x800
deep
	bsf	STATUS,5
	return
	org 0x2100
cells	de 1,2,3
	end
