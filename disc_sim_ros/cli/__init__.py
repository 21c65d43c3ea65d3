"""Command-line programs: one module for each, with a thin `main`."""
