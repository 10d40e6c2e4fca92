; chip: pic16f877
; The manner of listings that ladder editors write: every instruction with numbers for its operands, labels by address.
	LIST	p=16f877
	radix	dec
	ORG	0x0000
l_000000: goto	 l_000004	 	 
          nop	 		 	 
          nop	 		 ; of the interrupt
          retfie	 	 	 
    ; program start
l_000004: bcf	 0x03, 5	  ; (STATUS, RP0) ;; RP0
          bcf	 0x03, 6	 
          clrf	 0x04	 
          bsf	 0x03, 5	 
          movlw	 0xFE 	 ; 0xFE
          movwf	 0x06	 
          movlw	 0x07 	 
          movwf	 0x01	 
          bcf	 0x03, 5	 
l_00000d: clrwdt	 	 	 
          btfss	 0x0B, 2	 ; T0IF
          goto	 l_00000d	 	 
          bcf	 0x0B, 2	 
    ; ======= START RUNG 1 =======
          bcf	 0x20, 0	 
          btfsc	 0x06, 1	 ; Xkey
          bsf	 0x20, 0	 
          btfss	 0x20, 0	 
          goto	 l_000019	 	 
          decfsz 0x21, 1	 ; Tdelay
          goto	 l_00001a	 	 
          incf	 0x22, 0	 
l_000019: movwf	 0x22	 
l_00001a: call	 l_00001d	 	 
          goto	 l_00000d	 	 
          sleep				 
l_00001d: swapf	 0x22, 0	 
          xorwf	 0x22, 1	 
          retlw	 0x00 	 
	END
