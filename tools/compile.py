"""Compile the equations of motion into the cache, so that parallel tests need not."""

from concurrent.futures import ProcessPoolExecutor, wait
from dataclasses import astuple, replace
import importlib.util
import multiprocessing

import numpy as np

from disc_sim_ros.estimation.prediction.predictor import Predictor, PredictorConfig
from disc_sim_ros.physics import disc_file, flight, simulator
from disc_sim_ros.physics.batch_simulator import BatchSimulator
from disc_sim_ros.physics.ensemble import fly_many
from disc_sim_ros.physics.environment import Wind
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.physics.sampled import default_row, fly_sampled

SETUP = flight.Setup(disc=disc_file.load_disc('frisbee'))


def compile_single_flights() -> None:
    """Compile the functions of `flight.fly`, with and without a given step."""
    flight.fly(Launch(), SETUP, duration=0.01, ground=False)
    flight.fly(Launch(), replace(SETUP, step=1e-3), duration=0.01, ground=False)


def compile_the_simulator() -> None:
    """Compile the simulator, and where there is ROS the loop of `sim_node`."""
    simulator.warm_up()
    if importlib.util.find_spec('rclpy'):
        from disc_sim_ros.ros.sim import compiled_loop  # noqa: PLC0415 - it needs ROS

        compiled_loop.warm_up()


def compile_ensembles() -> None:
    """Compile the loops over many flights."""
    fly_many({}, SETUP, duration=0.01, ground=False)
    fly_many({}, replace(SETUP, step=0.02), duration=0.01, ground=False)


def compile_gusty_ensembles() -> None:
    """Compile the loops over many flights that fly one after the other, in gusts."""
    gusty = replace(SETUP, wind=Wind(turbulence=5.0))
    fly_many({}, gusty, duration=0.01, ground=False)
    fly_many({}, replace(gusty, step=0.02), duration=0.01, ground=False)


def compile_batches() -> None:
    """Compile the loops over many flights that are steered."""
    batch = BatchSimulator(replace(SETUP, step=0.005), 1)
    calm = np.zeros((1, 3))
    batch.release([0], [list(astuple(Launch()))], calm)
    batch.place([0], np.array(Launch().state())[:, np.newaxis], calm)
    batch.advance(1)
    batch.close()


def compile_the_estimators() -> None:
    """Compile what predictions and fits fly and compare."""
    states = np.array(Launch().state())[np.newaxis]
    rows = default_row(SETUP)[np.newaxis]
    fly_sampled(states, rows, SETUP, np.zeros(1), step=0.01, duration=0.01)
    Predictor(PredictorConfig(setup=SETUP)).warm_up()


if __name__ == '__main__':
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context('spawn')) as pool:
        for future in wait(
            [
                pool.submit(compile_single_flights),
                pool.submit(compile_the_simulator),
                pool.submit(compile_ensembles),
                pool.submit(compile_the_estimators),
                pool.submit(compile_gusty_ensembles),
                pool.submit(compile_batches),
            ]
        ).done:
            future.result()
