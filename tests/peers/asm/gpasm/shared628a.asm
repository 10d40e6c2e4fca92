; chip: pic16f628a
; reports: 312
; linked
; relocatable module
	list	p=16f628a
	include	p16f628a.inc
	__config _INTOSC_OSC_NOCLKOUT & _WDT_OFF & _LVP_OFF
	global	main

	udata_shr
w_save	res	1
st_save	res	1
	udata
buf	res	8
ptr	res	1
cnt	res	2
ovl	udata_ovr
a1	res	1
rst	code	0
	pagesel	main
	goto	main
irq	code	4
	movwf	w_save
	swapf	STATUS,w
	movwf	st_save
	swapf	st_save,w
	movwf	STATUS
	swapf	w_save,f
	swapf	w_save,w
	retfie
prog	code
main	banksel	TRISB
	clrf	TRISB
	banksel	buf
	movlw	low buf
	movwf	FSR
	bankisel buf
loop	clrf	INDF
	incf	FSR,f
	decfsz	cnt,f
	goto	loop
	movlw	high tab
	movwf	PCLATH
	movf	cnt+1,w
	call	tab
	lcall	far
	goto	$
tab	addwf	PCL,f
	dt	1,2,3,"abc"
far	movlw	buf+2
	movwf	ptr
	return
	end
