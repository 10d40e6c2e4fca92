#include <p16f877a.inc> ; é
 retlw 7
 end
