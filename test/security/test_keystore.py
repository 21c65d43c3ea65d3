"""The policies and the keystore that is made of them, judged by `openssl` and by the topics."""

from datetime import UTC, datetime
import importlib.util
from pathlib import Path
import shutil
import subprocess
import sys
from xml.etree import ElementTree as Xml

import pytest

ROOT = Path(__file__).parents[2]
SCRIPT = ROOT / 'security' / 'make_keystore.py'
spec = importlib.util.spec_from_file_location('make_keystore', SCRIPT)
make_keystore = importlib.util.module_from_spec(spec)
sys.modules['make_keystore'] = make_keystore  # where dataclasses look it up
spec.loader.exec_module(make_keystore)

POLICIES = sorted(make_keystore.POLICIES.glob('*.xml'))
ENCLAVES = {e.path.rpartition('/')[2]: e for f in POLICIES for e in make_keystore.read_policy(f)}
COMMANDS = {'rt/cmd_moment', 'rt/cmd_coefficients', 'rt/throw', 'rt/wind'}
SERVICES = {f'rq/sim_node/{name}Request' for name in ('throw', 'reset', 'pause', 'step')}
SETTING = {
    f'rq/{node}/{name}Request'
    for node in ('sim_node', 'recorder_node')
    for name in ('set_parameters', 'set_parameters_atomically')
}

needs_openssl = pytest.mark.skipif(shutil.which('openssl') is None, reason='needs openssl')


def run(*arguments):
    return subprocess.run(
        [str(a) for a in arguments], capture_output=True, text=True, check=False, timeout=120
    )


def make(*arguments):
    return run(sys.executable, SCRIPT, *arguments)


@pytest.fixture(scope='module')
def keystore(tmp_path_factory):
    folder = tmp_path_factory.mktemp('security') / 'key store'
    done = make(folder, '--domain', '42')
    assert done.returncode == 0, done.stderr
    return folder


def verified(document, authority):
    """Whether a signed document is what its authority signed."""
    done = run('openssl', 'smime', '-verify', '-text', '-in', document, '-CAfile', authority)
    return done.returncode == 0


def test_only_the_controller_steers_and_only_the_operator_throws_and_sets():
    may = {name: e.publish & (COMMANDS | SERVICES | SETTING) for name, e in ENCLAVES.items()}
    assert may == {
        'sim_node': set(),
        'recorder_node': set(),
        'viewer': set(),
        'controller': {'rt/cmd_moment', 'rt/cmd_coefficients'},
        'operator': {'rt/throw', 'rt/wind'} | SERVICES | SETTING,
    }


def test_nobody_but_the_simulator_publishes_its_state_or_answers_for_it():
    mine = ENCLAVES['sim_node'].publish - {'ros_discovery_info', 'rt/rosout',
                                           'rt/parameter_events', 'rt/diagnostics'}  # fmt: skip
    assert 'rt/odom' in mine
    assert 'rr/sim_node/resetReply' in mine
    for name, enclave in ENCLAVES.items():
        assert name == 'sim_node' or not enclave.publish & mine


def test_only_the_recorder_has_a_wildcard_and_only_to_hear():
    wide = {(name, pattern) for name, e in ENCLAVES.items()
            for pattern in e.publish | e.subscribe if '*' in pattern}  # fmt: skip
    assert wide == {('recorder_node', 'rt/*')}
    assert 'rt/*' not in ENCLAVES['recorder_node'].publish


def test_every_participant_may_take_part_in_the_graph():
    for enclave in ENCLAVES.values():
        assert 'ros_discovery_info' in enclave.publish & enclave.subscribe
        assert {'rt/rosout', 'rt/parameter_events'} <= enclave.publish


@needs_openssl
@pytest.mark.parametrize('name', sorted(ENCLAVES))
def test_an_enclave_is_complete_certified_and_signed(keystore, name):
    place = keystore / 'enclaves' / 'disc_sim' / name
    for file in ('identity_ca.cert.pem', 'permissions_ca.cert.pem', 'cert.pem', 'key.pem',
                 'governance.p7s', 'permissions.p7s'):  # fmt: skip
        assert (place / file).is_file(), file  # links lead somewhere
    assert (place / 'key.pem').stat().st_mode & 0o077 == 0
    authority = place / 'identity_ca.cert.pem'
    assert run('openssl', 'verify', '-CAfile', authority, place / 'cert.pem').returncode == 0
    subject = run('openssl', 'x509', '-in', place / 'cert.pem', '-noout', '-subject',
                  '-nameopt', 'RFC2253').stdout.strip()  # fmt: skip
    assert subject == f'subject=CN=/disc_sim/{name}'
    for document in ('governance.p7s', 'permissions.p7s'):
        assert verified(place / document, place / 'permissions_ca.cert.pem')
    # The key belongs to the certificate.
    of_key = run('openssl', 'pkey', '-in', place / 'key.pem', '-pubout').stdout
    assert run('openssl', 'x509', '-in', place / 'cert.pem', '-noout', '-pubkey').stdout == of_key


@needs_openssl
def test_the_permissions_are_those_of_the_policy(keystore):
    for name, enclave in ENCLAVES.items():
        file = keystore / 'enclaves' / 'disc_sim' / name / 'permissions.xml'
        (grant,) = Xml.parse(file).getroot().findall('permissions/grant')
        assert grant.findtext('subject_name') == f'CN=/disc_sim/{name}'
        assert grant.findtext('default') == 'DENY'
        assert [e.text for e in grant.findall('allow_rule/domains/id')] == ['42']
        for verb in ('publish', 'subscribe'):
            topics = {e.text for e in grant.findall(f'allow_rule/{verb}/topics/topic')}
            assert topics == getattr(enclave, verb)
        begin, end = (datetime.fromisoformat(grant.findtext(f'validity/{k}')).replace(tzinfo=UTC)
                      for k in ('not_before', 'not_after'))  # fmt: skip
        assert begin < datetime.now(UTC) < end


@needs_openssl
def test_a_changed_or_foreign_permission_does_not_verify(keystore, tmp_path):
    place = keystore / 'enclaves' / 'disc_sim' / 'viewer'
    signed = (place / 'permissions.p7s').read_text()
    forged = tmp_path / 'permissions.p7s'
    forged.write_text(signed.replace('rt/rosout', 'rt/cmd_moment'))
    assert not verified(forged, place / 'permissions_ca.cert.pem')
    assert make(tmp_path / 'foreign').returncode == 0
    assert not verified(place / 'permissions.p7s', tmp_path / 'foreign/public/ca.cert.pem')


@needs_openssl
def test_the_keys_of_the_authority_are_for_its_owner_and_nothing_is_overwritten(keystore):
    assert (keystore / 'private').stat().st_mode & 0o077 == 0
    before = (keystore / 'public' / 'ca.cert.pem').read_bytes()
    again = make(keystore)
    assert again.returncode == 2
    assert 'never overwritten' in again.stderr
    assert again.stderr.count('\n') == 1
    assert (keystore / 'public' / 'ca.cert.pem').read_bytes() == before


@needs_openssl
def test_a_namespace_moves_the_relative_names_alone(tmp_path):
    assert make(tmp_path / 'red', '--namespace', '/red').returncode == 0
    text = (tmp_path / 'red/enclaves/disc_sim/controller/permissions.xml').read_text()
    assert '<topic>rt/red/cmd_moment</topic>' in text
    assert '<topic>rt/clock</topic>' in text
    assert '<topic>rt/cmd_moment</topic>' not in text


@pytest.mark.parametrize(
    ('arguments', 'message'),
    [
        (('--domain', '233'), '--domain: 233 is not allowed'),
        (('--days', '0'), '--days: 0 is not allowed'),
        (('--namespace', 'red'), '--namespace: '),
        (('no.xml',), 'no.xml: cannot be read'),
    ],
)
def test_bad_input_is_refused_and_leaves_nothing(tmp_path, arguments, message):
    done = make(tmp_path / 'new', *arguments)
    assert done.returncode == 2
    assert message in done.stderr
    assert not (tmp_path / 'new').exists()


def test_a_rule_that_is_not_understood_is_refused(tmp_path):
    text = (make_keystore.POLICIES / 'viewer.xml').read_text()
    changed = tmp_path / 'changed.xml'
    for old, new in (('subscribe="ALLOW"', 'subscribe="DENY"'), ('0.2.0', '0.1.0')):
        assert old in text
        changed.write_text(text.replace(old, new))
        with pytest.raises(make_keystore.PolicyError):
            make_keystore.read_policy(changed)
