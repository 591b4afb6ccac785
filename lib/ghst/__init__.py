"""The GHST protocol of ImmersionRC Ghost receivers, on MicroPython and CPython alike.

    import ghst

    receiver = ghst.Receiver()
    if receiver.feed(received_bytes):
        print(receiver.pulses[0] / 4, "us", receiver.lq, "%")

`ghst.encode` builds uplink frames, `ghst.protocol` names addresses, types and RF modes;
`ghst.telemetry` builds downlink frames, `ghst.schedule` decides which of them is next, and
`ghst.downlink` reads them.
"""

from ghst.receiver import Receiver

__version__ = "0.1.0"
__all__ = ("Receiver", "crc8", "downlink", "encode", "protocol", "schedule", "telemetry")


def __getattr__(name):
    # Loaded on first use: a board that only receives never pays their memory.
    if name in __all__[2:]:
        return getattr(__import__("ghst." + name), name)
    if name == "crc8":
        from ghst.crc import crc8

        return crc8
    raise AttributeError(name)
