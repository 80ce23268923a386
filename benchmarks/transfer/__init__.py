"""Does calibration pay? Steering laws from several models of a robot, tested on the robot, which was none of them."""
