#!/usr/bin/env python3
"""Try the keystore with the security plugins of Fast DDS: who is heard, who is refused.

    apt-get install g++ libfastrtps-dev openssl      # Debian 12, Ubuntu 24.04 or ROS's own
    security/fast_dds/check.py [--root /usr] [--domain 77]

The ROS 2 wheels on PyPI have Fast DDS without these plugins; Debian's package has them. `peer.cpp`
sets them up as rmw_fastrtps does. Exit code 1 where an answer is not the expected one.
"""

import argparse
import os
from pathlib import Path
import shutil
import subprocess
import sys
import tempfile

HERE = Path(__file__).parent
MAKE = HERE.parent / 'make_keystore.py'
SECONDS = 5.0  # to meet: a handshake takes about one
OUTCOMES = HEARD, MATCHED, UNMATCHED, REFUSED = 'heard', 'matched', 'unmatched', 'refused'

# Who writes, who reads, on which topic of DDS, and what becomes of reader and writer.
CASES = (
    ('controller', 'sim_node', 'rt/cmd_moment', HEARD, MATCHED),
    ('controller', 'sim_node', 'rt/cmd_coefficients', HEARD, MATCHED),
    ('operator', 'sim_node', 'rt/throw', HEARD, MATCHED),
    ('operator', 'sim_node', 'rq/sim_node/resetRequest', HEARD, MATCHED),
    ('sim_node', 'viewer', 'rt/odom', HEARD, MATCHED),
    ('sim_node', 'recorder_node', 'rt/odom', HEARD, MATCHED),
    ('controller', 'recorder_node', 'rt/cmd_moment', HEARD, MATCHED),
    # Their own permissions forbid it.
    ('viewer', 'sim_node', 'rt/cmd_moment', UNMATCHED, REFUSED),
    ('recorder_node', 'sim_node', 'rt/cmd_moment', UNMATCHED, REFUSED),
    ('controller', 'sim_node', 'rt/throw', UNMATCHED, REFUSED),
    ('controller', 'sim_node', 'rq/sim_node/resetRequest', UNMATCHED, REFUSED),
    ('controller', 'sim_node', 'rq/sim_node/set_parametersRequest', UNMATCHED, REFUSED),
    # Who has no certificate, or made one for himself that allows everything.
    ('none', 'sim_node', 'rt/cmd_moment', UNMATCHED, UNMATCHED),
    ('sim_node', 'none', 'rt/odom', UNMATCHED, UNMATCHED),
    ('foreign/controller', 'sim_node', 'rt/cmd_moment', UNMATCHED, UNMATCHED),
    # The viewer's true identity, with permissions that he signed himself.
    ('usurper', 'sim_node', 'rt/cmd_moment', UNMATCHED, UNMATCHED),
    # A permission that was edited, and one of another enclave.
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
            found = _pair(peer, chosen, enclaves[writer], enclaves[reader], topic)
            good = found == expected
            wrong += not good
            sys.stdout.write(
                f'{"ok   " if good else "WRONG"} {writer:19} to {reader:13} on {topic:34} '
                f'reader {found[0]}, writer {found[1]}\n'
            )
            sys.stdout.flush()
    sys.stdout.write(f'{len(CASES) - wrong} of {len(CASES)} as they should be\n')
    return int(wrong > 0)


def _compiled(peer: Path, root: Path) -> Path:
    """Compile the peer; end the program where that fails."""
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
    controller = (HERE.parent / 'policies' / 'controller.xml').read_text()
    grand.write_text(controller.replace('/disc_sim/controller', '/disc_sim/viewer'))
    for name, policies in (('keystore', ()), ('foreign', ()), ('grand', (str(grand),))):
        command = [
            sys.executable,
            str(MAKE),
            str(place / name),
            *policies,
            '--domain',
            str(domain),
        ]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)  # noqa: S603 - own words
    own = place / 'keystore' / 'enclaves' / 'disc_sim'
    found = {folder.name: str(folder) for folder in own.iterdir()}
    found['none'] = 'none'
    found['foreign/controller'] = str(place / 'foreign' / 'enclaves' / 'disc_sim' / 'controller')
    for name in ('forged', 'borrowed', 'usurper'):
        shutil.copytree(own / 'viewer', own / name)  # follows the links
        found[name] = str(own / name)
    permissions = own / 'forged' / 'permissions.p7s'
    text = permissions.read_text().replace('rt/rosout', 'rt/cmd_moment')
    permissions.write_text(text)
    shutil.copy(own / 'controller' / 'permissions.p7s', own / 'borrowed' / 'permissions.p7s')
    for name in ('permissions_ca.cert.pem', 'governance.p7s', 'permissions.p7s'):
        shutil.copy(place / 'grand' / 'enclaves' / 'disc_sim' / 'viewer' / name, own / 'usurper')
    return found


def _pair(
    peer: Path, chosen: argparse.Namespace, writer: str, reader: str, topic: str
) -> list[str]:
    """Return what became of a reader and of a writer."""
    libraries = chosen.root / 'lib' / f'{os.uname().machine}-linux-gnu'
    environment = {**os.environ, 'LD_LIBRARY_PATH': str(libraries)}
    running = [
        subprocess.Popen(  # noqa: S603 - no shell, own words
            [str(peer), folder, str(chosen.domain), kind, topic, str(SECONDS)],
            env=environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
        )
        for kind, folder in (('sub', reader), ('pub', writer))
    ]  # fmt: skip
    said = [process.communicate(timeout=60)[0].split() for process in running]
    # Fast DDS writes what it logs on the same stream.
    return [next((word for word in words if word in OUTCOMES), 'nothing') for words in said]


if __name__ == '__main__':
    sys.exit(main())
