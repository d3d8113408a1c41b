"""The camera: frames and the calibration, from a simulated world or from files."""
