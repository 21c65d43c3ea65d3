"""Ensembles of flights: grids and human scatter, flown in batches, kept in one file."""
