"""Links the packages in build/links as they are installed.

Linters find modules by folder: there, each folder next to slipgrasp/ is a package inside it.
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
