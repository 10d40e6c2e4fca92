        org 0
        clr P1.1
here:   sjmp here
