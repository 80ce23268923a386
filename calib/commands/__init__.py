"""The commands of `calib`, by what they work on."""
