"""Pool videos with known truth: rendered from the twin, for whoever measures a tracker."""
