"""Common ground of all parts: errors, files, sessions, results, the robot and its twin."""
