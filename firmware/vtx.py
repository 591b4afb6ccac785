"""Settings of the video transmitter, as they come: frames of Ghost, and MSP.

def on_vtx(kind, application):
    if kind == vtx.SETUP:
        print(application.receiver.vtx_freq_mhz, "MHz")
"""

from micropython import const

CONTROL = const(0x14)  # from the receiver: four bytes whose layout is not public
SETUP = const(0x20)  # to goggles or radio: frequency, power, band and channel
MSP = const(89)  # SET_VTX_CONFIG


class VtxEvents:
    """Tells of each new frame, or of the newest where several came within a round."""

    def __init__(self, receiver, on_event):
        """Calls `on_event(kind)` from `update`, `kind` being CONTROL or SETUP."""
        self._receiver = receiver
        self._on_event = on_event
        self._controls = receiver.vtx_controls
        self._setups = receiver.vtx_setups

    def update(self, now_ms):
        """Looks for new frames, in every round of the main loop."""
        receiver = self._receiver
        if receiver.vtx_controls != self._controls:
            self._controls = receiver.vtx_controls
            self._on_event(CONTROL)
        if receiver.vtx_setups != self._setups:
            self._setups = receiver.vtx_setups
            self._on_event(SETUP)
