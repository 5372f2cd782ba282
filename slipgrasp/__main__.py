"""``python -m slipgrasp`` is the command ``slipgrasp``."""

import sys

from slipgrasp.cli.main import main

sys.exit(main())
