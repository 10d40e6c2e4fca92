//! Hand-made cases from the data sheets. At 4 MHz 1 us is 4 clocks. TACQ of equation 11-1 is 19.72 us, 79
//! clocks, of which the first 3.25 us, 13 clocks, are settling time.

use crate::script::check;

#[test]
fn conversion_times() {
    check(
        "
        # From GO to ADIF: 12 TAD, 9.5 TAD for 8 bits; TADs of 2, 8, 32, 16 clocks.
        DS30292 11.4 Fosc/8: 24 instruction cycles       | 87X  | - | 4:ADCON0=41 200:ADCON0=45 295:ADCON0?45 296:ADIF 296:ADCON0?41
        DS30292 11.4 Fosc/32                             | 87X  | - | 4:ADCON0=81 200:ADCON0=85 583:ADCON0?85 584:ADIF 584:ADCON0?81
        DS30292 11.4 Fosc/2: the first segment is TCY    | 87X  | - | 4:ADCON0=01 200:ADCON0=05 225:ADCON0?05 226:ADIF 226:ADCON0?01
        DS30292 15 note 134, RC: TCY more                | 87X  | - | 4:ADCON0=C1 200:ADCON0=C5 395:ADCON0?C5 396:ADIF 396:ADCON0?C1
        DS30292 R11-2 no ADCS2 on the 87X                | 87X  | - | 4:ADCON1=FF 5:ADCON1?8F 8:ADCON0=01 200:ADCON0=05 226:ADIF
        DS39582 R11-1 Fosc/4                             | 87XA | - | 4:ADCON1=FF 5:ADCON1?CF 8:ADCON0=01 200:ADCON0=05 248:ADIF
        DS39582 R11-1 Fosc/16                            | 87XA | - | 4:ADCON1=40 8:ADCON0=41 200:ADCON0=45 392:ADIF
        DS39582 R11-1 Fosc/64                            | 87XA | - | 4:ADCON1=40 8:ADCON0=81 200:ADCON0=85 968:ADIF
        DS39582 R11-1 ADCS2 and RC is RC                 | 87XA | - | 4:ADCON1=40 8:ADCON0=C1 200:ADCON0=C5 396:ADIF
        DS30487 12   ADCS2 of the 88                     | 88   | - | 4:ADCON1=FF 5:ADCON1?F0 8:ADCON0=01 200:ADCON0=05 248:ADIF
        DS31021 8 bits, Fosc/8; ADIF in ADCON0 bit 1     | 8    | - | 4:ADCON0=41 200:ADCON0=45 275:ADCON0?45 276:ADIF 276:ADCON0?43 280:ADCON0=41 281:ADCON0?41
        DS31021 8 bits, Fosc/32                          | 8    | - | 4:ADCON0=81 200:ADCON0=85 504:ADIF
        DS31021 8 bits, Fosc/2: the first is TCY         | 8    | - | 4:ADCON0=01 200:ADCON0=05 220:ADIF
        DS31021 8 bits, RC                               | 8    | - | 4:ADCON0=C1 200:ADCON0=C5 356:ADIF
        DS31021 ADIF can be set by the program           | 8    | - | 4:ADCON0=FF 5:ADCON0?DB 8:ADCON1=FF 9:ADCON1?03 9:ADRESL?00
        polling may skip to the end                      | 87X  | - | 4:ADCON0=41 5:steady.ADCON0?- 200:ADCON0=45 201:steady.ADCON0?296 201:steady.ADRESH?296 201:steady.ADCON1?- 296:ADIF
        ",
    );
}

#[test]
fn starting_and_aborting() {
    check(
        "
        DS30292 11.4 ADON and GO together do not start   | 87X  | - | 4:ADCON0=45 5:ADCON0?41 200:ADCON0=45 296:ADIF
        DS30292 R11-1 GO without ADON                    | 87X  | - | 4:ADCON0=44 5:ADCON0?40
        DS30292 R11-1 bit 1 reads 0                      | 87X  | - | 4:ADCON0=FB 5:ADCON0?F9
        DS30292 11.4 clearing GO leaves ADRES            | 87X  | - | 4:ADCON0=41 8:AN0=5000 180:ADRESH=12 184:ADRESL=34 200:ADCON0=45 292:ADCON0=41 400:ADRESH?12 400:ADRESL?34 400:ADCON0?41
        DS30292 11.4 so does clearing ADON               | 87X  | - | 4:ADCON0=41 180:ADRESH=12 200:ADCON0=45 240:ADCON0=44 241:ADCON0?40 400:ADRESH?12
        GO again changes nothing                         | 87X  | - | 4:ADCON0=41 200:ADCON0=45 240:ADCON0=45 296:ADIF
        GO written at the end starts anew                | 87X  | - | 4:ADCON0=41 200:ADCON0=45 296:ADCON0=45 296:ADIF 296:ADCON0?45 392:ADIF
        GO cleared at the end is too late                | 87X  | - | 4:ADCON0=41 8:AN0=5000 200:ADCON0=45 296:ADCON0=41 296:ADIF 296:ADRESH?FF
        DS30292 8.2.4 the special event sets GO          | 87X  | - | 4:ADCON0=41 200:start 200:ADCON0?45 296:ADIF
        DS30292 8.2.4 not while the module is off        | 87X  | - | 200:start 200:ADCON0?00
        DS30292 8.2.4 not while one is under way         | 87X  | - | 4:ADCON0=41 200:ADCON0=45 240:start 296:ADIF
        DS30292 11.5 Fosc stops in sleep: aborted        | 87X  | - | 4:ADCON0=41 200:ADCON0=45 204:sleep 1000:ADCON0?41 2000:wake 2078:acquired?0 2079:acquired?1
        DS30292 11.5 RC goes on in sleep                 | 87X  | - | 4:ADCON0=C1 8:AN0=2500 200:ADCON0=C5 204:sleep 395:ADCON0?C5 396:ADIF 396:ADCON0?C1 396:ADRESH?80
        DS30292 11.6 a reset ends it and keeps ADRES     | 87X  | - | 4:ADCON0=41 180:ADRESH=12 184:ADCON1=8E 200:ADCON0=45 240:reset 240:ADCON0?00 240:ADCON1?00 240:ADRESH?12
        no converter: nothing there                      | -    | - | 4:ADCON0=FF 8:ADCON1=FF 12:ADRESH=FF 16:ANSEL=FF 17:ADCON0?00 17:ADCON1?00 17:ADRESH?00 17:ANSEL?00 17:digital?FF 20:start
        ",
    );
}

#[test]
fn results() {
    check(
        "
        DS30292 11.4.1 left justified, 512               | 87X  | - | 4:ADCON0=41 4:AN0=2500 200:ADCON0=45 296:ADIF 296:ADRESH?80 296:ADRESL?00
        DS30292 11.4.1 right justified, 512              | 87X  | - | 4:ADCON0=41 8:ADCON1=80 9:AN0=2500 200:ADCON0=45 296:ADIF 296:ADRESH?02 296:ADRESL?00
        DS30292 11.4.1 left justified, 1023              | 87X  | - | 4:ADCON0=41 4:AN0=5000 200:ADCON0=45 296:ADIF 296:ADRESH?FF 296:ADRESL?C0
        DS33023 23   above the reference                 | 87X  | - | 4:ADCON0=41 8:ADCON1=80 9:AN0=6000 200:ADCON0=45 296:ADIF 296:ADRESH?03 296:ADRESL?FF
        DS33023 23   4.88 mV is the first step           | 87X  | - | 4:ADCON0=41 8:ADCON1=80 9:AN0=5 200:ADCON0=45 296:ADIF 296:ADRESH?00 296:ADRESL?01
        DS33023 23   below the first step                | 87X  | - | 4:ADCON0=41 8:ADCON1=80 9:AN0=4 200:ADCON0=45 296:ADIF 296:ADRESH?00 296:ADRESL?00
        VDD is the reference                             | 87X  | - | 2:VDD=4096 4:ADCON0=59 8:ADCON1=80 9:AN3=3000 200:ADCON0=5D 296:ADIF 296:ADRESH?02 296:ADRESL?EE
        DS31021 8 bits                                   | 8    | - | 4:ADCON0=59 8:AN3=2500 200:ADCON0=5D 276:ADIF 276:ADRESH?80
        DS30272 VREF on RA3                              | 8    | - | 4:ADCON0=41 8:ADCON1=01 9:AN3=2000 9:AN0=500 200:ADCON0=45 276:ADIF 276:ADRESH?40
        DS30487 12 VCFG1 is VREF+                        | 88   | - | 4:ADCON0=41 8:ADCON1=A0 9:AN3=4000 9:AN2=1000 9:AN0=2000 200:ADCON0=45 296:ADIF 296:ADRESH?02 296:ADRESL?00
        DS30487 12 VCFG0 is VREF-: 1000 of 4000 mV       | 88   | - | 4:ADCON0=41 8:ADCON1=90 9:AN3=4000 9:AN2=1000 9:AN0=2000 200:ADCON0=45 296:ADIF 296:ADRESH?01 296:ADRESL?00
        DS30487 12 ANSEL                                 | 88   | - | 0:ANSEL?7F 0:digital?80 4:ANSEL=85 5:ANSEL?05 5:digital?FA 8:reset 8:ANSEL?7F
        references the wrong way round                   | 87X  | - | 4:ADCON0=41 8:ADCON1=88 9:AN3=1000 9:AN2=4000 9:AN0=2000 200:ADCON0=45 296:ADIF 296:ADRESH?00 296:ADRESL?00
        the input after the sample does not matter       | 87X  | - | 4:ADCON0=41 4:AN0=2500 200:ADCON0=45 209:AN0=0 296:ADIF 296:ADRESH?80
        the channel after the sample does not matter     | 87X  | - | 4:ADCON0=41 4:AN0=2500 200:ADCON0=45 212:ADCON0=4D 296:ADIF 296:ADCON0?49 296:ADRESH?80
        ADRES are two bytes of RAM                       | 87X  | - | 4:ADRESH=A5 8:ADRESL=5A 9:ADRESH?A5 9:ADRESL?5A
        ",
    );
}

#[test]
fn acquisition() {
    check(
        "
        DS30292 eq 11-1: 19.72 us from power-on          | 87X  | - | 4:ADCON0=41 82:acquired?0 83:acquired?1
        DS30292 eq 11-1 with 0 ohms: 10.57 us            | 87X  | - | 2:Rs=0 4:ADCON0=41 46:acquired?0 47:acquired?1
        DS31021 8 bits: 12.0 us                          | 8    | - | 4:ADCON0=41 51:acquired?0 52:acquired?1
        a new channel starts it again                    | 87X  | - | 4:ADCON0=41 100:ADCON0=49 178:acquired?0 179:acquired?1
        other bits do not                                | 87X  | - | 4:ADCON0=41 100:ADCON0=C1 100:acquired?1
        DS30292 11.1 2 TAD after a conversion            | 87X  | - | 4:ADCON0=41 200:ADCON0=45 240:acquired?0 296:ADIF 390:acquired?0 391:acquired?1
        DS30292 11.4 2 TAD after an abort                | 87X  | - | 4:ADCON0=41 200:ADCON0=45 240:ADCON0=41 334:acquired?0 335:acquired?1
        a new channel in the 2 TAD does not shorten them | 87X  | - | 4:ADCON0=41 200:ADCON0=45 296:ADIF 300:ADCON0=49 390:acquired?0 391:acquired?1
        # 5 V from 0 V, RC 2.16 us: 35 clocks of charging leave e^-4.051 of it, 1006 steps are reached.
        too early: a value on the way                    | 87X  | - | 2:AN1=5000 4:ADCON1=80 8:ADCON0=41 200:ADCON0=49 240:ADCON0=4D 336:ADIF 336:ADRESH?03 336:ADRESL?EE
        in the settling time it has not begun            | 87X  | - | 2:AN1=5000 4:ADCON1=80 8:ADCON0=41 200:ADCON0=49 204:ADCON0=4D 300:ADIF 300:ADRESH?00 300:ADRESL?00
        # The same down: 87.03 mV are left, 17 steps.
        and down                                         | 87X  | - | 2:AN0=5000 4:ADCON1=80 8:ADCON0=41 200:ADCON0=49 240:ADCON0=4D 336:ADIF 336:ADRESH?00 336:ADRESL?11
        DS39582 11.1 CHOLD keeps its charge              | 87X  | - | 2:AN0=5000 4:ADCON1=80 8:ADCON0=41 200:ADCON0=45 296:ADIF 300:ADCON0=4D 396:ADIF 396:ADRESH?03 396:ADRESL?FF
        ",
    );
}

#[test]
fn comparators() {
    check(
        "
        DS40044 R10-1 after reset: off, pins analog      | - | 62X  | 0:CMCON?00 0:pins?0000 0:RA3=5000 0:CMCON?00
        DS39582 R12-1 after reset: off, pins digital     | - | 87XA | 0:CMCON?07 0:pins?1111 0:RA3=5000 0:CMCON?07
        DS30487 R13-1 after reset: off, pins digital     | - | 88   | 0:CMCON?07 0:pins?1111
        none: nothing there                              | - | -    | 4:CMCON=3F 8:CVRCON=FF 8:CMCON?00 8:CVRCON?00 8:pins?1111 8:out?-
        DS39582 12.2 VIN+ above VIN- is 1                | - | 87XA | 4:CMCON=02 8:RA3=2001 8:RA0=2000 8:CMIF 8:CMCON?42 9:RA3=2000 9:CMIF 9:CMCON?02
        DS39582 R12-1 inverted: equal inputs give 1      | - | 87XA | 4:CMCON=32 4:CMIF 4:CMCON?F2 8:RA3=1 8:CMIF 8:CMCON?B2 9:RA2=1 9:CMIF 9:CMCON?32
        DS39582 R12-1 off reads 0 even inverted          | - | 87XA | 4:CMCON=30 4:CMCON?30 8:CMCON=37 8:CMCON?37
        DS39582 12.6 mismatch until CMCON is read        | - | 87XA | 4:CMCON=02 8:RA3=100 8:CMIF 9:mismatch?1 9:peek.CMCON?42 9:mismatch?1 10:CMCON?42 10:mismatch?0
        DS39582 12.6 back again is no mismatch           | - | 87XA | 4:CMCON=02 8:RA3=100 8:CMIF 9:RA3=0 9:mismatch?0
        DS39582 12.6 a write ends it too                 | - | 87XA | 4:CMCON=02 8:RA3=100 8:CMIF 12:CMCON=02 12:mismatch?0
        DS39582 12.1 a change of mode may set CMIF       | - | 87XA | 4:RA3=100 8:CMCON=02 8:CMIF 8:mismatch?1
        DS39582 12.7 in sleep                            | - | 87XA | 4:CMCON=02 8:sleep 900:RA3=100 900:CMIF
        DS39582 12.5 outputs on RA4 and RA5              | - | 87XA | 4:CMCON=03 4:C1out?L 4:C2out?L 5:RA3=9 5:CMIF 5:C1out?H 6:RA2=9 6:CMIF 6:C2out?H 8:CMCON=02 8:C1out?port 8:C2out?port
        DS39582 12.1 mode 1 has one                      | - | 87XA | 4:CMCON=01 4:C1out?L 4:C2out?port 4:pins?0110
        DS40044 10.1 outputs on RA3 and RA4              | - | 62X  | 4:CMCON=06 4:C1out?L 5:RA2=9 5:CMIF 5:C1out?H 5:C2out?H 6:reset 6:C1out?port 6:C2out?port 6:CMCON?00
        DS40044 10.1 CIS in mode 1 is RA3 for C1 alone   | - | 62X  | 4:CMCON=01 5:RA2=100 5:CMIF 5:CMCON?C1 6:RA3=200 6:CMCON?C1 8:CMCON=09 8:CMIF 8:CMCON?89
        DS40044 10.1 CIS in mode 2 is RA3 and RA2        | - | 62X  | 4:CVRCON=80 8:CMCON=02 8:CMIF 8:CMCON?C2 9:RA3=1251 9:RA2=1249 9:CMCON?C2 12:CMCON=0A 12:CMIF 12:CMCON?8A
        DS39582 F13-1 low range: VDD / 4 + VDD CVR / 32  | - | 87XA | 0:out?- 0:reference?0 4:CVRCON=80 4:reference?1250 8:CVRCON=8F 8:reference?3593 12:CVRCON=88 12:reference?2500
        DS39582 F13-1 high range: VDD CVR / 24           | - | 87XA | 4:CVRCON=A0 4:reference?0 8:CVRCON=AF 8:reference?3125 12:CVRCON=AC 12:reference?2500 13:VDD=2400 13:reference?1200
        DS39582 R13-1 CVROE puts it on RA2               | - | 87XA | 4:CVRCON=C0 4:out?1250 8:CVRCON=40 8:out?- 8:reference?0 12:CVRCON=FF 12:CVRCON?EF
        the reference is exact: 3593.75 mV               | - | 87XA | 4:CVRCON=8F 5:RA0=3593 5:RA1=3594 8:CMCON=06 8:CMIF 8:CMCON?46
        ",
    );
}

#[test]
fn parallel_slave_port() {
    check(
        "
        # Q2 of cycle c is at clock 4c+1; the flags come at Q4, 4c+3.
        DS30292 3.6 outside of PSP mode nothing          | - | - | 4:CS=0 5:WR=0 6:WR=1 20:RD=0 20:driving?- 21:RD=1 30:TRISE?00 31:PORTD=55 31:TRISE?00
        DS30292 3.6 a write from outside                 | - | - | 4:TRISE=10 8:bus=5A 8:CS=0 9:WR=0 9:TRISE?10 13:WR=1 14:CS=1 14:bus=FF 14:TRISE?10 15:PSPIF 15:TRISE?90 16:PORTD?5A 16:TRISE?10
        DS30292 3.6 an edge after Q2 waits for the next  | - | - | 4:TRISE=10 8:CS=0 9:WR=0 14:WR=1 18:TRISE?10 19:PSPIF 19:TRISE?90
        DS30292 3.6 an edge in Q1                        | - | - | 4:TRISE=10 8:CS=0 9:WR=0 12:WR=1 15:PSPIF 15:TRISE?90
        DS30292 3.6 CS ends it as well                   | - | - | 4:TRISE=10 8:WR=0 8:bus=77 9:CS=0 13:CS=1 15:PSPIF 16:PORTD?77
        the latch follows while WR is low                | - | - | 4:TRISE=10 8:CS=0 8:bus=11 9:WR=0 9:PORTD?11 10:bus=22 10:PORTD?22 13:WR=1 14:bus=33 15:PSPIF 16:PORTD?22
        DS30292 3.6 overflow                             | - | - | 4:TRISE=10 8:CS=0 8:bus=11 9:WR=0 13:WR=1 15:PSPIF 17:bus=22 17:WR=0 21:WR=1 23:PSPIF 23:TRISE?B0 24:PORTD?22 24:TRISE?30 28:TRISE=10 28:TRISE?10
        two strobes before one Q2 are one                | - | - | 4:TRISE=10 8:CS=0 10:WR=0 11:WR=1 11:WR=0 12:WR=1 15:PSPIF 16:TRISE?90
        two around a Q2 are two                          | - | - | 4:TRISE=10 8:CS=0 10:WR=0 13:WR=1 13:WR=0 14:WR=1 15:PSPIF 15:TRISE?90 19:PSPIF 19:TRISE?B0
        DS30292 3.6 a read from outside                  | - | - | 4:TRISE=10 8:PORTD=C3 8:TRISE?50 8:driving?- 9:CS=0 10:RD=0 10:driving?C3 10:TRISE?10 13:RD=1 13:driving?- 15:PSPIF 15:TRISE?10
        DS30292 3.6 without CS nothing                   | - | - | 4:TRISE=10 8:PORTD=C3 9:RD=0 9:driving?- 9:TRISE?50 10:RD=1 11:WR=0 12:WR=1 20:TRISE?50
        the latch of port D is the output buffer         | - | - | 4:PORTD=3C 8:TRISE=10 8:TRISE?10 9:CS=0 9:RD=0 9:driving?3C 12:PORTD=3D 12:driving?3D 12:TRISE?50 13:RD=1 15:PSPIF 15:TRISE?50
        DS30292 R3-1 IBF and OBF cannot be written       | - | - | 4:TRISE=FF 4:TRISE?30 8:TRISE=C7 8:TRISE?00
        DS30292 3.6 leaving clears IBF and OBF, not IBOV | - | - | 4:TRISE=10 8:PORTD=11 8:CS=0 9:WR=0 13:WR=1 15:PSPIF 17:WR=0 21:WR=1 23:PSPIF 23:TRISE?F0 28:TRISE=20 28:TRISE?20 32:TRISE=10 32:TRISE?10
        leaving drops what waits for Q4                  | - | - | 4:TRISE=10 8:CS=0 9:WR=0 14:WR=1 16:TRISE=00 20:TRISE=10 30:TRISE?10
        a write of TRISE keeps IBF                       | - | - | 4:TRISE=10 8:CS=0 9:WR=0 13:WR=1 15:PSPIF 20:TRISE=17 20:TRISE?90
        DS30292 12.13.1 in sleep the edge sets the flag  | - | - | 4:TRISE=10 8:sleep 8:CS=0 9:WR=0 101:WR=1 101:PSPIF 101:TRISE?90 108:RD=0 110:RD=1 110:PSPIF
        sleep does not lose what waits                   | - | - | 4:TRISE=10 8:CS=0 9:WR=0 14:WR=1 16:sleep 16:PSPIF 16:TRISE?90
        polling may skip to the flag                     | - | - | 4:TRISE=10 5:steady.TRISE?- 8:CS=0 9:WR=0 14:WR=1 15:steady.TRISE?19 19:PSPIF
        reset                                            | - | - | 4:TRISE=30 8:CS=0 9:WR=0 13:WR=1 14:reset 20:TRISE?00
        ",
    );
}
