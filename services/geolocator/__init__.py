"""Where on the earth is the pad that a frame shows."""
