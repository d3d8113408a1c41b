"""Systematic errors of the camera's installation, fitted to recorded hovers."""
