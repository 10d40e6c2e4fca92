"""A full screen of emu and what may happen to its terminal: argv is the program and its arguments.

A terminal that is closed ends it as SIGHUP, one that ends it is as it was before, and one may say that it is of any size."""
import fcntl
import os
import resource
import select
import signal
import struct
import sys
import termios
import time


class Screen:
    """The program at a terminal of its own."""

    def __init__(self, size=(30, 100)):
        self.master, self.slave = os.openpty()
        fcntl.ioctl(self.slave, termios.TIOCSWINSZ, struct.pack("HHHH", *size, 0, 0))
        self.found = termios.tcgetattr(self.slave)
        self.pid = os.fork()
        if self.pid == 0:
            os.environ["TERM"] = "xterm"
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
            os.setsid()
            fcntl.ioctl(self.slave, termios.TIOCSCTTY, 0)
            for fd in range(3):
                os.dup2(self.slave, fd)
            os.closerange(3, 20)
            os.execv(sys.argv[1], sys.argv[1:])
        self.expect(b"quit")

    def read(self, seconds):
        """What is there; nothing at the end."""
        if not select.select([self.master], [], [], max(0, seconds))[0]:
            return None
        try:
            return os.read(self.master, 65536)
        except OSError:
            return b""

    def expect(self, wanted, seconds=120):
        seen, end = b"", time.time() + seconds
        while wanted not in seen:
            read = self.read(end - time.time())
            if not read:
                raise SystemExit(f"no {wanted!r} in {seen[-2000:]!r}")
            seen += read

    def ended(self, what, wanted, open=True, seconds=60):
        """Ends soon, and in this way."""
        end = time.time() + seconds
        while time.time() < end:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                if os.waitstatus_to_exitcode(status) != wanted:
                    raise SystemExit(f"{what}: it has ended with {status}")
                break
            if not open or self.read(0.05) is None:
                time.sleep(0.05)
        else:
            os.kill(self.pid, signal.SIGKILL)
            raise SystemExit(f"{what}: it goes on")
        if open and termios.tcgetattr(self.slave) != self.found:
            raise SystemExit(f"{what}: the terminal is not as it was")


def main():
    screen = Screen()
    os.close(screen.slave)
    os.close(screen.master)
    screen.ended("closed", -signal.SIGHUP, open=False)
    for number in [signal.SIGTERM, signal.SIGQUIT, signal.SIGHUP]:
        screen = Screen()
        os.kill(screen.pid, number)
        screen.ended(number.name, -number)
    screen = Screen((65535, 65535))
    os.write(screen.master, b"q")
    screen.ended("large", 0)
    print("well")


main()
