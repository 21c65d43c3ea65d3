"""The coefficients of a disc, from measured throws."""
