"""Effects of camera, markers and tracker."""
