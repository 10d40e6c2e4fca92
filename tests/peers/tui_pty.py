"""Types at `emu debug --tui` while a command takes long: argv is the program and its arguments.

Keys that are pressed meanwhile are taken behind it; Ctrl-C stops it, and drops the keys before."""
import fcntl
import os
import pty
import select
import struct
import sys
import termios
import time


def main():
    pid, fd = pty.fork()
    if pid == 0:
        os.environ["TERM"] = "xterm"
        # The size must be set before the program asks for it.
        fcntl.ioctl(0, termios.TIOCSWINSZ, struct.pack("HHHH", 30, 100, 0, 0))
        os.execv(sys.argv[1], sys.argv[1:])
    seen = b""

    def expect(wanted, seconds=120):
        nonlocal seen
        end = time.time() + seconds
        while wanted not in seen:
            if not select.select([fd], [], [], max(0, end - time.time()))[0]:
                raise SystemExit(f"no {wanted!r} in {seen!r}")
            try:
                seen += os.read(fd, 4096)
            except OSError:
                raise SystemExit(f"the end came before {wanted!r}, after {seen!r}")
        seen = seen.split(wanted, 1)[1]

    expect(b"quit")
    os.write(fd, b":run-to-cycle 400000000\r")
    time.sleep(0.4)
    os.write(fd, b":set r16 = 0x5a\r")
    expect(b"400000001")
    expect(b"5a")
    os.write(fd, b":run-to-cycle 1000000000000\r")
    time.sleep(0.4)
    os.write(fd, b"qq")
    time.sleep(0.2)
    os.write(fd, b"\x03")
    expect(b"Interrupted")
    os.write(fd, b":set r17 = 0x77\r")
    expect(b"77")
    os.write(fd, b"q")
    _, status = os.waitpid(pid, 0)
    if status != 0:
        raise SystemExit(f"it has ended with {status}")
    print("well")


main()
