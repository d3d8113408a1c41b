"""Measured figures, as tables: `make bench`. Speed is judged here, never in a test."""
