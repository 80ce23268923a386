"""How well and how fast markers are tracked in rendered videos with known truth."""
