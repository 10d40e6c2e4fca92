"""Types at a terminal of `emu debug` as a user does: argv is the program and its arguments.

A run that never ends is stopped by Ctrl-C, twice, and behind a line that was edited; a line at the prompt is dropped by it; and the
session is left by Ctrl-D, with the terminal as it was before; so it is when a signal ends it at the prompt."""
import os
import pty
import select
import signal
import sys
import termios
import time


def main():
    pid, fd = pty.fork()
    if pid == 0:
        os.environ["TERM"] = "xterm"
        os.environ["XDG_STATE_HOME"] = os.environ["EMU_TEST_STATE"]
        os.execv(sys.argv[1], sys.argv[1:])
    seen = b""

    def expect(wanted, seconds=60):
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

    expect(b"(emu) ")
    for command in [b"continue\r", b"\r", b"finishx\x7f\x15c\r"]:
        os.write(fd, command)
        expect(b"\n")
        # The program runs, and raw mode is off: the key arrives as a signal.
        while termios.tcgetattr(fd)[3] & termios.ISIG == 0:
            time.sleep(0.01)
        time.sleep(0.3)
        os.write(fd, b"\x03")
        expect(b"Interrupted")
        expect(b"cycle ")
        expect(b"(emu) ")
    os.write(fd, b"p 1 + 1\rp 2 + 2\r")
    expect(b"$1 = 2")
    expect(b"$2 = 4")
    expect(b"(emu) ")
    os.write(fd, b"p 4711\x03")
    expect(b"(emu) ")
    os.write(fd, b"info cy\t\r")
    expect(b"instructions ")
    expect(b"(emu) ")
    os.write(fd, b"\x04")
    _, status = os.waitpid(pid, 0)
    if status != 0:
        raise SystemExit(f"it has ended with {status}")

    # A termination signal while the program runs.
    pid, fd = pty.fork()
    if pid == 0:
        os.environ["XDG_STATE_HOME"] = os.environ["EMU_TEST_STATE"]
        os.execv(sys.argv[1], sys.argv[1:])
    seen = b""
    expect(b"(emu) ")
    os.write(fd, b"continue\r")
    expect(b"\n")
    while termios.tcgetattr(fd)[3] & termios.ISIG == 0:
        time.sleep(0.01)
    time.sleep(0.3)
    os.kill(pid, signal.SIGTERM)
    expect(b"Interrupted")
    os.waitpid(pid, 0)

    # The same at the prompt: it ends by the signal and restores the terminal.
    pid, fd = pty.fork()
    if pid == 0:
        os.environ["XDG_STATE_HOME"] = os.environ["EMU_TEST_STATE"]
        os.execv(sys.argv[1], sys.argv[1:])
    seen = b""
    expect(b"(emu) ")
    raw = termios.tcgetattr(fd)[3]
    os.kill(pid, signal.SIGTERM)
    cooked = termios.ISIG | termios.ICANON | termios.ECHO
    end = time.time() + 20
    while termios.tcgetattr(fd)[3] & cooked != cooked:
        if time.time() > end:
            raise SystemExit(f"the terminal stays as the prompt has it: {raw:#x}, {termios.tcgetattr(fd)[3]:#x}")
        time.sleep(0.01)
    _, status = os.waitpid(pid, 0)
    if not os.WIFSIGNALED(status) or os.WTERMSIG(status) != signal.SIGTERM:
        raise SystemExit(f"it has ended with {status}")
    history = open(os.environ["EMU_TEST_STATE"] + "/emu/debug-history").read()
    if "info cycle" not in history:
        raise SystemExit(f"no history: {history!r}")
    print("well")


main()
