"""What a program sends over USART0 under yasimavr, its receiver fed with the same bytes: yasimavr_facts.py FILE.elf CYCLES."""
import sys

import yasimavr.lib.core as core
from yasimavr.device_library import load_device
from yasimavr.utils.uart import UART_IO

device = load_device("atmega328p")
# Registers that it does not know read 0; else the run ends there.
device.set_option(core.Device.Option.IgnoreBadCpuIO, True)
loop = core.SimLoop(device)
loop.set_fast_mode(True)
firmware = core.Firmware.read_elf(sys.argv[1])
firmware.frequency = 16_000_000
firmware.vcc = 5.0
firmware.aref = 1.0
device.load_firmware(firmware)


class Wire(UART_IO):
    """The receiver gets what the transmitter sends."""

    def _rx_hook_raised(self, sigdata, tag):
        before = self.available()
        super()._rx_hook_raised(sigdata, tag)
        if self.available() > before:
            self.write(self._rx_queue[-1])


uart = Wire(device, 0, "rw")
loop.run(int(sys.argv[2]))
sent = bytearray(uart.available())
uart.readinto(sent)
sys.stdout.write(sent.decode("latin1"))
