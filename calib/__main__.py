"""The command line, started by ``python -m calib``."""

from calib.entry import main

main()
