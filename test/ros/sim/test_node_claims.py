"""What sim_node claims of its work: "in time", "accepted", and what its services answer."""

import pytest

pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Vector3Stamped
from nav_msgs.msg import Odometry

from ros.sim.sim_messages import AT_LAUNCH, LONG, accepted, diagnostics_of, names, release_of

pytestmark = pytest.mark.ros
# A throw for which the thread of the simulation takes long.
SLOW_THROW = """
import time
from disc_sim_ros.ros.sim import services
from disc_sim_ros.ros.sim.loop import SimLoop
throw = SimLoop.throw
SimLoop.throw = lambda self: (time.sleep(4.0), throw(self))[1]
services.PATIENCE = 2.0
"""


def said(diagnostics) -> list[str]:
    return [array.status[0].message for array in diagnostics]


def test_a_thread_that_is_stuck_is_not_in_time_and_its_answer_says_that_it_acts(ros):
    sim = ros.start(AT_LAUNCH, before=SLOW_THROW)
    diagnostics = ros.subscribe(DiagnosticArray, '/diagnostics')
    events = ros.subscribe(DiagnosticStatus, 'flight_events')
    ros.spin_until(lambda: 'in time' in said(diagnostics), 'the ordinary message')
    response = ros.call(sim, 'throw')
    assert not response.success
    assert response.message.endswith('did not answer within 2 s, but has begun to act')
    diagnostics.clear()
    ros.spin_until(lambda: diagnostics, 'diagnostics')
    assert 'no step for' in said(diagnostics)[0]
    ros.spin_until(lambda: names(events) == ['thrown'], 'the throw, after all')
    diagnostics.clear()
    ros.spin_until(lambda: 'in time' in said(diagnostics), 'the ordinary message again')


def test_as_fast_as_possible_nothing_is_called_in_time(ros):
    ros.start(AT_LAUNCH | {'real_time_factor': 0.0})
    diagnostics = ros.subscribe(DiagnosticArray, '/diagnostics')
    ros.spin_until(lambda: len(diagnostics) > 1, 'diagnostics')
    assert set(said(diagnostics)) == {'as fast as possible'}


def test_commands_that_a_reset_discards_were_not_accepted(ros):
    """They waited for their stamps."""
    sim = ros.start(LONG)
    diagnostics = ros.subscribe(DiagnosticArray, '/diagnostics')
    publishers = {
        'cmd_coefficients': ros.publisher(Vector3Stamped, 'cmd_coefficients'),
        'throw': ros.publisher(Odometry, 'throw'),
    }
    for topic, message in (('cmd_coefficients', Vector3Stamped()), ('throw', release_of())):
        message.header.stamp.sec = 1_000_000
        ros.send(sim, publishers[topic], message, message)

    def values(kind: str) -> list[str]:
        newest = diagnostics_of(diagnostics)
        return [newest.get(f'{topic} {kind}', '') for topic in publishers]

    ros.spin_until(lambda: values('waiting') == ['2', '2'], 'the commands to wait')
    assert ros.call(sim, 'reset').success
    ros.spin_until(lambda: values('waiting') == ['0', '0'], 'the commands to be gone')
    assert values('accepted') == ['0', '0']
    assert values('dropped') == ['2', '2']
    assert all('a reset came before its time' in reason for reason in values('last reason'))
    assert accepted(diagnostics, 'throw') == 0
