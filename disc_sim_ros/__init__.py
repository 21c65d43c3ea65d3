"""Real-time flight of a spin-stabilised disc, after Crowther and Potts (2007).

The names in `__all__` are the public interface; none of them needs ROS. Each is imported when it
is first used, so that `import disc_sim_ros` takes no time and needs no other package:

    from disc_sim_ros import Launch, Setup, fly, load_disc

    flight = fly(Launch(speed=18.0), Setup(disc=load_disc('frisbee')))
"""

from importlib import import_module
from typing import TYPE_CHECKING

# setup.py reads this line without importing the package; package.xml repeats it.
__version__ = '0.2.0'

__all__ = [
    'QUANTITIES',
    'AeroTable',
    'Air',
    'Analysis',
    'Bag',
    'BagError',
    'BagWriter',
    'BatchSimulator',
    'ConfigError',
    'Control',
    'DamageError',
    'Disc',
    'DiscSimError',
    'Flight',
    'FlightSimulator',
    'IntegrationError',
    'InterruptedSweepError',
    'Landings',
    'Launch',
    'LinearAero',
    'Normal',
    'Optimum',
    'Problem',
    'Qos',
    'Quantity',
    'Setup',
    'SpinTable',
    'State',
    'Study',
    'Summary',
    'Topic',
    'Trajectory',
    'Uniform',
    'Wind',
    'WriteError',
    'analyse_bag',
    'collect',
    'disc_names',
    'fly',
    'fly_many',
    'load_disc',
    'open_bag',
    'optimise',
    'summarise',
    'sweep',
]

if TYPE_CHECKING:
    from disc_sim_ros.analysis.bag_analysis import Analysis, analyse_bag
    from disc_sim_ros.bags.reader import Bag, open_bag
    from disc_sim_ros.bags.topic import Qos, Topic
    from disc_sim_ros.bags.writer import BagWriter
    from disc_sim_ros.errors import (
        BagError,
        ConfigError,
        DamageError,
        DiscSimError,
        IntegrationError,
        InterruptedSweepError,
        WriteError,
    )
    from disc_sim_ros.physics.batch_simulator import BatchSimulator
    from disc_sim_ros.physics.disc import AeroTable, Disc, LinearAero, SpinTable
    from disc_sim_ros.physics.disc_file import disc_names, load_disc
    from disc_sim_ros.physics.ensemble import Landings, fly_many
    from disc_sim_ros.physics.environment import Air, Wind
    from disc_sim_ros.physics.flight import Flight, Setup, fly
    from disc_sim_ros.physics.kernels.equations import Control, State
    from disc_sim_ros.physics.launch import Launch
    from disc_sim_ros.physics.simulator import FlightSimulator
    from disc_sim_ros.physics.trajectory import Trajectory
    from disc_sim_ros.quantities import QUANTITIES
    from disc_sim_ros.studies.optimise import Optimum, Problem, optimise
    from disc_sim_ros.studies.runner import collect, sweep
    from disc_sim_ros.studies.scatter import Normal, Uniform
    from disc_sim_ros.studies.study import Study
    from disc_sim_ros.studies.summary import Summary, summarise
    from disc_sim_ros.validation import Quantity
else:  # type checkers do not see this function, and so report a misspelt name
    # The same modules and names as above; a test compares them.
    _NAMES_BY_MODULE = {
        'analysis.bag_analysis': ('Analysis', 'analyse_bag'),
        'bags.reader': ('Bag', 'open_bag'),
        'bags.topic': ('Qos', 'Topic'),
        'bags.writer': ('BagWriter',),
        'errors': (
            'BagError',
            'ConfigError',
            'DamageError',
            'DiscSimError',
            'IntegrationError',
            'InterruptedSweepError',
            'WriteError',
        ),
        'physics.batch_simulator': ('BatchSimulator',),
        'physics.disc': ('AeroTable', 'Disc', 'LinearAero', 'SpinTable'),
        'physics.disc_file': ('disc_names', 'load_disc'),
        'physics.ensemble': ('Landings', 'fly_many'),
        'physics.environment': ('Air', 'Wind'),
        'physics.flight': ('Flight', 'Setup', 'fly'),
        'physics.kernels.equations': ('Control', 'State'),
        'physics.launch': ('Launch',),
        'physics.simulator': ('FlightSimulator',),
        'physics.trajectory': ('Trajectory',),
        'quantities': ('QUANTITIES',),
        'studies.optimise': ('Optimum', 'Problem', 'optimise'),
        'studies.runner': ('collect', 'sweep'),
        'studies.scatter': ('Normal', 'Uniform'),
        'studies.study': ('Study',),
        'studies.summary': ('Summary', 'summarise'),
        'validation': ('Quantity',),
    }
    _MODULE_OF = {name: module for module, names in _NAMES_BY_MODULE.items() for name in names}

    def __getattr__(name: str) -> object:
        """Import a public name when it is first used (PEP 562)."""
        if name not in _MODULE_OF:
            raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
        value = getattr(import_module(f'{__name__}.{_MODULE_OF[name]}'), name)
        globals()[name] = value  # the next use does not come here
        return value


def __dir__() -> list[str]:
    """Return the public names too, before they are imported."""
    return sorted({*globals(), *__all__})
