"""Calibrating cameras from pictures of a board."""
