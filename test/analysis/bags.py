"""Bags of sim_node's messages, made without a network, and copies of them that lack something."""

import heapq

from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.bags.writer import BagWriter
from disc_sim_ros.physics.kernels.equations import DISC_BODY
from disc_sim_ros.ros.qos import STATE_QOS
from disc_sim_ros.ros.sim.commands import Commands
from disc_sim_ros.ros.sim.config import configuration
from disc_sim_ros.ros.sim.offline_bag import BagSinkFactory
from disc_sim_ros.ros.sim.publishers import Publishers
from disc_sim_ros.ros.sim.simulation import Simulation
from disc_sim_ros.topics import Frames

SECOND = 1_000_000_000
MS = 1_000_000
QOS = STATE_QOS
START = 1_700_000_000 * SECOND
# Gusts, a wind with a profile, another disc, and rates that are no whole nanoseconds.
PARAMETERS = {
    'disc': 'ultrastar',
    'physics_rate': 3000.0,
    'publish_rate': 150.0,
    'launch.speed': 14.0,
    'launch.height': 1.0,
    'launch.pitch': 2.0,
    'launch.roll_rate': 2.0,
    'wind.x': -2.0,
    'wind.y': 3.3,
    'wind.roughness_length': 0.1,
    'wind.turbulence': 12.0,
    'wind.seed': 2**62 + 3,
    'command_timeout': 0.4,
    'gravity': 9.7,
}


class Made:
    """A simulation that writes a bag: `commands` are due [ms after START] like those of topics."""

    def __init__(self, writer, **changes):
        config = configuration(PARAMETERS | changes)
        frames = Frames.prefixed(config.frame_prefix)
        self.factory = BagSinkFactory(writer)
        self.factory.now = START
        publishers = Publishers(self.factory, frames, with_clock=False)
        self.commands = Commands(None, frames)
        self.simulation = Simulation(config, publishers, self.commands, START, self._warn)
        self.every = config.steps_per_publish
        self.requests = []

    def command(self, topic, ms, *values):
        heapq.heappush(
            getattr(self.commands, topic).waiting, (START + round(ms * MS), len(values), values)
        )

    def go(self, seconds):
        """Fly on, as the thread of sim_node does."""
        simulation = self.simulation
        end = simulation.clock.now + round(seconds * SECOND)
        while simulation.clock.now < end:
            self.factory.now = simulation.clock.now
            simulation.advance(self.every)
            self.factory.now = simulation.clock.now
            if simulation.at_message:
                while self.requests:
                    self.requests.pop()()
                simulation.publish_step()

    @staticmethod
    def _warn(text, _=''):
        raise AssertionError(text)


def steered_bag(folder, **changes):
    """A disc that waits, is thrown, steered, blown about, lands, is thrown again and reset."""
    with BagWriter(folder) as writer:
        made = Made(writer, auto_throw=False, **changes)
        made.command('moment', 0, 0.03, 0.0, 0.0, DISC_BODY)  # acts when the disc is let go
        made.go(0.1)
        made.requests.append(made.simulation.throw)
        made.command('coefficients', 223.4, 0.011, -0.007, 1e-5)
        made.command('wind', 300, 0.1, -4.2, 0.3)
        made.command('coefficients', 551, -0.013, 0.0, 0.0)
        made.command('moment', 551, 0.0, 0.021, -1e-5, DISC_BODY)
        made.go(1.5)
        made.requests.append(made.simulation.throw)  # takes the disc from the ground
        made.go(0.2)
        made.requests.append(made.simulation.reset)
        made.go(0.1)
    return folder


def copy(source, folder, keep=lambda message: True, custom_data=()):
    """A copy with the messages that are to be kept."""
    bag = open_bag(source)
    with BagWriter(folder, custom_data=dict(custom_data)) as writer:
        ids = {info.topic.name: writer.add(info.topic) for info in bag.topics}
        for m in bag.raw():
            if keep(m):
                writer.write(ids[m.topic], m.data, m.log_time, m.publish_time)
    return folder
