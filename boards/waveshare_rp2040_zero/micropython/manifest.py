include("../../frozen", board="waveshare_rp2040_zero")  # noqa: F821
