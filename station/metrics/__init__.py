"""What a flight was worth, in numbers: pure functions of a flight's record."""
