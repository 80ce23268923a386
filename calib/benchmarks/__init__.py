"""What is claimed of speed and accuracy, measured: `calib benchmark …`."""
