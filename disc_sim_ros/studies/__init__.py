"""Studies: ensembles of flights on grids and with scatter, and the search of the best launch."""
