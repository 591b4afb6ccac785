include("../../frozen", board="rpi_pico")  # noqa: F821
