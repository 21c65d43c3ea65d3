"""The compiled code: the equations of motion, their integration, and many flights at once."""
