"""Coverage of the posterior: how often it holds the truth, over sessions drawn from the prior."""
