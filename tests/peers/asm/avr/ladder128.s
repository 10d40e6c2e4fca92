; chip: atmega128
; The manner of listings that ladder editors write: every instruction with numbers for its operands, labels by address.
        .org    0x0000
          rjmp	 l_000002	 ; RESET
          reti
    ; ======= START =======
l_000002: ldi	 r16, 0xFF	 ; 255
          out	 0x3D, r16
          ldi	 r16, 0x10
          out	 0x3E, r16
          ldi	 r26, 0x37
          ldi	 r27, 0x00
          ldi	 r25, 0xFE
          st	 X, r25
l_00000a: wdr
          ldi	 r28, 0x56
          ldi	 r29, 0
          ld	 r25, Y
          sbrs	 r25, 1
          rjmp	 l_00000a
          ori	 r25, 2
          st	 Y, r25
    ; ======= START RUNG 1 =======
          ldi	 r26, 0x00
          ldi	 r27, 0x01
          ld	 r25, X
          andi	 r25, 0xFE
          st	 X, r25
          sbis	 0x16, 1	 ; Xkey
          rjmp	 l_00001d
          ld	 r25, X
          ori	 r25, 1
          st	 X, r25
l_00001d: call	 l_000020
          rjmp	 l_00000a
l_000020: ret
