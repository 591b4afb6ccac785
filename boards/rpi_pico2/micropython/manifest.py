include("../../frozen", board="rpi_pico2")  # noqa: F821
