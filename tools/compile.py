"""Compile the equations of motion into the cache, so that parallel tests need not."""

from concurrent.futures import ProcessPoolExecutor, wait
import multiprocessing

import numpy as np

from disc_sim_ros.physics import disc_file, flight, simulator
from disc_sim_ros.physics.ensemble import fly_many
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.physics.sampled import default_row, fly_sampled

SETUP = flight.Setup(disc=disc_file.load_disc('frisbee'))


def compile_single_flights() -> None:
    """Compile the functions of `flight.fly` and of the simulator."""
    flight.fly(Launch(), SETUP, duration=0.01, ground=False)
    simulator.warm_up()


def compile_ensembles() -> None:
    """Compile the loop over many flights."""
    fly_many({}, SETUP, duration=0.01, ground=False)


def compile_sampled_flights() -> None:
    """Compile the loop of the estimators."""
    states = np.array(Launch().state())[np.newaxis]
    rows = default_row(SETUP)[np.newaxis]
    fly_sampled(states, rows, SETUP, np.zeros(1), step=0.01, duration=0.01)


if __name__ == '__main__':
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context('spawn')) as pool:
        for future in wait(
            [
                pool.submit(compile_single_flights),
                pool.submit(compile_ensembles),
                pool.submit(compile_sampled_flights),
            ]
        ).done:
            future.result()
