"""How often the posterior holds the truth, over sessions drawn from the prior."""
