# Copyright (c) 2026 the micropython-ghst authors
# SPDX-License-Identifier: MIT
"""The decoder: finds frames among the bytes of 'uart', as the firmware does, and marks them."""

import sigrokdecode as srd

from . import fields

UPLINK, DOWNLINK, FRAME, FIELD, CHANNEL, SLOT, CRC_ERROR, GARBAGE, NO_STOP_BIT = range(9)

# A frame that breaks off for so long will never be finished.
LONGEST_GAP_US = 150
SHOWN_BYTES = 16


class Byte:
    """A byte, where it is, and where each of its bits is."""

    def __init__(self, value, ss, es, bits):
        self.value = value
        self.ss = ss
        self.es = es
        self.bits = bits


class Line:
    """One line of 'uart': what has come and is not decided yet."""

    def __init__(self):
        self.waiting = []  # may be the beginning of a frame
        self.skipped = []  # belongs to no valid frame
        self.wrong = []  # (index in `skipped`, size) of what had a wrong CRC there
        self.bits = []  # of the byte that 'uart' is about to give
        self.control_es = None  # end of the control frame, if it was the last thing heard


class Decoder(srd.Decoder):
    api_version = 3
    id = "ghst"
    name = "GHST"
    longname = "ImmersionRC Ghost receiver"
    desc = "Control frames and telemetry between a Ghost receiver and a flight controller."
    license = "mit"
    inputs = ["uart"]
    outputs = []
    tags = ["RC"]
    annotations = (
        ("uplink", "From the receiver"),
        ("downlink", "From the flight controller"),
        ("frame", "Frame"),
        ("field", "Field"),
        ("channel", "Channel"),
        ("slot", "Telemetry slot"),
        ("crc-error", "CRC error"),
        ("garbage", "Bytes of no frame"),
        ("no-stop-bit", "No stop bit"),
    )
    annotation_rows = (
        ("directions", "Direction", (UPLINK, DOWNLINK)),
        ("frames", "Frames", (FRAME,)),
        ("fields", "Fields", (FIELD, CHANNEL)),
        ("slots", "Slot", (SLOT,)),
        ("crc-errors", "CRC errors", (CRC_ERROR,)),
        ("errors", "Other errors", (GARBAGE, NO_STOP_BIT)),
    )

    def __init__(self):
        self.samplerate = None
        self.reset()

    def reset(self):
        self.lines = {}

    def metadata(self, key, value):
        if key == srd.SRD_CONF_SAMPLERATE:
            self.samplerate = value

    def start(self):
        self.out_ann = self.register(srd.OUTPUT_ANN)

    def decode(self, ss, es, data):
        kind, rxtx, content = data
        line = self.lines.setdefault(rxtx, Line())
        if kind == "DATA":
            line.bits = content[1]
        elif kind == "FRAME":
            self.give_up_after_gap(line, ss)
            value, valid = content
            if valid:
                line.waiting.append(Byte(value, ss, es, line.bits))
                self.find_frames(line)
            else:
                self.put(ss, es, self.out_ann, [NO_STOP_BIT, ["no stop bit", "stop"]])
        elif kind == "IDLE":
            self.give_up_after_gap(line, es)

    def us(self, samples):
        """Samples as microseconds; None if nobody knows the sample rate."""
        return samples * 1e6 / self.samplerate if self.samplerate else None

    def give_up_after_gap(self, line, now):
        """Give up what is unfinished if the line was quiet for too long before `now`."""
        last = line.waiting or line.skipped
        if not last:
            return
        gap_us = self.us(now - last[-1].es)
        if gap_us is not None and gap_us > LONGEST_GAP_US:
            line.skipped += line.waiting
            line.waiting = []
            self.put_skipped(line)

    def find_frames(self, line):
        """Take every complete frame; a byte that cannot begin one is skipped alone."""
        waiting = line.waiting
        while waiting:
            size = 0
            if waiting[0].value in fields.ADDRESSES:
                if len(waiting) < 2:
                    return
                if waiting[1].value in fields.LENGTHS:
                    size = waiting[1].value + 2
                    if len(waiting) < size:
                        return
            octets = bytes(byte.value for byte in waiting[:size])
            if size and fields.crc8(octets[2:-1]) == octets[-1]:
                self.put_skipped(line)
                self.put_frame(line, waiting[:size], octets)
                del waiting[:size]
                continue
            if size:
                line.wrong.append((len(line.skipped), size))
            line.skipped.append(waiting.pop(0))

    def put_frame(self, line, received, octets):
        ss, es = received[0].ss, received[-1].es
        title = fields.title(octets[0], octets[2])
        self.put_direction(ss, es, octets[0])
        self.put(ss, es, self.out_ann, [FRAME, [title, "0x%02x" % octets[2]]])
        for bit, size, kind, texts in fields.describe(octets):
            first, last = received[bit // 8].bits, received[(bit + size - 1) // 8].bits
            begin, end = first[bit % 8][1], last[(bit + size - 1) % 8][2]
            number = CHANNEL if kind == fields.CHANNEL else FIELD
            self.put(begin, end, self.out_ann, [number, texts])
        if octets[0] == fields.RX and line.control_es is not None and self.samplerate:
            us = "%.1f us" % self.us(ss - line.control_es)
            self.put(line.control_es, ss, self.out_ann, [SLOT, ["slot " + us, us]])
        line.control_es = es if fields.is_control(octets) else None

    def put_direction(self, ss, es, address):
        if address == fields.RX:
            self.put(ss, es, self.out_ann, [DOWNLINK, ["flight controller to receiver", "down"]])
        else:
            self.put(ss, es, self.out_ann, [UPLINK, ["receiver to flight controller", "up"]])

    def put_skipped(self, line):
        """Annotate what is no valid frame: damaged frames, and bytes between them."""
        start = 0
        for index, size in line.wrong:
            if index >= start and index + size <= len(line.skipped):
                self.put_garbage(line.skipped[start:index])
                self.put_damaged(line.skipped[index : index + size])
                start = index + size
        self.put_garbage(line.skipped[start:])
        if line.skipped:
            line.control_es = None
        line.skipped, line.wrong = [], []

    def put_damaged(self, received):
        octets = bytes(byte.value for byte in received)
        ss, es = received[0].ss, received[-1].es
        title = fields.title(octets[0], octets[2])
        self.put_direction(ss, es, octets[0])
        self.put(ss, es, self.out_ann, [FRAME, [title + ", damaged", "damaged"]])
        right = fields.crc8(octets[2:-1])
        texts = ["CRC error: 0x%02x, must be 0x%02x" % (octets[-1], right), "CRC error", "CRC"]
        self.put(ss, es, self.out_ann, [CRC_ERROR, texts])

    def put_garbage(self, received):
        if not received:
            return
        shown = " ".join("%02x" % byte.value for byte in received[:SHOWN_BYTES])
        shown += " ..." if len(received) > SHOWN_BYTES else ""
        count = "%d byte%s" % (len(received), "" if len(received) == 1 else "s")
        texts = ["no frame, %s: %s" % (count, shown), "no frame, " + count, "no frame"]
        self.put(received[0].ss, received[-1].es, self.out_ann, [GARBAGE, texts])
