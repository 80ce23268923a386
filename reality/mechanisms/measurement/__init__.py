"""Camera, markers and tracker."""
