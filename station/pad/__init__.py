"""Pads: printing them, looking at them, and finding out where on them markers should be."""
