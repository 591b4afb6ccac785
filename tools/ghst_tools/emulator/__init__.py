"""An emulated RP2040 board for tests, the benchmark and the demo.

`rp2040py` is the emulator; this package drives it in emulated time, without threads and without
the host's clock, and repairs from outside what it gets wrong. Each repair has its own module, and
says there what it is for.
"""

from ghst_tools.emulator.board import Board
from ghst_tools.emulator.i2c import I2cTarget
from ghst_tools.emulator.jumper import Jumper
from ghst_tools.emulator.meters import Pulse, PulseMeter
from ghst_tools.emulator.receiver import DownlinkFrame, GhostReceiver, SentFrame
from ghst_tools.emulator.repl import DeviceError
from ghst_tools.emulator.vcd import VcdRecorder
from ghst_tools.emulator.wire import Edge, Wire

__all__ = [
    "Board",
    "DeviceError",
    "DownlinkFrame",
    "Edge",
    "GhostReceiver",
    "I2cTarget",
    "Jumper",
    "Pulse",
    "PulseMeter",
    "SentFrame",
    "VcdRecorder",
    "Wire",
]
