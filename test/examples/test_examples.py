"""The examples, started as their first lines state, with a simulator in its own process."""

from dataclasses import replace
import importlib.util
import itertools
import math
from pathlib import Path
import re
import signal
import subprocess
import sys
import tempfile

import pytest

pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
import numpy as np
import rclpy

from disc_sim_ros import topics
from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.physics import disc_file
from disc_sim_ros.physics.environment import Wind
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.kernels.equations import Control
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.physics.simulator import FlightSimulator
from disc_sim_ros.ros.processes import started
from forked import Forked

pytestmark = pytest.mark.ros

EXAMPLES = Path(__file__).parents[2] / 'examples'
FRISBEE = Setup(disc=disc_file.load_disc('frisbee'), step=1e-3)  # that of sim_node
WAITING = {'auto_throw': False, 'real_time_factor': 4.0}
DEADLINE = 180.0  # s; an idle machine needs 20


def start(name: str, *arguments: str) -> subprocess.Popen:
    return subprocess.Popen(
        [sys.executable, EXAMPLES / name, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def run(name: str, *arguments: str) -> str:
    """Run an example to its end, as a copy of a process with ROS in it; return its stdout."""
    with tempfile.TemporaryDirectory() as folder:
        output, errors = Path(folder, 'output'), Path(folder, 'errors')
        for path in (output, errors):
            path.touch()
        imports = 'disc_sim_ros.ros.sim.node'
        process = Forked(EXAMPLES / name, arguments, output, errors=errors, imports=imports)
        try:
            code = process.wait(DEADLINE)
        except subprocess.TimeoutExpired:
            process.kill()
            pytest.fail(f'{name} did not end:\n{output.read_text()}\n{errors.read_text()}')
        assert code == 0, f'{output.read_text()}\n{errors.read_text()}'
        assert errors.read_text() == ''
        return output.read_text()


@pytest.fixture
def load(ros_environment, monkeypatch):
    """Return a function that loads an example, to call its `main` in this process."""

    monkeypatch.syspath_prepend(str(EXAMPLES))  # as for a script in that folder

    def loaded(name: str):
        spec = importlib.util.spec_from_file_location(Path(name).stem, EXAMPLES / name)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module

    return loaded


def landings(events: list[DiagnosticStatus]) -> list[DiagnosticStatus]:
    return [event for event in events if event.name.endswith(': landed')]


@pytest.mark.parametrize('namespace', ['', '/red'])
def test_throw_flies_as_the_physics_computes(ros, namespace):
    ros.start(WAITING, namespace=namespace)
    events = ros.subscribe(DiagnosticStatus, f'{namespace}/{topics.FLIGHT_EVENTS}')
    odometry = ros.subscribe(Odometry, f'{namespace}/{topics.ODOM}')
    ros.spin_until(lambda: odometry, 'odometry')  # then both subscriptions are matched
    launch = {'speed': 18.0, 'pitch': 12.0, 'roll': 7.0, 'yaw': 25.0, 'spin': 40.0, 'height': 1.2}
    options = itertools.chain(*((f'--{name}', str(value)) for name, value in launch.items()))
    remap = ('--ros-args', '-r', f'__ns:={namespace}') if namespace else ()
    output = run('throw.py', *options, *remap)
    flight = fly(Launch(**launch), FRISBEE)
    assert output.splitlines() == [
        'thrown: 18.00 m/s, spin 40.00 rad/s',
        f'landed: {flight.range:.2f} m in {flight.time:.3f} s',
    ]
    ros.spin_until(lambda: landings(events), 'the landing')
    values = {pair.key: float(pair.value) for pair in landings(events)[0].values}
    assert values['landing_x_m'] == pytest.approx(flight.position[0], abs=1e-9)
    assert values['landing_y_m'] == pytest.approx(flight.position[1], abs=1e-9)


def test_throw_replaces_a_flying_disc_and_reports_its_own_flight(ros):
    ros.start({'real_time_factor': 4.0, 'launch.speed': 30.0, 'launch.height': 1000.0})
    output = run('throw.py', '--speed', '15')
    assert output.splitlines() == [
        'thrown: 15.00 m/s, spin 31.42 rad/s; flight 1 ended in the air',
        'landed: 25.80 m in 3.682 s',
    ]


def test_throw_reports_that_there_is_no_simulator(load, capsys):
    module = load('throw.py')
    module.PATIENCE = 0.5
    assert module.main([]) == 1
    assert 'no simulator' in capsys.readouterr().err


def test_throw_reports_that_the_simulator_refused(ros, load, capsys):
    sim = ros.start(WAITING)
    module = load('throw.py')
    module.TO_THROW = 3.0
    ros.spin_until(lambda: ros.node.count_subscribers(topics.THROW), 'the simulator')
    assert module.main(['--height', '-1']) == 1
    assert 'it did not throw' in capsys.readouterr().err
    ros.spin_until(lambda: 'release at 0 m or above' in sim.stderr, 'a warning of the simulator')


def test_main_can_be_called(ros, load, capsys):
    ros.start(WAITING)
    assert load('throw.py').main(['--speed', '15']) == 0
    assert 'landed: 25.80 m in 3.682 s' in capsys.readouterr().out


def test_throw_can_be_interrupted(ros):
    ros.start(WAITING)
    process = start('throw.py', '--height', '5000')
    assert process.stdout.readline().startswith('thrown')
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=DEADLINE)
    assert (process.returncode, errors) == (1, '')


def test_steer_turns_the_flight_as_the_physics_computes(ros):
    ros.start(WAITING)
    output = run('steer.py', '--command', '0.001', '0.005', '0.002')
    ends = [
        list(map(float, re.findall(r'-?\d+\.\d\d(?= m)', line))) for line in output.splitlines()
    ]
    for end, control in zip(ends, (None, Control(0.001, 0.005, 0.002)), strict=True):
        flight = fly(Launch(), FRISBEE, control=control) if control else fly(Launch(), FRISBEE)
        # Each millisecond by which the first command is late moves the landing by 5.4 mm; it
        # arrives about one step before or after the release, on a busy machine 10 ms after it.
        assert end == pytest.approx(flight.position[:2], abs=0.06)
    assert abs(ends[1][1] - ends[0][1]) > 1.0


def test_a_robot_runs_to_the_predicted_landing_and_catches_the_disc(ros, tmp_path):
    """The robot starts 8 m from the landing and runs 6 m/s: it is there only if it knows early."""
    ros.start(
        {
            'disc': 'ultrastar',
            'auto_throw': False,
            'publish_rate': 100.0,
            'launch.speed': 17.0,
            'launch.height': 1.3,
            'launch.spin': 60.0,
        }
    )
    measured = {'sources': 'odom', 'added_noise': 0.02}
    with started('predictor_node', measured, tmp_path) as predictor:
        launch = Launch(speed=17.0, height=1.3, spin=60.0)
        X, Y, _ = fly(launch, Setup(disc=disc_file.load_disc('ultrastar'))).position
        at = (X - 6.0, -Y - 5.0)  # in map
        assert run('catch.py', '--at', *map(str, at)).endswith('caught\n')
        predictor.end()


def test_a_disc_that_rests_is_down_only_after_it_flew(load):
    """A state from before the throw may be taken after the first prediction."""
    module = load('catch.py')
    rclpy.init()
    catcher = module.Catcher(module.Robot(0.0, 0.0, 6.0, 5.0))
    try:
        catcher._on_landing(PoseWithCovarianceStamped())
        down = []
        for speed in (0.0, 12.0, 0.0):
            message = Odometry()
            message.twist.twist.linear.x = speed
            catcher._on_odometry(message)
            down.append(catcher.is_down)
        assert down == [False, False, True]
    finally:
        catcher.destroy_node()
        rclpy.try_shutdown()


def test_catch_reports_that_there_is_no_predictor(load, capsys):
    module = load('catch.py')
    module.PATIENCE = 0.5
    assert module.main([]) == 1
    assert 'no sim_node or no predictor_node' in capsys.readouterr().err


def test_steer_reports_that_there_is_no_simulator(load, capsys):
    module = load('steer.py')
    module.PATIENCE = 0.5
    assert module.main([]) == 1
    assert 'no simulator' in capsys.readouterr().err


@pytest.mark.parametrize('name', ['throw.py', 'steer.py'])
def test_help_is_printed_and_a_wrong_flag_ends_with_2(name, ros_environment):
    for words, code, text in (('--help',), 0, 'usage'), (('--sped', '3'), 2, '--sped'):
        process = start(name, *words)
        assert text in ''.join(process.communicate(timeout=DEADLINE))
        assert process.returncode == code


@pytest.mark.parametrize('wind_y', [0.0, 3.0, -3.0])
@pytest.mark.parametrize(
    ('launch', 'target'), [(Launch(roll=10.0), (26.0, 0.0)), (Launch(), (22.0, 5.0))]
)
def test_the_pilot_lands_a_disc_at_a_target_in_unknown_wind(load, launch, target, wind_y):
    pilot = load('steer_to_target.py').Pilot(FRISBEE.disc, np.array(target) * (1.0, -1.0))
    air = replace(FRISBEE, wind=Wind(mean=(0.0, -wind_y, 0.0)))
    assert math.dist(fly(launch, air).position[:2], target) > 5.0
    sim = FlightSimulator(air, launch.state())
    while not sim.landed:
        C_L, C_M = pilot.command(sim.time, sim.state).tolist()
        sim.control = Control(C_L, C_M, 0.0)
        sim.advance(20)
    assert math.dist((sim.touch.X, -sim.touch.Y), target) < 1.0
    np.testing.assert_allclose(pilot.wind, (0.0, -wind_y), atol=0.2)


def test_steer_to_target_lands_within_a_metre_and_writes_bag_and_plot(tmp_path):
    options = ('--target', '26', '0', '--roll', '10', '--wind', '0', '3', '0', '--pace', '0.5')
    output = run('steer_to_target.py', *options, '--folder', str(tmp_path / 'x'))
    assert 'identical to the last bit' in output
    assert (tmp_path / 'x/flight.png').stat().st_size > 10_000
    assert open_bag(tmp_path / 'x/bag').complete
    unsteered = re.search(r'misses by (\d+\.\d+) m', output)
    steered = re.search(r'(\d+\.\d+) m from the target', output)
    assert float(unsteered[1]) > 5.0
    assert float(steered[1]) < 1.0


def test_spiral_flies_the_spiral_turn_of_the_paper(tmp_path, load):
    output = run('spiral.py', 'turn', '--folder', str(tmp_path / 'x'), '--pace', '2')
    assert 'identical to the last bit' in output
    module = load('spiral.py')
    turn = module.MANOEUVRES['turn']
    spin = module.parameters(turn)['launch.spin']
    expected = fly(Launch(**turn.launch, spin=spin), FRISBEE, control=Control(*turn.command))
    line = output.splitlines()[-1]
    numbers = re.search(r'x (-?[\d.]+) m, y (-?[\d.]+) m, .* after ([\d.]+) s', line)
    x, y, time = map(float, numbers.groups())
    assert (x, y) == pytest.approx(expected.position[:2], abs=0.006)  # two digits
    assert time == pytest.approx(expected.time, abs=0.006)
