; The other module, whose statics are named like those of the first.
	list p=16f873
	global sub1, shared
vars	udata
shared	res 3
count	res 1
prog2	code
sub1	clrf shared
loop	nop
	return
	end
