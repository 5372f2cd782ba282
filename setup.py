"""Says which folders are which packages: the rooms beside `slipgrasp/` are installed inside it."""

from setuptools import find_packages, setup

ROOMS = ("core", "scene", "recordings", "figures", "server", "web")

setup(
    package_dir={f"slipgrasp.{room}": room for room in ROOMS},
    packages=[
        *find_packages(include=["slipgrasp", "slipgrasp.*"]),
        *(
            f"slipgrasp.{package}"
            for package in find_packages(include=[*ROOMS, *(f"{room}.*" for room in ROOMS)])
        ),
    ],
)
