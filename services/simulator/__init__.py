"""The simulator: world, vehicle and an autopilot that speaks MAVLink; or the truth of a PX4 simulation elsewhere."""
