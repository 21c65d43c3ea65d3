"""The recorder node: every topic into an MCAP bag."""
