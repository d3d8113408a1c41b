"""Recorded flights through changed code: what the nodes say now, beside what they said then."""
