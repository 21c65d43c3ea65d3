"""What several tests of the package read from its sources."""

import ast
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGE = 'disc_sim_ros'
ON_DEMAND = {'rviz2', 'robot_state_publisher'}  # started on request, not in package.xml


def executables() -> dict[str, str]:
    """Return the table EXECUTABLES of setup.py, read without running the file."""
    for node in ast.parse((ROOT / 'setup.py').read_text(encoding='utf-8')).body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == 'EXECUTABLES':
            return ast.literal_eval(node.value)
    raise AssertionError('setup.py has no table EXECUTABLES')
