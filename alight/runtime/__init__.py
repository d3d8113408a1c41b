"""What runs a node: the clock, the bus, health. A node itself knows none of it."""
