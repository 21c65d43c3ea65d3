"""Settings of Sphinx for the documentation site: `make docs` builds it in build/docs.

Sphinx, because docs.ros.org uses it, it reads Google-style docstrings and Markdown, its releases
are regular, and the site works without a network.
"""

from importlib import metadata
import importlib.util
import os
import re
from typing import Any

os.environ['NUMBA_DISABLE_JIT'] = '1'  # compiled functions would hide their docstrings

project = 'disc_sim_ros'
author = 'disc_sim_ros maintainers'
version = release = metadata.version(project)

extensions = [
    'myst_parser',  # the pages are Markdown
    'sphinx.ext.apidoc',  # one page a module ...
    'sphinx.ext.autodoc',  # ... from its docstrings,
    'sphinx.ext.napoleon',  # which have the Google style
    'sphinx.ext.viewcode',
]
source_suffix = {'.md': 'markdown', '.rst': 'restructuredtext'}
exclude_patterns = ['api/modules.rst']  # api/disc_sim_ros.rst is the start of the reference
default_role = 'code'  # docstrings have single backticks, as Markdown does

html_theme = 'furo'  # its fonts and scripts are local files: the site needs no network
html_title = f'{project} {release}'
html_copy_source = False
html_show_copyright = False

myst_heading_anchors = 4

# Not the programs, whose interface is their --help, nor the figures of the paper. The nodes can be
# imported only if ROS is installed.
_LEFT_OUT = ['cli', 'paper'] if importlib.util.find_spec('rclpy') else ['cli', 'paper', 'ros']
apidoc_modules = [
    {
        'path': '../disc_sim_ros',
        'destination': 'api',
        'separate_modules': True,
        'module_first': True,
        'exclude_patterns': [f'../disc_sim_ros/{name}' for name in _LEFT_OUT],
    }
]
autodoc_member_order = 'bysource'
toc_object_entries = False
napoleon_numpy_docstring = False
napoleon_use_ivar = True
# Sphinx takes the words `type` and `shape` in docstrings for names of attributes.
suppress_warnings = ['ref.python']


def escape_markup(*event: Any) -> None:
    """Escape characters outside backticks that are markup in reStructuredText, such as |x|."""
    lines: list[str] = event[-1]
    parts = '\n'.join(lines).split('`')
    parts[::2] = (re.sub(r'[\\|*]|_(?=\W|$)', r'\\\g<0>', part) for part in parts[::2])
    lines[:] = '`'.join(parts).split('\n')


def setup(app: Any) -> None:
    """Treat docstrings as plain text, before napoleon reads their sections."""
    app.connect('autodoc-process-docstring', escape_markup, priority=400)
