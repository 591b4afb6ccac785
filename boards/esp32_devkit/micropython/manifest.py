include("../../frozen", board="esp32_devkit")  # noqa: F821
