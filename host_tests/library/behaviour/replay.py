"""Feeds a receiver the chunks of a file, for the host to compare: a workload, not a test."""

from behaviour.support import heap_lock, heap_unlock
from ghst import Receiver

COUNTERS = (
    "crc_errors",
    "length_errors",
    "unknown_frames",
    "foreign_frames",
    "msp_frames",
    "skipped_bytes",
)


def run(path):
    """Yields, for each chunk, what `feed` returned, `frames`, the 16 pulses and the link data.

    In the file each chunk has its length in one byte before it. All errors must be zero.
    """
    receiver = Receiver()
    with open(path, "rb") as file:
        while size := file.read(1):
            chunk = file.read(size[0])
            heap_lock()
            controls = receiver.feed(chunk)
            heap_unlock()
            for name in COUNTERS:
                assert getattr(receiver, name) == 0, name
            values = [controls, receiver.frames]
            values += list(receiver.pulses)
            values += [receiver.lq, receiver.rssi_dbm, receiver.rf_mode, receiver.tx_power_dbm]
            yield values
