"""What people can do: limits and scatter of throws where the user gives none. Both are choices.

The throws of the paper's Figs. 4 and 5 are 13.5 and 15 m/s with 54 and 31 rad/s; the limits allow
about twice as much, of a right-handed backhand, which spins clockwise from above.
"""

LIMITS = {
    'speed': (5.0, 25.0),  # m/s
    'pitch': (-20.0, 60.0),  # degrees
    'roll': (-60.0, 60.0),  # degrees
    'spin': (10.0, 70.0),  # rad/s
}
# Standard deviations of a practised thrower, in the same units.
SCATTER = {'speed': 0.5, 'pitch': 1.5, 'roll': 2.0, 'yaw': 1.5, 'spin': 3.0}
