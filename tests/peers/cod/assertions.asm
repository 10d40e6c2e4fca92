; Expressions, names, symbols, and commands before and after an instruction.
	list p=16f873, r=dec
	include <p16f873.inc>
	include "messages.inc"
	udata
count	res 1
pair	res 2
	global count, pair
start	code 0
	bench "break c 2000"
	bench "symbol turns=0"
	bench "symbol from=0"
	bench "symbol limit=0x20"
	clrf STATUS
	movlw 0x35
	movwf count
	must "W == 0x35 && count == 53, '*** FAILED numbers'"
	nop
	must "count == $35 && count == 0x35 && count == 0b110101, '*** FAILED spellings'"
	nop
	must "(count & 0x0f) == 5, '*** FAILED mask'"
	nop
	must "(count >> 4) == 3 && (count << 1) == 0x6a, '*** FAILED shifts'"
	nop
	must "(count ^ 0xff) == 0xca && (count | 2) == 0x37, '*** FAILED or, xor'"
	nop
	must "count - 3 * 16 == 0 || count == 0x35, '*** FAILED or of comparisons'"
	nop
	must "!(count == 0x34) && -1 < 0 && count != 0, '*** FAILED signs'"
	nop
	must "limit < count && limit <= 0x20 && count > limit && count >= 53, '*** FAILED order'"
	nop
	must "(status & 0x18) == 0x18, '*** FAILED register'"
	nop
	must "option_reg == 0xff && trisb == 0xff, '*** FAILED bank 1'"
	nop
	does "from = cycles"
	nop
	nop
	must "cycles == from + 2, '*** FAILED cycles'"
	nop
	movlw 3
	movwf pair
loop	does "turns = turns + 1"
	decfsz pair,f
	goto loop
	must "turns == 3, '*** FAILED turns'"
	nop
	does "count = 0x12"
	nop
	must "count == 0x12, '*** FAILED a command that writes RAM'"
	nop
	movlw 7
	then "from = W"
	movlw 9
	must "from == 9, '*** FAILED a command after the instruction'"
	nop
	must "loop < here, '*** FAILED labels'"
here	nop
	.direct "a", "'*** PASSED assertions'"
	goto $
	global loop, here
	end
