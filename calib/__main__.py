"""``python -m calib``: the command line."""

from calib.entry import main

main()
