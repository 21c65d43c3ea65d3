"""What numba compiles: the equations of motion, their integration, and many flights at once."""
