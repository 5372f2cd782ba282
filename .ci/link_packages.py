"""Lays out the packages as they lie when installed, as links in build/links.

Linters find modules by folders: they see each folder beside slipgrasp/ as a package inside it.
"""

import os
import shutil
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LINKS = ROOT / "build" / "links" / "slipgrasp"

shutil.rmtree(LINKS, ignore_errors=True)
shutil.copytree(ROOT / "slipgrasp", LINKS, copy_function=os.symlink)
for name in ("core", "scene", "recordings", "figures", "server", "web"):
    shutil.copytree(ROOT / name, LINKS / name, copy_function=os.symlink)
