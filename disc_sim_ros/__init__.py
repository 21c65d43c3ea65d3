"""Real-time flight of a spin-stabilised disc, after Crowther and Potts (2007)."""

# setup.py reads this line without importing the package; package.xml repeats it.
__version__ = '0.2.0'
