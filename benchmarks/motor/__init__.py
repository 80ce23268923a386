"""What goes wrong between host and motor, for the tests of `calib capture`."""
