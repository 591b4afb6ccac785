"""Settings of the video transmitter, as they come: frames of Ghost, and MSP.

def on_vtx(kind, application):
    if kind == vtx.SETUP:
        print(application.receiver.vtx_freq_mhz, "MHz")
"""

from micropython import const

CONTROL = const(0x14)  # from the receiver: four bytes whose layout is not public
SETUP = const(0x20)  # to goggles or radio: frequency, power, band and channel
MSP = const(89)  # SET_VTX_CONFIG
