"""A recorded flight once more on the bus, to feed live services."""
