include("../../frozen", board="adafruit_itsybitsy_rp2040")  # noqa: F821
