"""What a wheel holds. What it is called and needs stands in pyproject.toml.

Beside library and tools it has the firmware's declarations and the boards, so that `ghst config`
works outside a checkout (`ghst_tools.boards.resources`).
"""

from setuptools import find_packages, setup

SHIPPED = "ghst_tools.shipped"

setup(
    packages=[
        *find_packages("lib"),
        *find_packages("tools", include=["ghst_tools", "ghst_tools.*"]),
        f"{SHIPPED}.firmware",
        f"{SHIPPED}.firmware.configuration",
        f"{SHIPPED}.boards",
    ],
    package_dir={
        "ghst": "lib/ghst",
        "ghst_tools": "tools/ghst_tools",
        f"{SHIPPED}.firmware": "firmware",
        f"{SHIPPED}.boards": "boards",
    },
    package_data={f"{SHIPPED}.boards": ["*/board.json"]},
)
