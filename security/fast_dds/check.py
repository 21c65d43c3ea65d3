#!/usr/bin/env python3
"""Check with the security plugins of Fast DDS which participants the policies let communicate.

    apt-get install g++ libfastrtps-dev              # Debian 12, Ubuntu 24.04 or ROS's own
    security/fast_dds/check.py [--root /usr] [--domain 77]

Run it in a ROS 2 installation: its package sros2, the library behind `ros2 security`, makes the
keystores. The Fast DDS of the ROS 2 wheels on PyPI has no security plugins; Debian's package has
them. `peer.cpp` sets them up as rmw_fastrtps does. Exit code 1 if a result is not as expected.
"""

import argparse
import os
from pathlib import Path
import shutil
import subprocess
import sys
import tempfile

HERE = Path(__file__).parent
POLICIES = HERE.parent / 'policies'
SECONDS = 5.0  # to discover each other: a handshake takes about 1 s
OUTCOMES = RECEIVED, MATCHED, UNMATCHED, REFUSED = 'received', 'matched', 'unmatched', 'refused'

# The writer, the reader, the DDS topic, and the outcome for the reader and for the writer.
CASES = (
    ('controller', 'sim_node', 'rt/cmd_moment', RECEIVED, MATCHED),
    ('controller', 'sim_node', 'rt/cmd_coefficients', RECEIVED, MATCHED),
    ('operator', 'sim_node', 'rt/throw', RECEIVED, MATCHED),
    ('operator', 'sim_node', 'rq/sim_node/resetRequest', RECEIVED, MATCHED),
    ('sim_node', 'viewer', 'rt/odom', RECEIVED, MATCHED),
    ('sim_node', 'recorder_node', 'rt/odom', RECEIVED, MATCHED),
    ('controller', 'recorder_node', 'rt/cmd_moment', RECEIVED, MATCHED),
    # The permissions of the writer forbid it.
    ('viewer', 'sim_node', 'rt/cmd_moment', UNMATCHED, REFUSED),
    ('recorder_node', 'sim_node', 'rt/cmd_moment', UNMATCHED, REFUSED),
    ('controller', 'sim_node', 'rt/throw', UNMATCHED, REFUSED),
    ('controller', 'sim_node', 'rq/sim_node/resetRequest', UNMATCHED, REFUSED),
    ('controller', 'sim_node', 'rq/sim_node/set_parametersRequest', UNMATCHED, REFUSED),
    # No certificate, or one of another authority.
    ('none', 'sim_node', 'rt/cmd_moment', UNMATCHED, UNMATCHED),
    ('sim_node', 'none', 'rt/odom', UNMATCHED, UNMATCHED),
    ('foreign/controller', 'sim_node', 'rt/cmd_moment', UNMATCHED, UNMATCHED),
    # The certificate of the viewer, with permissions signed by another authority.
    ('usurper', 'sim_node', 'rt/cmd_moment', UNMATCHED, UNMATCHED),
    # Permissions that were edited, and those of another enclave.
    ('forged', 'sim_node', 'rt/cmd_moment', UNMATCHED, REFUSED),
    ('borrowed', 'sim_node', 'rt/cmd_moment', UNMATCHED, REFUSED),
)


def main() -> int:
    """Try every case; return the exit code."""
    p = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    p.add_argument('--root', type=Path, default=Path('/usr'), help='where Fast DDS is installed')
    p.add_argument('--domain', type=int, default=77, metavar='ID')
    chosen = p.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        peer = _compiled(place / 'peer', chosen.root)
        enclaves = _enclaves(place, chosen.domain)
        wrong = 0
        for writer, reader, topic, *expected in CASES:
            outcomes = _pair(peer, chosen, enclaves[writer], enclaves[reader], topic)
            good = outcomes == expected
            wrong += not good
            sys.stdout.write(
                f'{"ok   " if good else "WRONG"} {writer:19} to {reader:13} on {topic:34} '
                f'reader {outcomes[0]}, writer {outcomes[1]}\n'
            )
            sys.stdout.flush()
    sys.stdout.write(f'{len(CASES) - wrong} of {len(CASES)} as expected\n')
    return int(wrong > 0)


def _compiled(peer: Path, root: Path) -> Path:
    """Compile the peer; exit if that fails."""
    machine = f'{os.uname().machine}-linux-gnu'
    libraries = root / 'lib' / machine
    command = [
        'g++', '-std=c++17', f'-I{root}/include', f'-I{root}/include/{machine}',
        str(HERE / 'peer.cpp'), '-o', str(peer), f'-L{libraries}', '-lfastrtps', '-lfastcdr',
        f'-Wl,-rpath-link,{libraries}',
    ]  # fmt: skip
    if subprocess.run(command, check=False).returncode:  # noqa: S603 - no shell, own words
        sys.exit('check: peer.cpp does not compile; is libfastrtps-dev installed?')
    return peer


def _enclaves(place: Path, domain: int) -> dict[str, str]:
    """Make a keystore, two others with authorities of their own, and three forgeries."""
    grand = place / 'grand.xml'
    controller = (POLICIES / 'controller.xml').read_text()
    grand.write_text(controller.replace('/disc_sim/controller', '/disc_sim/viewer'))
    all_policies = {path.stem: path for path in POLICIES.glob('*.xml')}
    _keystore(place / 'keystore', all_policies, domain)
    _keystore(place / 'foreign', all_policies, domain)
    _keystore(place / 'grand', {'viewer': grand}, domain)
    own = place / 'keystore' / 'enclaves' / 'disc_sim'
    folders = {folder.name: str(folder) for folder in own.iterdir()}
    folders['none'] = 'none'
    folders['foreign/controller'] = str(place / 'foreign' / 'enclaves' / 'disc_sim' / 'controller')
    for name in ('forged', 'borrowed', 'usurper'):
        shutil.copytree(own / 'viewer', own / name)  # follows the links
        folders[name] = str(own / name)
    permissions = own / 'forged' / 'permissions.p7s'
    text = permissions.read_text()
    forged = text.replace('rt/rosout', 'rt/cmd_moment')
    if forged == text:
        sys.exit('check: the permissions of the viewer have no rt/rosout that could be replaced')
    permissions.write_text(forged)
    shutil.copy(own / 'controller' / 'permissions.p7s', own / 'borrowed' / 'permissions.p7s')
    for name in ('permissions_ca.cert.pem', 'governance.p7s', 'permissions.p7s'):
        shutil.copy(place / 'grand' / 'enclaves' / 'disc_sim' / 'viewer' / name, own / 'usurper')
    return folders


def _keystore(folder: Path, policies: dict[str, Path], domain: int) -> None:
    """Make a keystore with an enclave for each policy, as `ros2 security` does."""
    try:
        from sros2 import keystore  # noqa: PLC0415 - only a ROS installation has it
    except ImportError as error:
        sys.exit(f'check: {error}; source a ROS 2 installation with the package sros2')
    os.environ['ROS_DOMAIN_ID'] = str(domain)  # read by sros2
    keystore.create_keystore(folder)
    for name, policy in policies.items():
        keystore.create_enclave(folder, f'/disc_sim/{name}')
        keystore.create_permission(folder, f'/disc_sim/{name}', policy)


def _pair(
    peer: Path, chosen: argparse.Namespace, writer: str, reader: str, topic: str
) -> list[str]:
    """Return the outcomes of a reader and of a writer."""
    libraries = chosen.root / 'lib' / f'{os.uname().machine}-linux-gnu'
    environment = {**os.environ, 'LD_LIBRARY_PATH': str(libraries)}
    running = [
        subprocess.Popen(  # noqa: S603 - no shell, own words
            [str(peer), folder, str(chosen.domain), kind, topic, str(SECONDS)],
            env=environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
        )
        for kind, folder in (('sub', reader), ('pub', writer))
    ]  # fmt: skip
    outputs = [process.communicate(timeout=60)[0].split() for process in running]
    # Fast DDS writes its log to the same stream.
    return [next((word for word in words if word in OUTCOMES), 'nothing') for words in outputs]


if __name__ == '__main__':
    sys.exit(main())
