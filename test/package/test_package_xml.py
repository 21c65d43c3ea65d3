"""package.xml names the packages that the code imports and that the launch files start."""

import ast
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
        'matplotlib',
        'numpy',
        'scipy',
    )
} | {'PIL': 'python3-pil', 'trimesh': 'python3-trimesh-pip'}
# rosdep has no keys for the others that mcap-ros2-support brings along.
KEYS |= dict.fromkeys(('mcap', 'mcap_ros2', 'lz4', 'zstandard'), 'mcap-ros2-support')
# Not in rosdep, or not in Ubuntu 24.04; or part of newer distributions only.
OPTIONAL = {
    'distributed',
    'gymnasium',
    'llvmlite',
    'numba',
    'pyarrow',
    'simulation_interfaces',
    'websockets',
}
STARTED = {'ros2launch'}


def test_package_xml_names_what_is_imported_and_started():
    package = ET.parse(ROOT / 'package.xml')
    named = {depend.text for depend in package.iter('exec_depend')}
    imports = imported_from_others()
    assert named == {KEYS.get(name, name) for name in imports - OPTIONAL} | STARTED
    assert not named & ON_DEMAND


def test_rosdep_knows_every_key_of_package_xml():
    lines = (ROOT / 'test/package/rosdep_keys.txt').read_text(encoding='utf-8').splitlines()
    known = {line.split()[0] for line in lines if not line.startswith('#')}
    package = ET.parse(ROOT / 'package.xml')
    kinds = ('exec_depend', 'test_depend', 'depend', 'build_depend', 'buildtool_depend')
    assert {depend.text for kind in kinds for depend in package.iter(kind)} == known


def imported_from_others() -> set[str]:
    """Return the imports of the package and its launch files, without the standard library."""
    both = imported(PACKAGE) | imported('launch')
    return both - set(sys.stdlib_module_names) - {PACKAGE}
