"""Frames, rotations, geodesy and the camera model: Eq. 1-16. Knows nothing of processes."""
