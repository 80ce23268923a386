"""Effects: what the plain twin leaves out, and the twin with them."""
