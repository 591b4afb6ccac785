"""The RF modes of Ghost (description: Protocol); in a file of its own, since it is rarely used."""

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
