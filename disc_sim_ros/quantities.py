"""The table of quantities: name, unit, range, default, sign and one sentence of each.

This is the only place where these are written. Checks of dataclasses, command-line flags, ROS
parameters, keys of disc files and columns of studies are derived from it.
"""

from math import inf

from disc_sim_ros.validation import Quantity

LARGEST_SEED = 2**63 - 1


def _table(*quantities: Quantity) -> dict[str, Quantity]:
    return {quantity.name: quantity for quantity in quantities}


# A release; the fields of physics.launch.Launch.
LAUNCH = _table(
    Quantity('speed', 'm/s', 0.0, 200.0, 15.0, 'Speed over the ground'),
    Quantity('pitch', 'degrees', -180.0, 180.0, 15.0, 'Pitch of the disc', 'nose up positive'),
    Quantity(
        'roll', 'degrees', -180.0, 180.0, 0.0, 'Roll of the disc', 'right edge down positive'
    ),
    Quantity(
        'yaw', 'degrees', -360.0, 360.0, 0.0, 'Heading of the disc', 'right of +x positive'
    ),
    Quantity(
        'angle_of_attack', 'degrees', -180.0, 180.0, 0.0,
        'Angle of attack: angle of the velocity below the plane of the disc',
    ),
    Quantity(
        'sideslip', 'degrees', -180.0, 180.0, 0.0,
        'Sideslip: angle of the velocity right of the x axis, in the plane of the disc',
    ),
    Quantity(
        'spin', 'rad/s', -1300.0, 1300.0, 31.416, 'Spin rate', 'clockwise from above positive'
    ),
    Quantity(
        'roll_rate', 'rad/s', -1000.0, 1000.0, 0.0,
        'Body rate p at release', 'right edge down positive',
    ),
    Quantity(
        'pitch_rate', 'rad/s', -1000.0, 1000.0, 0.0, 'Body rate q at release', 'nose up positive'
    ),
    Quantity(
        'height', 'm', -1000.0, 10000.0, 0.0,
        'Height of the centre of the disc above the ground at release',
    ),
)  # fmt: skip
ADVANCE_RATIO = Quantity(
    'advance_ratio', '', -100.0, 100.0, None,
    'Advance ratio r c / (2 V) at release', 'clockwise from above positive',
)  # fmt: skip

# The same release in the words of disc golf; the arguments of physics.thrower.
THROWER = _table(
    Quantity(
        'launch_angle', 'degrees', -180.0, 180.0, None,
        'Angle of the velocity above the horizontal',
    ),
    Quantity(
        'nose', 'degrees', -180.0, 180.0, 0.0,
        'Angle of the nose above the velocity, the angle of attack', 'nose up positive',
    ),
    Quantity(
        'hyzer', 'degrees', -180.0, 180.0, 0.0,
        'Tilt towards the side to which the disc fades', 'hyzer positive, anhyzer negative',
    ),
)  # fmt: skip
ALTITUDE = Quantity(
    'altitude', 'm', -500.0, 11_000.0, 0.0,
    'Altitude above the sea, which gives the density of the air (standard atmosphere)',
)  # fmt: skip
TEMPERATURE = Quantity(
    'temperature', 'degC', -80.0, 60.0, None,
    'Temperature of the air (default: that of the standard atmosphere, 15 at the sea)',
)  # fmt: skip

# The air; the fields of physics.environment.Wind and Air.
MEAN_WIND = _table(
    Quantity(
        'wind_x', 'm/s', -100.0, 100.0, 0.0,
        'Velocity of the air along x of `map`', 'forward positive',
    ),
    Quantity(
        'wind_y', 'm/s', -100.0, 100.0, 0.0,
        'Velocity of the air along y of `map`', 'left positive',
    ),
    Quantity(
        'wind_z', 'm/s', -100.0, 100.0, 0.0, 'Velocity of the air along z of `map`', 'up positive'
    ),
)  # fmt: skip
WIND = MEAN_WIND | _table(
    Quantity(
        'roughness_length', 'm', 0.0, 10.0, 0.0,
        'Roughness length of a logarithmic profile of the wind over the height; 0: no profile',
    ),
    Quantity(
        'reference_height', 'm', 0.1, 1000.0, 10.0,
        'Height at which the profile has the velocities x and y',
    ),
    Quantity(
        'turbulence', 'm/s', 0.0, 50.0, 0.0,
        'Mean wind at 6 m height that sets the strength of the Dryden gusts (MIL-F-8785C): '
        'about 8 light, 15 moderate, 23 severe; 0: no gusts',
    ),
    Quantity(
        'gust_seed', '', 0, LARGEST_SEED, 0,
        'Seed of the gusts; the same seed gives the same gusts', whole=True,
    ),
)  # fmt: skip
AIR = _table(
    Quantity('air_density', 'kg/m^3', 0.0, 100.0, 1.225, 'Density of the air'),
    Quantity('gravity', 'm/s^2', 0.0, 100.0, 9.81, 'Acceleration of free fall'),
)

# A disc; the fields of physics.disc.Disc and LinearAero, with the unit the keys of disc files.
DISC = _table(
    Quantity('mass', 'kg', 1e-3, 100.0, None, 'Mass'),
    Quantity('diameter', 'm', 0.01, 5.0, None, "Diameter, the paper's c"),
    Quantity('area', 'm^2', 0.0, inf, None, "Planform area, the paper's S", open=True),
    Quantity(
        'inertia_axial', 'kg m^2', 0.0, inf, None,
        'Moment of inertia about the spin axis, I_z', open=True,
    ),
    Quantity(
        'inertia_diametral', 'kg m^2', 0.0, inf, None,
        'Moment of inertia about any diameter, I_x = I_y', open=True,
    ),
)  # fmt: skip
DAMPING = _table(
    Quantity('C_Lp', '', -inf, 0.0, 0.0, 'Roll damping, per p c / (2 V)'),
    Quantity('C_Mq', '', -inf, 0.0, 0.0, 'Pitch damping, per q c / (2 V)'),
    Quantity('C_Nr', '', -inf, 0.0, 0.0, 'Spin damping, per r c / (2 V)'),
)
LINEAR_AERO = _table(
    Quantity('CL_0', '', -inf, inf, None, 'Lift coefficient at angle of attack 0'),
    Quantity('CL_alpha', '1/rad', -inf, inf, None, 'Slope of the lift coefficient'),
    Quantity('CD_0', '', 0.0, inf, None, 'Least drag coefficient'),
    Quantity('CD_alpha', '1/rad^2', 0.0, inf, None, 'Growth of drag with (alpha - alpha_0)^2'),
    Quantity('alpha_0', 'rad', -inf, inf, None, 'Angle of attack of the least drag'),
    Quantity('CM_0', '', -inf, inf, None, 'Pitching moment at angle of attack 0'),
    Quantity('CM_alpha', '1/rad', -inf, inf, None, 'Slope of the pitching moment'),
)

# The flight numbers of a golf disc, in the order in which makers print them.
FLIGHT_NUMBERS = _table(
    Quantity('speed_number', '', 1.0, 15.0, None, 'Speed of the flight numbers'),
    Quantity('glide', '', 0.0, 7.0, None, 'Glide of the flight numbers'),
    Quantity('turn', '', -6.0, 2.0, None, 'Turn of the flight numbers', 'right negative'),
    Quantity('fade', '', -1.0, 7.0, None, 'Fade of the flight numbers', 'left positive'),
)

# Control inputs, in the paper's signs.
CONTROL = _table(
    Quantity(
        'control_CL', '', -10.0, 10.0, 0.0,
        'Control input: rolling moment coefficient', 'right edge down positive',
    ),
    Quantity(
        'control_CM', '', -10.0, 10.0, 0.0,
        'Control input: pitching moment coefficient', 'nose up positive',
    ),
    Quantity(
        'control_CN', '', -10.0, 10.0, 0.0,
        'Control input: yawing moment coefficient', 'clockwise from above positive',
    ),
)  # fmt: skip
CONTROL_MOMENT = _table(
    Quantity(
        'control_L', 'N m', -1000.0, 1000.0, 0.0,
        'Control input: rolling moment', 'right edge down positive',
    ),
    Quantity(
        'control_M', 'N m', -1000.0, 1000.0, 0.0,
        'Control input: pitching moment', 'nose up positive',
    ),
    Quantity(
        'control_N', 'N m', -1000.0, 1000.0, 0.0,
        'Control input: yawing moment', 'clockwise from above positive',
    ),
)  # fmt: skip

# What a thrown state has besides the quantities of a launch; each component.
POSITION = Quantity('position', 'm', -10000.0, 10000.0, None, 'Position in `map`')
VELOCITY = Quantity(
    'velocity', 'm/s', -LAUNCH['speed'].highest, LAUNCH['speed'].highest, None,
    'Velocity over the ground in `disc`',
)  # fmt: skip
ORIENTATION = Quantity(
    'orientation', '', -2.0, 2.0, None, 'Component of a quaternion before its length is checked'
)

# What `identify` finds. The bounds exclude what no disc has: a thin wing has a lift slope of at
# most 2 pi, and the printed damping of the paper is 10 times that of its figures.
COEFFICIENTS = _table(
    Quantity('C_L0', '', -0.4, 0.8, None, 'Lift coefficient at angle of attack 0'),
    Quantity('C_L_slope', '1/rad', 0.5, 6.3, None, 'Mean lift slope from 0 to 10 degrees'),
    Quantity('C_D0', '', 0.005, 0.5, None, 'Drag coefficient at angle of attack 0'),
    Quantity('C_D_rise', '', 0.2, 5.0, None, 'Factor of the drag above C_D0, of the base disc'),
    Quantity('C_M0', '', -0.2, 0.2, None, 'Pitching moment at angle of attack 0'),
    Quantity('C_M_slope', '1/rad', -0.5, 1.5, None, 'Mean moment slope from 0 to 10 degrees'),
    Quantity('damping', '', 0.0, 30.0, None, 'Factor of C_Lp and C_Mq of the base disc'),
    DAMPING['C_Nr'].within(-0.1),
    Quantity('I_ratio', '', 1.4, 2.0, None, 'I_z / I_x, which sets how fast the disc wobbles'),
)
IDENTIFICATION = _table(
    Quantity(
        'camera_height',
        'm',
        3.0,
        1000.0,
        None,
        'Height of the camera straight above the field, for positions without z',
    ),
    Quantity(
        'camera_error',
        'm',
        1e-3,
        1000.0,
        5.0,
        'Standard error of --camera-at',
    ),
    Quantity('camera_x', 'm', -1e4, 1e4, 0.0, 'Point under the camera, in map'),
    Quantity('camera_y', 'm', -1e4, 1e4, 0.0, 'Point under the camera, in map'),
    Quantity('wind_error', 'm/s', 1e-3, 30.0, 3.0, 'Standard error of --wind'),
    Quantity('noise', '', 1e-9, 1e3, None, 'Standard error of an instrument'),
    # Errors of measured releases: those that Giljarhus, Gooding and Njaerheim (2022) give for a
    # disc with sensors.
    Quantity('release_speed_error', 'm/s', 1e-3, 30.0, 0.6, 'Standard error of a measured speed'),
    Quantity(
        'release_angle_error',
        'degrees',
        1e-3,
        60.0,
        2.0,
        'Standard error of a measured launch angle and nose angle',
    ),
    Quantity(
        'release_hyzer_error', 'degrees', 1e-3, 60.0, 5.0, 'Standard error of a measured hyzer'
    ),
    Quantity('release_spin_error', 'rad/s', 1e-3, 100.0, 2.0, 'Standard error of a measured spin'),
    Quantity(
        'accelerometer_range',
        'm/s^2',
        1.0,
        1e5,
        None,
        'Range of the accelerometer; samples at its end are not used',
    ),
    Quantity('starts', '', 1, 100, 2, 'Sets of coefficients to start from', whole=True),
    Quantity('start_seed', '', 0, LARGEST_SEED, 0, 'Seed of these sets', whole=True),
)
# How much discs of one kind differ, one standard deviation: what `identify` believes beforehand.
COEFFICIENT_SPREAD = {
    'C_L0': 0.1,
    'C_L_slope': 0.7,
    'C_D0': 0.03,
    'C_D_rise': 0.4,
    'C_M0': 0.02,
    'C_M_slope': 0.15,
    'damping': 2.0,
    'C_Nr': 5e-3,
    'I_ratio': 0.05,
}

# What may differ from flight to flight of an ensemble; the columns of studies.
AERO_CHANGES = _table(
    Quantity('lift_factor', '', 0.0, 10.0, 1.0, 'Factor of the lift coefficient'),
    Quantity('drag_factor', '', 0.0, 10.0, 1.0, 'Factor of the drag coefficient'),
    Quantity('pitching_factor', '', 0.0, 10.0, 1.0, 'Factor of the pitching moment coefficient'),
    Quantity('lift_offset', '', -2.0, 2.0, 0.0, 'Added to the lift coefficient'),
    Quantity('drag_offset', '', -2.0, 2.0, 0.0, 'Added to the drag coefficient'),
    Quantity('pitching_offset', '', -2.0, 2.0, 0.0, 'Added to the pitching moment coefficient'),
)
VARIED = (
    LAUNCH
    | _table(ADVANCE_RATIO)
    | MEAN_WIND
    | CONTROL
    | _table(
        DISC['mass'],
        DISC['inertia_axial'].within(1e-7, 100.0),
        DISC['inertia_diametral'].within(1e-7, 100.0),
        DAMPING['C_Lp'].within(-100.0),
        DAMPING['C_Mq'].within(-100.0),
        DAMPING['C_Nr'].within(-100.0),
    )
    | AIR
    | AERO_CHANGES
)

# Steps, times and rates.
STEP = Quantity('step', 's', 1e-6, 0.1, 1e-3, 'Integration step')
DURATION = Quantity('duration', 's', 0.0, 3600.0, 60.0, 'Longest time of flight', open=True)
SAMPLE_RATE = Quantity(
    'sample_rate', 'Hz', 0.0, 1e5, 0.0, 'Samples of the trajectory a second; 0: no samples'
)
TIMING = _table(
    Quantity('physics_rate', 'Hz', 10.0, 1e5, 1000.0, 'Integration steps a simulated second'),
    Quantity(
        'publish_rate', 'Hz', 0.1, 1e5, 200.0, 'Messages of each state topic a simulated second'
    ),
    Quantity(
        'path_rate', 'Hz', 0.0, 1000.0, 20.0, 'Points of `path` a simulated second; 0: no path'
    ),
    Quantity(
        'real_time_factor', '', 0.0, 1000.0, 1.0, 'Simulated seconds a second; 0: as fast as '
        'possible',
    ),
    Quantity(
        'throw_period', 's', 0.0, 86400.0, 0.0,
        'Simulated time from release to release; 0: throw once',
    ),
    Quantity(
        'command_timeout', 's', 0.001, 3600.0, 0.5,
        'Simulated time after which a command that is not renewed falls to zero',
    ),
    # Stamps end at 2^31 s; this leaves a year and a half.
    Quantity(
        'start_time', 's', -1.0, 2.1e9, -1.0,
        'First stamp; negative: the wall clock, or 0 with `publish_clock`',
    ),
    Quantity(
        'realtime_priority', '', 0, 99, 0,
        'SCHED_FIFO priority of the simulation thread; 0: ordinary scheduling', whole=True,
    ),
)  # fmt: skip

# The IMU, in `disc_body`.
_ZEROS = (0.0, 0.0, 0.0)
IMU = _table(
    Quantity(
        'imu_offset', 'm', -10.0, 10.0, _ZEROS,
        'Position of the IMU from the centre of mass in `disc_body`',
    ),
    Quantity(
        'accelerometer_noise', 'm/s^2', 0.0, 1000.0, 0.0,
        'Standard deviation of the white noise of the specific force, each axis and sample',
    ),
    Quantity(
        'accelerometer_bias', 'm/s^2', -1000.0, 1000.0, _ZEROS,
        'Constant error that is added to the specific force, in `disc_body`',
    ),
    Quantity(
        'gyroscope_noise', 'rad/s', 0.0, 100.0, 0.0,
        'Standard deviation of the white noise of the angular velocity, each axis and sample',
    ),
    Quantity(
        'gyroscope_bias', 'rad/s', -100.0, 100.0, _ZEROS,
        'Constant error that is added to the angular velocity, in `disc_body`',
    ),
    Quantity(
        'accelerometer_noise_density', 'm/s^2/sqrt(Hz)', 0.0, 1000.0, _ZEROS,
        'Density of the white noise of the specific force, each axis, beside that of a sample',
    ),
    Quantity(
        'accelerometer_bias_walk', 'm/s^2/sqrt(s)', 0.0, 1000.0, _ZEROS,
        'Random walk of the bias of the specific force, each axis, from 0 at the throw',
    ),
    Quantity(
        'accelerometer_range', 'm/s^2', 0.0, 1e6, _ZEROS,
        'Greatest amount of the specific force that is read, each axis; 0: no limit',
    ),
    Quantity(
        'accelerometer_bandwidth', 'Hz', 0.0, 1e6, 0.0,
        'Cut-off of the low-pass filter of the specific force, first order; 0: no filter',
    ),
    Quantity(
        'gyroscope_noise_density', 'rad/s/sqrt(Hz)', 0.0, 100.0, _ZEROS,
        'Density of the white noise of the angular velocity, each axis, beside that of a sample',
    ),
    Quantity(
        'gyroscope_bias_walk', 'rad/s/sqrt(s)', 0.0, 100.0, _ZEROS,
        'Random walk of the bias of the angular velocity, each axis, from 0 at the throw',
    ),
    Quantity(
        'gyroscope_range', 'rad/s', 0.0, 1e6, _ZEROS,
        'Greatest amount of the angular velocity that is read, each axis; 0: no limit',
    ),
    Quantity(
        'gyroscope_bandwidth', 'Hz', 0.0, 1e6, 0.0,
        'Cut-off of the low-pass filter of the angular velocity, first order; 0: no filter',
    ),
    Quantity(
        'imu_seed', '', 0, LARGEST_SEED, 0,
        'Seed of the noise; the same seed gives the same noise', whole=True,
    ),
)  # fmt: skip

# The files of a bag: of bags.writer.BagWriter, and of recorder_node, where 0 is no limit.
BAG_FILES = _table(
    Quantity(
        'file_size', 'bytes', 1024, 2**62, None, 'Size at which the next file of the bag begins',
        whole=True,
    ),
    Quantity(
        'file_duration', 's', 1e-3, 1e9, None, 'Time after which the next file of the bag begins'
    ),
    Quantity(
        'flush_period', 's', 1e-3, 3600.0, 0.5,
        'Longest time that a message waits for the disk; a power failure may cost as much',
    ),
)  # fmt: skip
RECORDING = _table(
    Quantity(
        'max_size', 'MiB', 0, 1_000_000, 0,
        'Size at which the next file of the bag begins; 0: never', whole=True,
    ),
    Quantity(
        'max_duration', 's', 0.0, 31_536_000.0, 0.0,
        'Time after which the next file of the bag begins; 0: never',
    ),
    BAG_FILES['flush_period'].within(0.01, 60.0),
)  # fmt: skip

# What a predictor of landings expects of a throw and of its measurements.
PREDICTION = _table(
    Quantity(
        'position_sigma', 'm', 1e-4, 10.0, 0.02,
        'Standard deviation of each coordinate of a measured position',
    ),
    Quantity(
        'attitude_sigma', 'degrees', 0.01, 90.0, 2.0,
        "Standard deviation of the measured axis of the disc, each direction",
    ),
    Quantity('throw_speed', 'm/s', 1.0, 100.0, 17.0, 'Speed over the ground that is expected'),
    Quantity('throw_speed_sigma', 'm/s', 0.1, 100.0, 4.0, 'Its standard deviation'),
    Quantity(
        'throw_spin', 'rad/s', -1300.0, 1300.0, 60.0, 'Spin that is expected',
        'clockwise from above positive',
    ),
    Quantity('throw_spin_sigma', 'rad/s', 0.1, 1000.0, 15.0, 'Its standard deviation'),
    Quantity(
        'opposite_spin', '', 0.0, 0.5, 0.02,
        'Probability of a throw that spins the other way round; 0: it is not tried',
    ),
    Quantity(
        'wind_sigma', 'm/s', 0.0, 50.0, 2.0,
        'Standard deviation of the wind along x and y; 0: it is known',
    ),
    Quantity(
        'disc_uncertainty', '', 0.0, 10.0, 1.0,
        'Factor of the standard deviations of the coefficients of the disc; 0: they are known',
    ),
    Quantity('ground_height', 'm', -1000.0, 10000.0, 0.0, 'Height of the ground, z in `map`'),
)  # fmt: skip
PREDICTOR_NODE = _table(
    Quantity(
        'added_noise', 'm', 0.0, 10.0, 0.0,
        'Standard deviation of noise that is added to each coordinate, for a simulator',
    ),
    Quantity('ellipse_rate', 'Hz', 0.5, 500.0, 20.0, 'Ellipses a second of measured time'),
    Quantity(
        'predicted_path_rate', 'Hz', 0.0, 500.0, 50.0,
        'Points of `predicted_path` a second; 0: no path and no `intercept`',
    ),
    Quantity(
        'intercept_height', 'm', -1000.0, 10000.0, 1.0,
        'Height, z in `map`, at which `intercept` is on the way down',
    ),
    Quantity(
        'intercept_plane_normal', '', -1000.0, 1000.0, 0.0,
        'Normal of the plane in which `intercept` is; 0: its height counts',
    ),
)  # fmt: skip

# The page of the running simulator.
LIVE_VIEW = _table(
    Quantity('port', '', 0, 65_535, 8080, 'Port of the page; 0: a free one', whole=True),
    Quantity('page_rate', 'Hz', 1.0, 120.0, 30.0, 'States per second that the page gets'),
)

# Ensembles.
STUDY = _table(
    Quantity('count', '', 1, 2**30, 1, 'Samples at each point of a grid', whole=True),
    Quantity(
        'scatter_seed', '', 0, LARGEST_SEED, 0,
        'Seed of the scatter; the same seed gives the same samples', whole=True,
    ),
    Quantity('percentile', '%', 1.0, 99.0, None, 'Percentile of the results'),
    Quantity('workers', '', 1, 1024, None, 'Threads or processes', whole=True),
)  # fmt: skip

# Every quantity by name, in its whole range.
QUANTITIES = {
    **VARIED,
    **WIND,
    **DISC,
    **COEFFICIENTS,
    **DAMPING,  # after COEFFICIENTS: C_Nr in its whole range
    **LINEAR_AERO,
    **IDENTIFICATION,
    **CONTROL_MOMENT,
    **TIMING,
    **IMU,
    **RECORDING,
    **BAG_FILES,
    **LIVE_VIEW,
    **PREDICTION,
    **PREDICTOR_NODE,
    **STUDY,
    **THROWER,
    **FLIGHT_NUMBERS,
    **_table(POSITION, VELOCITY, ORIENTATION, STEP, DURATION, SAMPLE_RATE),
    **_table(ALTITUDE, TEMPERATURE),
}
