"""The delay between the camera's stamps and the autopilot's, from how the pad moves in the picture."""
