"""`Receiver`: feed it the bytes of a Ghost receiver, read channels and link data."""

from array import array

from ghst.decoder import (
    COUNTER_MASK,
    CRC_ERRORS,
    FOREIGN_FRAMES,
    FRAMES,
    LENGTH_ERRORS,
    LINE_QUIET,
    LINK_QUALITY,
    MEMORY_SIZE,
    MSP_FRAMES,
    MSP_QUEUE,
    MSP_QUEUE_LENGTH,
    RF_PROTOCOL,
    RSSI,
    SKIPPED_BYTES,
    TX_POWER,
    UNKNOWN_FRAMES,
    VTX_CONTROL,
    VTX_CONTROLS,
    VTX_SETUP,
    VTX_SETUPS,
    append,
    prepare,
    scan,
    set_word,
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
        self.msp_lost = 0
        self._msp_read = 0
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

    def next_msp(self, payload):
        """Copies the ten payload bytes of the oldest MSP frame that waits into `payload`.

        Returns False, and copies nothing of use, if none waits. Eight wait at most; `msp_lost`
        counts those that newer ones took the place of. May be interrupted by the decoder.
        """
        memory = self.memory
        while True:
            waiting = (word(memory, MSP_FRAMES) - self._msp_read) & COUNTER_MASK
            if waiting == 0:
                return False
            if waiting > MSP_QUEUE_LENGTH:
                lost = waiting - MSP_QUEUE_LENGTH
                self.msp_lost = (self.msp_lost + lost) & COUNTER_MASK
                self._msp_read = (self._msp_read + lost) & COUNTER_MASK
            at = MSP_QUEUE + (self._msp_read & (MSP_QUEUE_LENGTH - 1)) * 16
            for index in range(10):
                payload[index] = memory[at + index]
            # Unless it was overwritten meanwhile.
            if (word(memory, MSP_FRAMES) - self._msp_read) & COUNTER_MASK <= MSP_QUEUE_LENGTH:
                self._msp_read = (self._msp_read + 1) & COUNTER_MASK
                return True

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
    def vtx_setups(self):
        """VTX set-up frames (0x20) so far."""
        return word(self.memory, VTX_SETUPS)

    @property
    def vtx_controls(self):
        """VTX control frames (0x14) so far."""
        return word(self.memory, VTX_CONTROLS)

    @property
    def vtx_flags(self):
        """Flags byte of the last VTX set-up frame (0x20)."""
        return self.memory[VTX_SETUP]

    @property
    def vtx_freq_mhz(self):
        """Video frequency of the last VTX set-up frame in MHz; 0 = none seen."""
        return self.memory[VTX_SETUP + 1] | self.memory[VTX_SETUP + 2] << 8

    @property
    def vtx_power_mw(self):
        """Video power of the last VTX set-up frame in mW; 0 = off."""
        return self.memory[VTX_SETUP + 3] | self.memory[VTX_SETUP + 4] << 8

    @property
    def vtx_band_channel(self):
        """Band and channel nibbles of the last VTX set-up frame, as received."""
        return self.memory[VTX_SETUP + 5]

    @property
    def vtx_control(self):
        """The four raw bytes of the last 0x14 frame, whose layout is not public; allocates."""
        return bytes(self.memory[VTX_CONTROL + 6 : VTX_CONTROL + 10])
