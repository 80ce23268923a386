"""What every part shares: errors, files, sessions, results, the robot and its twin."""
