"""The simulator node: the disc in real time."""
