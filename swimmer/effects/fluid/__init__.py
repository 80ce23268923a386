"""Effects of the water."""
