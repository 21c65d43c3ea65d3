"""package.xml names the packages that the code imports and that the launch files start."""

import ast
import re
import sys
import xml.etree.ElementTree as ET

from package.sources import ON_DEMAND, PACKAGE, ROOT


def imported(folder: str) -> set[str]:
    """Return the top-level names that the Python files of a folder import."""
    names = set()
    for path in (ROOT / folder).rglob('*.py'):
        for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
            if isinstance(node, ast.Import):
                names |= {alias.name.partition('.')[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                names.add(node.module.partition('.')[0])
    return names


# The rosdep keys of packages whose key is not the name that Python imports.
KEYS = dict.fromkeys(
    ('diagnostic_msgs', 'geometry_msgs', 'nav_msgs', 'sensor_msgs', 'std_msgs', 'std_srvs'),
    'common_interfaces',
) | {'visualization_msgs': 'common_interfaces', 'yaml': 'python3-yaml'}
KEYS |= {
    name: f'python3-{name}'
    for name in (
        'distributed',
        'llvmlite',
        'lz4',
        'matplotlib',
        'numba',
        'numpy',
        'pyarrow',
        'scipy',
        'zstandard',
    )
} | {
    'mcap': 'python3-mcap-pip',
    'mcap_ros2': 'python3-mcap-ros2-support-pip',
    'PIL': 'python3-pil',
}
STARTED = {'ros2launch', 'ros2service'}  # by launch files, or to start them


def test_package_xml_names_what_is_imported_and_started():
    package = ET.parse(ROOT / 'package.xml')
    named = {depend.text for depend in package.iter('exec_depend')}
    assert named == {KEYS.get(name, name) for name in imported_from_others()} | STARTED
    assert not named & ON_DEMAND


def imported_from_others() -> set[str]:
    """Return the imports of the package and its launch files, without the standard library."""
    both = imported(PACKAGE) | imported('launch')
    return both - set(sys.stdlib_module_names) - {PACKAGE}


def test_the_launch_files_call_only_commands_of_package_xml():
    text = (ROOT / 'launch/sim_and_recorder.launch.py').read_text(encoding='utf-8')
    assert set(re.findall(r"'ros2', '(\w+)'", text)) == {'service'}
