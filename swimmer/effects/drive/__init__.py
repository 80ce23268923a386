"""Effects of the motor."""
