"""Accuracy and speed with which markers are tracked in rendered videos with known truth."""
