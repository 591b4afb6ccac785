# Copyright (c) 2026 the micropython-ghst authors
# SPDX-License-Identifier: MIT
"""
This decoder stacks on top of the 'uart' PD and decodes GHST, the protocol between an ImmersionRC
Ghost receiver and a flight controller.

Both talk on one wire: 420000 baud, 8N1, idle high. Set the baud rate of 'uart' to 420000 and
connect the wire to its RX.

Shown are the direction of each frame, the frame, its fields with channels in microseconds, the
telemetry slot, and what is wrong: CRC errors, bytes that belong to no frame, bytes without a stop
bit. A frame that breaks off for more than 150 us is given up, as the firmware does.
"""

from .pd import Decoder
