"""The physics of a spinning disc: no ROS, no plotting, no file formats but the disc catalogue.

Axes, letters and signs are the paper's (Crowther & Potts 2007) throughout this package; `frames`
has the only turn to the axes of ROS messages. Units are SI and radians.
"""
