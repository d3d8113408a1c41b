"""The recorder: writes every topic of a flight into one MCAP file."""
