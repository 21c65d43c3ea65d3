"""The policies of SROS 2: each node may do its work and nothing more."""

import xml.etree.ElementTree as ET

import pytest

from security.policies import POLICIES, read_policy

NAMES = sorted(path.stem for path in POLICIES.glob('*.xml'))
ENCLAVES = {name: read_policy(name) for name in NAMES}
COMMANDS = {'rt/cmd_moment', 'rt/cmd_coefficients', 'rt/throw', 'rt/wind'}
SERVICES = {f'rq/sim_node/{name}Request' for name in ('throw', 'reset', 'pause', 'step')}
SERVICES |= {  # of simulation_interfaces
    f'rq/{name}Request'
    for name in (
        'set_simulation_state', 'reset_simulation', 'step_simulation', 'set_entity_state',
        'simulate_steps/_action/send_goal',
    )
}  # fmt: skip
SET_PARAMETERS = {
    f'rq/{node}/{name}Request'
    for node in ('sim_node', 'recorder_node')
    for name in ('set_parameters', 'set_parameters_atomically')
}
# The parameters of live_view are fixed from its start: no enclave needs to set them.
PARAMETERS_OF_LIVE_VIEW = {
    f'rq/live_view/{name}Request' for name in ('set_parameters', 'set_parameters_atomically')
}
OF_EVERY_NODE = {'ros_discovery_info', 'rt/rosout', 'rt/parameter_events'}


def test_only_the_controller_steers_and_only_the_operator_sets_parameters():
    restricted = COMMANDS | SERVICES | SET_PARAMETERS | PARAMETERS_OF_LIVE_VIEW
    assert {name: e.publish & restricted for name, e in ENCLAVES.items()} == {
        'sim_node': set(),
        'recorder_node': set(),
        'viewer': set(),
        'live_view': {'rt/throw'},
        'controller': {'rt/cmd_moment', 'rt/cmd_coefficients'},
        'operator': {'rt/throw', 'rt/wind'} | SERVICES | SET_PARAMETERS,
    }


def test_only_the_simulator_publishes_its_state_and_answers_its_services():
    own = ENCLAVES['sim_node'].publish - OF_EVERY_NODE - {'rt/diagnostics'}
    assert 'rt/odom' in own
    assert 'rr/sim_node/resetReply' in own
    for name, enclave in ENCLAVES.items():
        assert name == 'sim_node' or not enclave.publish & own


def test_only_the_recorder_has_a_wildcard_and_only_to_subscribe():
    wide = {
        (name, pattern)
        for name, e in ENCLAVES.items()
        for pattern in e.publish | e.subscribe
        if '*' in pattern
    }
    assert wide == {('recorder_node', 'rt/*')}
    assert 'rt/*' not in ENCLAVES['recorder_node'].publish


def test_every_enclave_takes_part_in_the_graph():
    for enclave in ENCLAVES.values():
        assert 'ros_discovery_info' in enclave.publish & enclave.subscribe
        assert enclave.publish >= OF_EVERY_NODE


@pytest.mark.parametrize(
    ('old', 'new', 'error'),
    [
        ('subscribe="ALLOW"', 'subscribe="DENY"', KeyError),
        ('version="0.2.0"', 'version="0.1.0"', AssertionError),
        ('/disc_sim/viewer', '/disc_sim/other', AssertionError),
    ],
)
def test_a_rule_that_the_reader_does_not_know_is_noticed(tmp_path, old, new, error):
    text = (POLICIES / 'viewer.xml').read_text(encoding='utf-8')
    assert old in text
    (tmp_path / 'viewer.xml').write_text(text.replace(old, new), encoding='utf-8')
    with pytest.raises(error):
        read_policy('viewer', tmp_path)


@pytest.fixture(scope='module')
def keystore(tmp_path_factory):
    """Return a keystore with all enclaves, made by the library behind `ros2 security`."""
    sros2 = pytest.importorskip('sros2.keystore', reason='sros2 is not among the wheels on PyPI')
    folder = tmp_path_factory.mktemp('security') / 'keystore'
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv('ROS_DOMAIN_ID', '42')
        sros2.create_keystore(folder)
        for name in NAMES:
            sros2.create_enclave(folder, f'/disc_sim/{name}')
            sros2.create_permission(folder, f'/disc_sim/{name}', POLICIES / f'{name}.xml')
    return folder


@pytest.mark.parametrize('name', NAMES)
def test_ros2_security_grants_what_the_tests_read_from_the_policy(keystore, name):
    file = keystore / 'enclaves/disc_sim' / name / 'permissions.xml'
    (grant,) = ET.parse(file).getroot().findall('permissions/grant')
    assert grant.findtext('subject_name') == f'CN=/disc_sim/{name}'
    assert grant.findtext('default') == 'DENY'
    assert {e.text for e in grant.findall('allow_rule/domains/id')} == {'42'}
    for verb in ('publish', 'subscribe'):
        topics = {e.text for e in grant.findall(f'allow_rule/{verb}/topics/topic')}
        assert topics == getattr(ENCLAVES[name], verb)
