"""Compile the equations of motion into the cache, before several processes would do so at once."""

from concurrent.futures import ProcessPoolExecutor, wait
import multiprocessing

from disc_sim_ros.physics import disc_file, flight, simulator
from disc_sim_ros.physics.ensemble import fly_many
from disc_sim_ros.physics.launch import Launch

SETUP = flight.Setup(disc=disc_file.load_disc('frisbee'))


def of_one_flight() -> None:
    """Compile what `flight.fly` and the simulator run."""
    flight.fly(Launch(), SETUP, duration=0.01, ground=False)
    simulator.warm_up()


def of_many_flights() -> None:
    """Compile what runs many flights side by side."""
    fly_many({}, SETUP, duration=0.01, ground=False)


if __name__ == '__main__':
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context('spawn')) as pool:
        for future in wait([pool.submit(of_one_flight), pool.submit(of_many_flights)]).done:
            future.result()
