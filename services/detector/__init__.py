"""The detector: markers in frames."""
