"""Command-line programs: each module has a thin `main`."""
