 list p=16f84a, r=dec
 extern beep
 udata_shr
count res 1
 code
start clrf count
 call beep
 goto start
 end
