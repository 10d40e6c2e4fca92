; chip: pic16f877
; Mnemonics that stand for others.
        list    p=16f877, r=dec
        errorlevel -302, -305, -318
start   nop
        skpc
        skpnc
        skpz
        skpnz
        skpdc
        skpndc
        setc
        clrc
        setz
        clrz
        setdc
        clrdc
        movfw     0x23
        movfw     0x7f
        movfw     0x1a3
        movfw     0
        tstf     0x23
        tstf     0x7f
        tstf     0x1a3
        tstf     0
        negf    0x23
        negf    0x23, w
        negf    0x23, f
        negf    0xa3, 0
        negf    0x23, 1
        addcf    0x23
        addcf    0x23, w
        addcf    0x23, f
        addcf    0xa3, 0
        addcf    0x23, 1
        subcf    0x23
        subcf    0x23, w
        subcf    0x23, f
        subcf    0xa3, 0
        subcf    0x23, 1
        adddcf    0x23
        adddcf    0x23, w
        adddcf    0x23, f
        adddcf    0xa3, 0
        adddcf    0x23, 1
        subdcf    0x23
        subdcf    0x23, w
        subdcf    0x23, f
        subdcf    0xa3, 0
        subdcf    0x23, 1
        b     start
        b     $
        b     behind
        bc     start
        bc     $
        bc     behind
        bnc     start
        bnc     $
        bnc     behind
        bz     start
        bz     $
        bz     behind
        bnz     start
        bnz     $
        bnz     behind
        bdc     start
        bdc     $
        bdc     behind
        bndc     start
        bndc     $
        bndc     behind
        lcall   start
        lcall   0x812
        lcall   0x1012
        lcall   0x1812
        lcall   behind
        lgoto   start
        lgoto   0x812
        lgoto   0x1012
        lgoto   0x1812
        lgoto   behind
        org     0x800
behind  LGOTO   behind
        SKPNC
        end
