"""Effects of hinges and masses."""
