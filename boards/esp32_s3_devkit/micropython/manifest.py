include("../../frozen", board="esp32_s3_devkit")  # noqa: F821
