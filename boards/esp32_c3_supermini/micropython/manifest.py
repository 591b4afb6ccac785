include("../../frozen", board="esp32_c3_supermini")  # noqa: F821
