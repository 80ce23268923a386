"""The capture commands, started by ``python -m calib.capture``."""

import sys

from calib.capture.bus import let_go_of_a_lost_terminal, print_in_any_encoding
from calib.capture.functions import main

print_in_any_encoding()
code = main(program="python -m calib.capture")
let_go_of_a_lost_terminal()
sys.exit(code)
