#!/usr/bin/env python3
"""Make a keystore for SROS 2 from the policies beside this file; needs the `openssl` program.

    security/make_keystore.py KEYSTORE [--domain 0] [--namespace /] [POLICY.xml ...]

The layout is that of `ros2 security create_keystore`: `ros2 security list_enclaves`,
`create_enclave` and `create_permission` go on working on it. docs/security.md tells how to use it.
"""

import argparse
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
import re
import secrets
import shutil
import subprocess
import sys
import tempfile
from xml.etree import ElementTree as Xml

POLICIES = Path(__file__).parent / 'policies'
CA_NAME = 'sros2CA'
_SPEC = 'http://www.omg.org/spec/DDS-SECURITY/20170901'
_XSI = 'http://www.w3.org/2001/XMLSchema-instance'
_GRAPH = 'ros_discovery_info'  # the topic of the ROS graph, which every participant needs
# What a permission of a policy means for the topics of DDS: (publish, subscribe) patterns.
_MEANING = {
    ('topics', 'publish'): (('rt{}',), ()),
    ('topics', 'subscribe'): ((), ('rt{}',)),
    ('services', 'reply'): (('rr{}Reply',), ('rq{}Request',)),
    ('services', 'request'): (('rq{}Request',), ('rr{}Reply',)),
}
_NAMESPACE = re.compile(r'/([A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*)?')


class PolicyError(Exception):
    """A policy, or a keystore, is not what it should be; one line says which and why."""


@dataclass(frozen=True)
class Enclave:
    """What one enclave may publish and subscribe to, as topics of DDS.

    Attributes:
        path: Its name, such as '/disc_sim/viewer'.
        publish: Topics of DDS; * stands for any characters.
        subscribe: As `publish`.
    """

    path: str
    publish: frozenset[str]
    subscribe: frozenset[str]


def read_policy(file: Path, namespace: str = '/') -> list[Enclave]:
    """Return the enclaves of a policy in the format of SROS 2, version 0.2.0.

    Args:
        file: The policy.
        namespace: In place of the profiles' namespace /.

    Raises:
        PolicyError: It is no such policy, or denies, which only a `DENY` by default does here.
    """
    try:
        policy = Xml.parse(file).getroot()  # noqa: S314 - written by who runs this
    except (Xml.ParseError, OSError) as error:
        raise PolicyError(f'{file}: cannot be read ({error})') from None
    if policy.tag != 'policy' or policy.get('version') != '0.2.0':
        raise PolicyError(f'{file}: the root must be <policy version="0.2.0">')
    found = []
    for element in policy.findall('enclaves/enclave'):
        publish, subscribe = {_GRAPH}, {_GRAPH}
        for profile in element.findall('profiles/profile'):
            ns, node = profile.attrib['ns'], profile.attrib['node']
            for rule in profile:
                for verb, answer in rule.attrib.items():
                    if (rule.tag, verb) not in _MEANING or answer != 'ALLOW':
                        raise PolicyError(f'{file}: <{rule.tag} {verb}="{answer}"> is not known')
                    sent, heard = _MEANING[rule.tag, verb]
                    space = namespace if ns == '/' else ns
                    names = [_full(space, node, item.text or '') for item in rule]
                    publish |= {pattern.format(name) for pattern in sent for name in names}
                    subscribe |= {pattern.format(name) for pattern in heard for name in names}
        found.append(Enclave(element.attrib['path'], frozenset(publish), frozenset(subscribe)))
    if not found:
        raise PolicyError(f'{file}: no enclave in it')
    return found


def _full(namespace: str, node: str, name: str) -> str:
    """Return the full name of a topic or service."""
    if name.startswith('/'):
        return name
    space = namespace.rstrip('/')
    return f'{space}/{node}{name[1:]}' if name.startswith('~') else f'{space}/{name}'


def permissions(enclave: Enclave, domain: int, begin: datetime, end: datetime) -> bytes:
    """Return the permissions document of an enclave, DDS Security 1.1, section 9.4.1.3."""
    root, inner = _document('permissions')
    grant = Xml.SubElement(inner, 'grant', name=enclave.path)
    _add(grant, 'subject_name', f'CN={enclave.path}')
    validity = Xml.SubElement(grant, 'validity')
    _add(validity, 'not_before', f'{begin:%Y-%m-%dT%H:%M:%S}')
    _add(validity, 'not_after', f'{end:%Y-%m-%dT%H:%M:%S}')
    rule = Xml.SubElement(grant, 'allow_rule')
    _add(Xml.SubElement(rule, 'domains'), 'id', str(domain))
    for verb, names in (('publish', enclave.publish), ('subscribe', enclave.subscribe)):
        topics = Xml.SubElement(Xml.SubElement(rule, verb), 'topics')
        for name in sorted(names):
            _add(topics, 'topic', name)
    _add(grant, 'default', 'DENY')
    return _written(root)


def governance(domain: int) -> bytes:
    """Return the governance document: all authenticated, controlled and encrypted."""
    root, inner = _document('governance', 'domain_access_rules')
    rule = Xml.SubElement(inner, 'domain_rule')
    _add(Xml.SubElement(rule, 'domains'), 'id', str(domain))
    _add(rule, 'allow_unauthenticated_participants', 'false')
    _add(rule, 'enable_join_access_control', 'true')
    for kind in ('discovery', 'liveliness', 'rtps'):
        _add(rule, f'{kind}_protection_kind', 'ENCRYPT')
    topic = Xml.SubElement(Xml.SubElement(rule, 'topic_access_rules'), 'topic_rule')
    _add(topic, 'topic_expression', '*')
    for what in ('discovery_protection', 'liveliness_protection', 'read_access_control',
                 'write_access_control'):  # fmt: skip
        _add(topic, f'enable_{what}', 'true')
    for kind in ('metadata', 'data'):
        _add(topic, f'{kind}_protection_kind', 'ENCRYPT')
    return _written(root)


def _document(kind: str, inner: str = '') -> tuple[Xml.Element, Xml.Element]:
    Xml.register_namespace('xsi', _XSI)
    place = {f'{{{_XSI}}}noNamespaceSchemaLocation': f'{_SPEC}/omg_shared_ca_{kind}.xsd'}
    root = Xml.Element('dds', place)
    return root, Xml.SubElement(root, inner or kind)


def _add(parent: Xml.Element, tag: str, text: str) -> None:
    Xml.SubElement(parent, tag).text = text


def _written(root: Xml.Element) -> bytes:
    Xml.indent(root)
    return bytes(Xml.tostring(root, encoding='UTF-8', xml_declaration=True)) + b'\n'


class Keystore:
    """A new keystore, with one authority for identities and permissions."""

    def __init__(self, folder: Path, domain: int, days: int) -> None:
        """Make the folders, the authority and the governance document.

        Raises:
            PolicyError: The folder exists, or openssl is not there or fails.
        """
        if folder.exists():
            raise PolicyError(f'{folder}: it exists already, and is never overwritten')
        self._openssl = shutil.which('openssl')
        if self._openssl is None:
            raise PolicyError('openssl: the program is not there (apt install openssl)')
        self.folder, self.domain, self._days = folder, domain, days
        self._begin = datetime.now(UTC) - timedelta(days=1)  # clocks of robots differ
        self._end = self._begin + timedelta(days=days)
        self._private, self._public = folder / 'private', folder / 'public'
        for part in (self._private, self._public, folder / 'enclaves'):
            part.mkdir(parents=True)
        self._private.chmod(0o700)
        self._authority()
        source = folder / 'enclaves' / 'governance.xml'
        source.write_bytes(governance(domain))
        self._sign(source)

    def add(self, enclave: Enclave) -> None:
        """Add an enclave: its key, certificate and signed permissions."""
        place = self.folder / 'enclaves' / enclave.path.lstrip('/')
        place.mkdir(parents=True)
        up = Path(*['..'] * len(place.relative_to(self.folder).parts))
        for name in ('identity_ca.cert.pem', 'permissions_ca.cert.pem'):
            (place / name).symlink_to(up / 'public' / name)
        (place / 'governance.p7s').symlink_to(up / 'enclaves' / 'governance.p7s')
        self._key(place / 'key.pem')
        self._certificate(place / 'cert.pem', place / 'key.pem', enclave.path)
        document = place / 'permissions.xml'
        document.write_bytes(permissions(enclave, self.domain, self._begin, self._end))
        self._sign(document)

    def _authority(self) -> None:
        key, certificate = self._private / 'ca.key.pem', self._public / 'ca.cert.pem'
        self._key(key)
        self._certificate(certificate, key, CA_NAME)
        for role in ('identity', 'permissions'):
            (self._private / f'{role}_ca.key.pem').symlink_to(key.name)
            (self._public / f'{role}_ca.cert.pem').symlink_to(certificate.name)

    def _key(self, file: Path) -> None:
        self._run('genpkey', '-algorithm', 'EC', '-pkeyopt', 'ec_paramgen_curve:P-256', '-out',
                  str(file))  # fmt: skip
        file.chmod(0o600)

    def _certificate(self, file: Path, key: Path, name: str) -> None:
        """Certify a key: the authority by itself, all others by the authority."""
        own = name == CA_NAME
        with tempfile.TemporaryDirectory() as folder:
            config, request = Path(folder) / 'config', Path(folder) / 'request'
            basic = 'critical,CA:TRUE,pathlen:1' if own else 'CA:FALSE'
            config.write_text(
                f'[req]\nprompt=no\ndistinguished_name=name\n[name]\nCN={name}\n'
                f'[kind]\nbasicConstraints={basic}\n'
            )
            self._run('req', '-new', '-sha256', '-config', str(config), '-key', str(key), '-out',
                      str(request))  # fmt: skip
            by = (
                ('-signkey', str(key))
                if own
                else ('-CA', str(self._public / 'ca.cert.pem'),
                      '-CAkey', str(self._private / 'ca.key.pem'))
            )  # fmt: skip
            self._run('x509', '-req', '-sha256', '-in', str(request), '-out', str(file), '-days',
                      str(self._days), '-set_serial', f'0x{secrets.token_hex(16)}',
                      '-extfile', str(config), '-extensions', 'kind', *by)  # fmt: skip

    def _sign(self, document: Path) -> None:
        """Write a document signed by the authority, S/MIME with the text in clear."""
        self._run('smime', '-sign', '-text', '-md', 'sha256', '-in', str(document), '-out',
                  str(document.with_suffix('.p7s')), '-signer', str(self._public / 'ca.cert.pem'),
                  '-inkey', str(self._private / 'ca.key.pem'))  # fmt: skip

    def _run(self, *arguments: str) -> None:
        done = subprocess.run(  # noqa: S603 - found by `which`, and no shell
            [str(self._openssl), *arguments], capture_output=True, text=True, check=False
        )
        if done.returncode:
            said = done.stderr.strip().splitlines() or ['it said nothing']
            raise PolicyError(f'openssl {arguments[0]} failed: {said[-1]}')


def main(arguments: list[str] | None = None) -> int:
    """Make a keystore; return the exit code."""
    p = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    p.add_argument('keystore', type=Path, metavar='KEYSTORE', help='folder to make')
    p.add_argument('policy', type=Path, nargs='*', metavar='POLICY.xml', help='default: all here')
    p.add_argument('--domain', type=int, default=0, metavar='ID', help='ROS domain, 0 to 232')
    p.add_argument('--namespace', default='/', metavar='/NS', help='of the nodes (default: /)')
    p.add_argument('--days', type=int, default=3650, metavar='N', help='valid, 1 to 36500')
    chosen = p.parse_args(arguments)
    if not 0 <= chosen.domain <= 232:
        p.error(f'--domain: {chosen.domain} is not allowed; give a number from 0 to 232')
    if not 1 <= chosen.days <= 36500:
        p.error(f'--days: {chosen.days} is not allowed; give a number from 1 to 36500')
    if not _NAMESPACE.fullmatch(chosen.namespace):
        p.error(f'--namespace: {chosen.namespace!r} is not allowed; such as /red')
    try:
        files = chosen.policy or sorted(POLICIES.glob('*.xml'))
        enclaves = [e for file in files for e in read_policy(file, chosen.namespace)]
        keystore = Keystore(chosen.keystore, chosen.domain, chosen.days)
        for enclave in enclaves:
            keystore.add(enclave)
            sys.stdout.write(
                f'{enclave.path}: may publish {len(enclave.publish)} topics of DDS, hear '
                f'{len(enclave.subscribe)}\n'
            )
    except (PolicyError, OSError) as error:
        sys.stderr.write(f'make_keystore: error: {error}\n')
        return 2
    sys.stdout.write(f'made {chosen.keystore}; keep {chosen.keystore}/private to yourself\n')
    return 0


if __name__ == '__main__':
    sys.exit(main())
