"""`Receiver`: feed it the bytes of a Ghost receiver, read channels and link data."""

from array import array

from ghst.decoder import (
    CRC_ERRORS,
    FOREIGN_FRAMES,
    FRAMES,
    LENGTH_ERRORS,
    LINE_QUIET,
    LINK_QUALITY,
    MEMORY_SIZE,
    MSP_FRAMES,
    RF_PROTOCOL,
    RSSI,
    SKIPPED_BYTES,
    TX_POWER,
    UNKNOWN_FRAMES,
    VTX_BAND_CHANNEL,
    VTX_FLAGS,
    VTX_FREQUENCY,
    VTX_POWER,
    append,
    prepare,
    scan,
    set_word,
    vtx_control,
    word,
)


class Receiver:
    """The receiving side of the protocol; no pins, no clock.

    `pulses` is an `array('H')` of 16 channels in quarter microseconds (6000 = 1500 us), 0 = never
    received. Everything else is read through the properties. `memory` is what `ghst.decoder` works
    on: a wire driver hands it to its interrupt. Counters go on at 0 after 2^30 - 1.
    """

    def __init__(self, memory=None):
        """Makes an empty receiver.

        `memory`: a bytearray of `decoder.MEMORY_SIZE` zeros, for drivers that need it at an
        address of their own choice; without it the receiver makes one.
        """
        self.memory = bytearray(MEMORY_SIZE) if memory is None else memory
        self.pulses = array("H", [0] * 16)
        prepare(self.memory)

    def feed(self, data, length=None):
        """Takes `data[:length]`, any number of received bytes; returns how many control frames.

        Counted are valid frames for the flight controller (address 0x82) that carry channels.
        Frames may be split over calls in any way. Never raises and never allocates, whatever the
        bytes; what is wrong with them is in the counters.
        """
        stop = len(data)
        if length is not None and length < stop:
            stop = length
        controls = 0
        start = 0
        while start < stop:
            start = append(self.memory, data, start, stop)
            controls += scan(self.memory, self.pulses)
        return controls

    def discard_partial(self):
        """Drops an unfinished frame, for callers that saw the line go quiet inside it."""
        set_word(self.memory, LINE_QUIET, 1)
        scan(self.memory, self.pulses)

    @property
    def frames(self):
        """Valid control frames so far."""
        return word(self.memory, FRAMES)

    @property
    def crc_errors(self):
        """Places where address and length were those of a frame but the CRC did not match."""
        return word(self.memory, CRC_ERRORS)

    @property
    def length_errors(self):
        """Address bytes followed by an impossible length, and control types of a wrong length."""
        return word(self.memory, LENGTH_ERRORS)

    @property
    def unknown_frames(self):
        """Valid frames for the flight controller whose type nobody has defined."""
        return word(self.memory, UNKNOWN_FRAMES)

    @property
    def foreign_frames(self):
        """Valid frames for somebody else; the echo of our own telemetry is one."""
        return word(self.memory, FOREIGN_FRAMES)

    @property
    def msp_frames(self):
        """Valid MSP requests and writes (0x21, 0x22) for the flight controller."""
        return word(self.memory, MSP_FRAMES)

    @property
    def skipped_bytes(self):
        """Bytes that were part of no valid frame."""
        return word(self.memory, SKIPPED_BYTES)

    @property
    def lq(self):
        """Link quality, 0..100 %; 0 before the first link data (0x13, 0x33)."""
        return word(self.memory, LINK_QUALITY)

    @property
    def rssi_dbm(self):
        """Signal strength in dBm, -255..0; 0 before the first link data."""
        return -word(self.memory, RSSI)

    @property
    def rssi_percent(self):
        """Signal strength between -117 dBm (0 %) and -60 dBm (100 %), clamped and rounded."""
        if not word(self.memory, RF_PROTOCOL) and not word(self.memory, RSSI):
            return 0
        above = 117 - word(self.memory, RSSI)
        return max(0, min(100, (above * 200 + 57) // 114))

    @property
    def rf_mode(self):
        """RF protocol number, 0..31 (`protocol.RF_MODES`); 0 = not known yet."""
        return word(self.memory, RF_PROTOCOL) & 0x1F

    @property
    def telemetry_requested(self):
        """Whether the last link data had the telemetry bit set."""
        return bool(word(self.memory, RF_PROTOCOL) & 0x20)

    @property
    def alt_scale(self):
        """Whether the last link data announced the new scaling (1) instead of the classic one."""
        return bool(word(self.memory, RF_PROTOCOL) & 0x40)

    @property
    def tx_power_dbm(self):
        """Transmitter power in dBm, -128..127."""
        return (word(self.memory, TX_POWER) ^ 0x80) - 0x80

    @property
    def vtx_flags(self):
        """Flags byte of the last VTX set-up frame (0x20)."""
        return word(self.memory, VTX_FLAGS)

    @property
    def vtx_freq_mhz(self):
        """Video frequency of the last VTX set-up frame in MHz; 0 = none seen."""
        return word(self.memory, VTX_FREQUENCY)

    @property
    def vtx_power_mw(self):
        """Video power of the last VTX set-up frame in mW; 0 = off."""
        return word(self.memory, VTX_POWER)

    @property
    def vtx_band_channel(self):
        """Band and channel nibbles of the last VTX set-up frame, as received."""
        return word(self.memory, VTX_BAND_CHANNEL)

    @property
    def vtx_control(self):
        """The four raw bytes of the last 0x14 frame, whose layout is not public."""
        return vtx_control(self.memory)
