"""The C++ program beside `ensemble.py`: built where there is g++, and called."""

import ctypes
from pathlib import Path
import subprocess

import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics.flight import Setup

FLAGS = (
    '-O2',
    '-march=native',
    '-fno-math-errno',
    '-std=c++17',
    '-shared',
    '-fPIC',
    '-Wall',
    '-Wextra',
)
LONGEST = 60.0  # s, time of flight


class Disc(ctypes.Structure):
    """The structure `Disc` of ensemble.cpp."""

    _fields_ = [
        *((name, ctypes.c_double) for name in
          ('m', 'c', 'S', 'I_x', 'I_z', 'C_Lp', 'C_Mq', 'C_Nr', 'rho', 'g')),
        ('table', ctypes.c_void_p),
        ('rows', ctypes.c_int64),
    ]  # fmt: skip


class Ensemble:
    """Throws of one setup, in still air and with the centre's ground contact."""

    def __init__(self, folder: Path, setup: Setup) -> None:
        """Build the program in a folder."""
        library = folder / 'libensemble.so'
        source = Path(__file__).with_name('ensemble.cpp')
        command = ['g++', *FLAGS, str(source), '-o', str(library)]
        subprocess.run(command, check=True)
        self._fly_all = ctypes.CDLL(str(library)).fly_all
        self._fly_all.restype = None
        self._step = setup.fixed_step
        plant = setup.plant
        self._table = np.ascontiguousarray(plant.table)  # kept: the program reads it
        numbers = {name: getattr(plant, name) for name, _ in Disc._fields_[:-2]}
        self._disc = Disc(**numbers, table=self._table.ctypes.data, rows=len(self._table))

    def fly(self, states: FloatArray) -> FloatArray:
        """Return X, Y [m] and the time [s] of each landing, shape (n, 3).

        Args:
            states: At the release, earth axes 1, shape (n, 14).
        """
        states = np.ascontiguousarray(states, dtype=float)
        landings = np.empty((len(states), 3))
        self._fly_all(
            ctypes.c_int64(len(states)), ctypes.c_void_p(states.ctypes.data),
            ctypes.byref(self._disc), ctypes.c_double(self._step), ctypes.c_double(LONGEST),
            ctypes.c_void_p(landings.ctypes.data),
        )  # fmt: skip
        return landings
