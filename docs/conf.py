"""Settings of Sphinx for the documentation site: `make docs` builds it in build/docs.

Sphinx, because docs.ros.org uses it, it reads Google-style docstrings and Markdown, its releases
are regular, and the site works without a network.
"""

from importlib import metadata
import importlib.util
import os
import re
import sys
from types import FunctionType
from typing import Any

from sphinx.addnodes import pending_xref
from sphinx.transforms.post_transforms import ReferencesResolver, SphinxPostTransform

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
autodoc_use_type_comments = False  # there are none; to look for them means to parse each function
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


def skip_imported(app: Any, kind: str, *event: Any) -> bool | None:
    """Skip the functions and classes that a module imports.

    Sphinx would do the same after it had read the source of each, that of ROS and NumPy too, which
    took a fifth of the time of the build. It leaves those of `__all__` in, and so does this.
    """
    _, member, *_ = event
    if kind != 'module' or not isinstance(member, (type, FunctionType)):
        return None
    module = app.env.temp_data.get('autodoc:module')
    if hasattr(sys.modules[module], '__all__') or member.__module__ == module:
        return None
    return True


class ForeignNames(SphinxPostTransform):
    """Makes names in signatures that no object of this package has plain text, such as `float`.

    Sphinx would do the same after it had compared each with the names of all objects, which took
    half of the time of writing.
    """

    default_priority = ReferencesResolver.default_priority - 1

    def run(self, **_: Any) -> None:
        """Replace the references of one page."""
        objects = self.env.domains['py'].data['objects']
        if not hasattr(self.app, 'last_names'):
            self.app.last_names = {name.rpartition('.')[2] for name in objects}
        for node in list(self.document.findall(pending_xref)):
            name = node.get('reftarget', '').rpartition('.')[2]
            if node.get('refdomain') == 'py' and name not in self.app.last_names:
                node.replace_self(node.children)


def setup(app: Any) -> None:
    """Treat docstrings as plain text, before napoleon reads their sections."""
    app.connect('autodoc-process-docstring', escape_markup, priority=400)
    app.connect('autodoc-skip-member', skip_imported)
    app.add_post_transform(ForeignNames)
