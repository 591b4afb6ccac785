"""Names for what travels in GHST frames (description: Addresses, Control Packet IDs, Protocol)."""

try:
    from micropython import const
except ImportError:
    from ghst._host import const

from ghst.rf_modes import RF_MODES  # noqa: F401 - a part of this module for its users

BAUD_RATE = const(420000)
FRAME_SIZE = const(14)
FRAME_LENGTH = const(12)  # value of the length byte: type, ten bytes of payload, CRC

ADDRESS_RADIO = const(0x80)
ADDRESS_MODULE_SYMMETRIC = const(0x81)
ADDRESS_FC = const(0x82)
ADDRESS_GOGGLES = const(0x83)
ADDRESS_MODULE_ASYMMETRIC = const(0x88)
ADDRESS_RX = const(0x89)

# Uplink: legacy types are 0x10-0x1F; the same types plus TYPE_12_BIT carry 12-bit scaling.
TYPE_CHANNELS_5_TO_8 = const(0x10)
TYPE_CHANNELS_9_TO_12 = const(0x11)
TYPE_CHANNELS_13_TO_16 = const(0x12)
TYPE_LINK_DATA = const(0x13)
TYPE_VTX_CONTROL = const(0x14)
TYPE_VTX_SETUP = const(0x20)
TYPE_MSP_REQUEST = const(0x21)
TYPE_MSP_WRITE = const(0x22)
TYPE_12_BIT = const(0x20)

# Downlink.
TYPE_PACK_STATUS = const(0x23)
TYPE_GPS_PRIMARY = const(0x25)
TYPE_GPS_SECONDARY = const(0x26)
TYPE_MAG_BARO = const(0x27)
TYPE_MSP_RESPONSE = const(0x28)
