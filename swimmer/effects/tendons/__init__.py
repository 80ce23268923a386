"""Effects of crank and tendons."""
