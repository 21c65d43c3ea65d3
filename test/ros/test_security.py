"""The nodes open what their policies allow, and do not start unprotected where security is on.

The Fast DDS of the ROS 2 wheels has no security plugins. security/fast_dds/check.py tests the
enforcement of the policies with Debian's Fast DDS; docs/security.md has the results.
"""

import os
from pathlib import Path
import signal
import subprocess
import sys
import time

import pytest

rclpy = pytest.importorskip('rclpy')

from disc_sim_ros.ros.processes import started  # noqa: E402 - needs rclpy
from disc_sim_ros.ros.sim.standard import offers  # noqa: E402 - needs rclpy
from forked import start  # noqa: E402 - needs rclpy
from ros.sim_process import DEADLINE  # noqa: E402 - needs rclpy
from security.policies import read_policy  # noqa: E402 - as above

pytestmark = pytest.mark.ros
ENCLAVE_FILES = (
    'cert.pem', 'governance.p7s', 'identity_ca.cert.pem', 'key.pem', 'permissions.p7s',
    'permissions_ca.cert.pem',
)  # fmt: skip


def opened(node, name):
    """Return the DDS topics that a node publishes and subscribes to, from the ROS graph."""
    if name not in {running for running, _ in node.get_node_names_and_namespaces()}:
        return set(), set()
    publish = {f'rt{t}' for t, _ in node.get_publisher_names_and_types_by_node(name, '/')}
    subscribe = {f'rt{t}' for t, _ in node.get_subscriber_names_and_types_by_node(name, '/')}
    for service, _ in node.get_service_names_and_types_by_node(name, '/'):
        publish.add(f'rr{service}Reply')
        subscribe.add(f'rq{service}Request')
    for service, _ in node.get_client_names_and_types_by_node(name, '/'):
        publish.add(f'rq{service}Request')
        subscribe.add(f'rr{service}Reply')
    return publish, subscribe


def service_of(topic):
    """Return the name of the service or action that a DDS topic is of."""
    return topic[2:].removesuffix('Reply').removesuffix('Request').split('/_action')[0]


def test_the_simulator_opens_what_its_policy_allows_and_nothing_else(ros):
    """A topic that the policy lacks stops the node from starting; one too many is a hole."""
    policy = read_policy('sim_node')
    ros.start({'publish_clock': True, 'auto_throw': False})
    optional = {'rt/tf', 'rt/clock', 'ros_discovery_info'}  # tf2_msgs, use_sim_time
    if not offers.is_installed():
        names = {f'/{offer.name}' for offer in offers.OFFERS}
        allowed = policy.publish | policy.subscribe
        optional |= {topic for topic in allowed if service_of(topic) in names}
    ros.spin_until(
        lambda: (
            policy.publish - optional <= opened(ros.node, 'sim_node')[0]
            and policy.subscribe - optional <= opened(ros.node, 'sim_node')[1]
        ),
        'all that the policy allows',
    )
    publish, subscribe = opened(ros.node, 'sim_node')
    assert publish <= policy.publish
    assert subscribe <= policy.subscribe


def test_the_recorder_opens_what_its_policy_allows(ros, tmp_path):
    policy = read_policy('recorder_node')
    ros.start({'auto_throw': False})
    arguments = ['--ros-args', '-p', f'bag:={tmp_path / "bag"}']
    process = start('disc_sim_ros.ros.recorder', arguments, tmp_path / 'recorder.txt')
    try:
        ros.spin_until(
            lambda: 'rt/odom' in opened(ros.node, 'recorder_node')[1],
            'a subscription to odom',
        )
        publish, subscribe = opened(ros.node, 'recorder_node')
    finally:
        process.send_signal(signal.SIGINT)
        assert process.wait(DEADLINE) == 0
    assert policy.publish - {'ros_discovery_info'} == publish
    services = {topic for topic in subscribe if topic.startswith(('rq', 'rr'))}
    assert services == {topic for topic in policy.subscribe if topic.startswith(('rq', 'rr'))}


def test_live_view_opens_what_its_policy_allows_and_nothing_else(ros, tmp_path):
    pytest.importorskip('trimesh')
    pytest.importorskip('websockets.asyncio')
    policy = read_policy('live_view')
    ros.start({'auto_throw': False})
    needed = policy.subscribe - {'ros_discovery_info'}
    with started('live_view', {'port': 0}, tmp_path) as live:
        ros.spin_until(lambda: needed <= opened(ros.node, 'live_view')[1], 'all subscriptions')
        publish, subscribe = opened(ros.node, 'live_view')
        live.end()
    assert publish == policy.publish - {'ros_discovery_info'}
    assert subscribe == needed


def _has_plugins():
    (library,) = list(Path(sys.prefix, 'lib').glob('libfast[rd]*.so.*.*.*'))[:1] or [None]
    return library is None or b'builtin.PKI-DH' in library.read_bytes()


@pytest.mark.parametrize('strategy', ['Enforce', 'Permissive'])
@pytest.mark.parametrize('enclave', ['there', 'missing'])
def test_a_node_does_not_start_unprotected_where_security_is_on(
    ros_environment, tmp_path, strategy, enclave
):
    """Without security plugins, or under Enforce without an enclave, the node must not start.

    Under Permissive a node without an enclave starts unprotected: that is its definition.
    """
    if _has_plugins() or (strategy, enclave) == ('Permissive', 'missing'):
        pytest.skip('a node would start')
    keystore = tmp_path / 'keystore'
    folder = keystore / 'enclaves/disc_sim/sim_node'
    folder.mkdir(parents=True)
    for file in ENCLAVE_FILES:  # Fast DDS fails before it reads them
        (folder / file).touch()
    environment = {
        **os.environ, 'ROS_SECURITY_ENABLE': 'true', 'ROS_SECURITY_STRATEGY': strategy,
        'ROS_SECURITY_KEYSTORE': str(keystore),
    }  # fmt: skip
    name = '/disc_sim/sim_node' if enclave == 'there' else '/disc_sim/stranger'
    begin = time.monotonic()
    done = subprocess.run(
        [sys.executable, '-m', 'disc_sim_ros.ros.sim', '--ros-args', '--enclave', name],
        env=environment, capture_output=True, text=True, check=False, timeout=DEADLINE,
    )  # fmt: skip
    assert done.returncode == 2, (done, time.monotonic() - begin)
    assert 'Traceback' not in done.stderr
    last = done.stderr.strip().splitlines()[-1]
    expected = "doesn't have the security libraries" if enclave == 'there' else 'SECURITY ERROR'
    assert last.startswith('sim_node: error: ')
    assert expected in last
