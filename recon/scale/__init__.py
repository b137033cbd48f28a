"""Large clouds: the same answers from pieces."""
