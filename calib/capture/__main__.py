"""``python -m calib.capture``."""

import sys

from calib.capture.command import main

sys.exit(main(program="python -m calib.capture"))
