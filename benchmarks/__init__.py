"""For development only, not installed: what measures the toolkit on recordings whose truth is known."""
