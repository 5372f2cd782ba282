"""Maps folders to packages: those beside `slipgrasp/` are installed inside it."""

from setuptools import find_packages, setup

PACKAGES = ("core", "scene", "recordings", "figures", "server", "web")

setup(
    package_dir={f"slipgrasp.{folder}": folder for folder in PACKAGES},
    packages=[
        *find_packages(include=["slipgrasp", "slipgrasp.*"]),
        *(
            f"slipgrasp.{package}"
            for package in find_packages(
                include=[*PACKAGES, *(f"{folder}.*" for folder in PACKAGES)]
            )
        ),
    ],
)
