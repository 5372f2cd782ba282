"""Finds the programs that tests drive, Chromium and curl; as a script, installs what is missing."""

import os
import shutil
import subprocess
import sys

NAMES = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
)
PACKAGE_MANAGERS = {
    "apt-get": ("apt-get update", "apt-get install -y --no-install-recommends"),
    "dnf": ("dnf install -y",),
    "pacman": ("pacman -Sy --noconfirm",),
    "apk": ("apk add",),
}
PRINT_PLAYWRIGHTS_PATH = """
from playwright.sync_api import sync_playwright
with sync_playwright() as playwright:
    print(playwright.chromium.executable_path)
"""
# Software rendering, as on a machine without a screen.
FLAGS = (
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
    "--disable-gpu-compositing",
    "--disable-dev-shm-usage",
    "--hide-scrollbars",
)
HOW_TO_FIX = (
    "slipgrasp: the tests need Chromium and curl: install them with the system's package manager "
    "(Debian: apt-get install chromium curl), then repeat the command"
)


def find_chromium() -> str | None:
    """Returns the path of a Chromium or Chrome that starts, or None."""
    installed = (path for path in map(shutil.which, NAMES) if path and starts(path))
    return next(installed, None) or find_playwrights_chromium()


def find_playwrights_chromium() -> str | None:
    """Returns the path of the Chromium that Playwright has installed, or None."""
    # A process of its own, because Playwright cannot be started inside a running Playwright.
    command = [sys.executable, "-c", PRINT_PLAYWRIGHTS_PATH]
    path = subprocess.run(command, capture_output=True, text=True).stdout.strip()
    return path if path and starts(path) else None


def starts(path: str) -> bool:
    """Tells whether a browser runs: some distributions install a stub that only says it cannot."""
    try:
        return subprocess.run([path, "--version"], capture_output=True, timeout=60).returncode == 0
    except (OSError, subprocess.TimeoutExpired):
        return False


def install_with_package_manager(package: str) -> None:
    """Installs a package for the whole system, where this process is allowed to."""
    if os.name != "posix" or os.geteuid() != 0:
        return
    for manager, commands in PACKAGE_MANAGERS.items():
        if shutil.which(manager):
            *preparations, install = commands
            for preparation in preparations:
                run(preparation.split())
            run([*install.split(), package])


def install_with_playwright() -> None:
    """Installs Playwright's own Chromium, with the libraries it needs where that is allowed."""
    may_install_libraries = shutil.which("apt-get") and os.geteuid() == 0
    options = ["--with-deps"] if may_install_libraries else []
    run([sys.executable, "-m", "playwright", "install", *options, "chromium"])


def run(command: list[str]) -> None:
    """Runs an installer without input, after a line that says so; its own output is dropped."""
    print("slipgrasp:", *command, file=sys.stderr)
    environment = os.environ | {"DEBIAN_FRONTEND": "noninteractive"}
    quiet = subprocess.DEVNULL
    subprocess.run(command, stdin=quiet, stdout=quiet, stderr=quiet, env=environment)


def has_chromium() -> bool:
    """Tells whether there is a Chromium in the end, after trying to install one."""
    if not find_chromium():
        install_with_package_manager("chromium")
    if not find_chromium():
        install_with_playwright()
    return find_chromium() is not None


def has_curl() -> bool:
    """Tells whether there is a curl in the end, after trying to install one."""
    if not shutil.which("curl"):
        install_with_package_manager("curl")
    return shutil.which("curl") is not None


def main() -> int:
    """Returns 0 if all are there in the end, else 1 after a line that says how to fix it."""
    if has_chromium() and has_curl():
        return 0
    print(HOW_TO_FIX, file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())
