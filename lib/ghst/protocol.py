"""Names for what travels in GHST frames (description: Addresses, Control Packet IDs, Protocol)."""

BAUD_RATE = 420000
FRAME_SIZE = 14
FRAME_LENGTH = 12  # value of the length byte: type, ten bytes of payload, CRC

ADDRESS_RADIO = 0x80
ADDRESS_MODULE_SYMMETRIC = 0x81
ADDRESS_FC = 0x82
ADDRESS_GOGGLES = 0x83
ADDRESS_MODULE_ASYMMETRIC = 0x88
ADDRESS_RX = 0x89

# Uplink: legacy types are 0x10-0x1F; the same types plus TYPE_12_BIT carry 12-bit scaling.
TYPE_CHANNELS_5_TO_8 = 0x10
TYPE_CHANNELS_9_TO_12 = 0x11
TYPE_CHANNELS_13_TO_16 = 0x12
TYPE_LINK_DATA = 0x13
TYPE_VTX_CONTROL = 0x14
TYPE_VTX_SETUP = 0x20
TYPE_MSP_REQUEST = 0x21
TYPE_MSP_WRITE = 0x22
TYPE_12_BIT = 0x20

# Downlink.
TYPE_PACK_STATUS = 0x23
TYPE_GPS_PRIMARY = 0x25
TYPE_GPS_SECONDARY = 0x26
TYPE_MAG_BARO = 0x27
TYPE_MSP_RESPONSE = 0x28

# RF mode -> (name, frames per second, telemetry possible).
RF_MODES = {
    5: ("Normal", 55, True),
    6: ("Race", 160, True),
    7: ("PureRace", 250, False),
    8: ("Long Range", 19, True),
    10: ("Race250", 250, True),
    11: ("Race500", 500, False),
    12: ("Solid150", 150, False),
    13: ("Solid250", 250, False),
}
