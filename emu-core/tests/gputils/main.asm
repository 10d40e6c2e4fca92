; A program of two modules: globals, statics, a macro of an included file, messages.
	list p=16f873
	include "macros.inc"
	__config 0x3FF9
	extern sub1, shared
	global start
LIMIT	equ 5
bank0	udata
count	res 1
pair	res 2
vec	code 0
	goto start
prog	code
start	movlw LIMIT
	banksel count
	movwf count
loop	decfsz count,1
	goto loop
	twice
	.direct "a", "count == 0, 'it counts down'"
	call sub1
	.direct "C", "count = 7"
	.direct "e", "symbol turns=0"
done	goto done
ee	code 0x2100
cells	de 1,2,3
	.direct "a", "\"PASSED\""
	end
