"""Colours of the flights in plots and pages, in the order in which flights take them."""

# Okabe and Ito: safe for colour-blind readers.
COLOURS = ('#0072b2', '#d55e00', '#009e73', '#cc79a7', '#e69f00', '#56b4e9', '#000000')
