"""A multicopter autopilot that behaves as PX4 does, as far as a companion computer can tell."""
