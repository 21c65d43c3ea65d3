"""What the nodes really open against what their policies allow, and security that is asked for.

The ROS 2 wheels have Fast DDS without its security plugins: that a policy is enforced is shown by
security/fast_dds/check.py with those of Debian; docs/security.md has its answers.
"""

import importlib.util
import os
from pathlib import Path
import shutil
import signal
import subprocess
import sys
import time

import pytest

rclpy = pytest.importorskip('rclpy')

from ros.sim_process import DEADLINE  # noqa: E402 - needs rclpy

pytestmark = pytest.mark.ros
SECURITY = Path(__file__).parents[2] / 'security'
spec = importlib.util.spec_from_file_location('make_keystore', SECURITY / 'make_keystore.py')
make_keystore = importlib.util.module_from_spec(spec)
sys.modules['make_keystore'] = make_keystore
spec.loader.exec_module(make_keystore)
RECORDER = 'import sys; from disc_sim_ros.cli.recorder_node import main; sys.exit(main())'


def allowed(name):
    (enclave,) = make_keystore.read_policy(SECURITY / 'policies' / f'{name}.xml')
    return enclave


def opened(node, name):
    """Topics of DDS that a node publishes and subscribes to, by the graph; none before it is."""
    if name not in {found for found, _ in node.get_node_names_and_namespaces()}:
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


def test_the_simulator_opens_what_its_policy_allows_and_nothing_else(ros):
    """A topic that the policy forgets keeps the node from starting; one too many is a hole."""
    policy = allowed('sim_node')
    ros.start({'publish_clock': True, 'auto_throw': False})
    optional = {'rt/tf', 'rt/clock', 'ros_discovery_info'}  # tf2_msgs, use_sim_time
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
    policy = allowed('recorder_node')
    ros.start({'auto_throw': False})
    process = subprocess.Popen(
        [sys.executable, '-c', RECORDER, '--ros-args', '-p', f'bag:={tmp_path / "bag"}'],
        stderr=subprocess.DEVNULL,
    )
    try:
        ros.spin_until(
            lambda: 'rt/odom' in opened(ros.node, 'recorder_node')[1], 'the recorder to hear odom'
        )
        publish, subscribe = opened(ros.node, 'recorder_node')
    finally:
        process.send_signal(signal.SIGINT)
        assert process.wait(DEADLINE) == 0
    assert policy.publish - {'ros_discovery_info'} == publish
    services = {topic for topic in subscribe if topic.startswith(('rq', 'rr'))}
    assert services == {topic for topic in policy.subscribe if topic.startswith(('rq', 'rr'))}


def _has_plugins():
    (library,) = list(Path(sys.prefix, 'lib').glob('libfastrtps.so.*.*.*'))[:1] or [None]
    return library is None or b'builtin.PKI-DH' in library.read_bytes()


@pytest.mark.parametrize('strategy', ['Enforce', 'Permissive'])
@pytest.mark.parametrize('enclave', ['there', 'missing'])
def test_security_that_cannot_be_had_is_not_done_without(
    ros_environment, tmp_path, strategy, enclave
):
    """With Enforce no node starts unprotected, nor with an enclave and a Fast DDS without plugins.

    Permissive is what it says: without an enclave a node starts unprotected.
    """
    if shutil.which('openssl') is None:
        pytest.skip('needs openssl')
    if _has_plugins() or (strategy, enclave) == ('Permissive', 'missing'):
        pytest.skip('a node would start')
    keystore = tmp_path / 'keystore'
    command = [sys.executable, SECURITY / 'make_keystore.py', keystore]
    subprocess.run([*command, '--domain', str(ros_environment)], check=True,
                   stdout=subprocess.DEVNULL)  # fmt: skip
    environment = {
        **os.environ, 'ROS_SECURITY_ENABLE': 'true', 'ROS_SECURITY_STRATEGY': strategy,
        'ROS_SECURITY_KEYSTORE': str(keystore),
    }  # fmt: skip
    name = '/disc_sim/sim_node' if enclave == 'there' else '/disc_sim/stranger'
    begin = time.monotonic()
    done = subprocess.run(
        [sys.executable, '-m', 'disc_sim_ros.ros.sim.node', '--ros-args', '--enclave', name],
        env=environment, capture_output=True, text=True, check=False, timeout=DEADLINE,
    )  # fmt: skip
    assert done.returncode == 2, (done, time.monotonic() - begin)
    assert 'Traceback' not in done.stderr
    last = done.stderr.strip().splitlines()[-1]
    expected = "doesn't have the security libraries" if enclave == 'there' else 'SECURITY ERROR'
    assert last.startswith('sim_node: error: ')
    assert expected in last


def test_a_demo_keeps_to_this_machine_and_to_a_domain_of_its_own(monkeypatch):
    from disc_sim_ros.ros.processes import own_domain

    monkeypatch.setenv('ROS_DOMAIN_ID', '0')
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'SUBNET')
    with own_domain() as first, own_domain() as second:
        assert os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] == 'LOCALHOST'
        assert os.environ['ROS_DOMAIN_ID'] == str(second)
        assert 0 < first != second > 0
