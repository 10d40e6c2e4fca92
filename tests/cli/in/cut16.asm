 list p=16f84a, r=dec
 org 0
 movlw 300
 movlw -d'195'
 bsf 0x0C,9
 movf 0x8C,w
 return 0
 ifdef __16F84A
 goto 0
 endif
 end
