"""The version, the changelog, the citation and the pre-commit hooks agree with the package."""

from pathlib import Path
import re
import warnings
import xml.etree.ElementTree as ET

import pytest
import yaml

from disc_sim_ros import __version__

ROOT = Path(__file__).parents[2]
CITATION = yaml.safe_load((ROOT / 'CITATION.cff').read_text(encoding='utf-8'))


def test_the_changelog_begins_with_this_version():
    changelog = pytest.importorskip('catkin_pkg.changelog')
    with warnings.catch_warnings():
        warnings.simplefilter('ignore', DeprecationWarning)  # of docutils, in catkin_pkg
        log = changelog.get_changelog_from_path(str(ROOT), package_name='disc_sim_ros')
    versions = [version for version, _, _ in log.foreach_version(reverse=True)]
    assert versions == sorted(versions, key=lambda v: [int(n) for n in v.split('.')], reverse=True)
    assert versions[0] == __version__
    assert '0.1.0' in versions


def test_package_xml_and_the_citation_have_this_version():
    assert ET.parse(ROOT / 'package.xml').findtext('version') == __version__
    assert CITATION['version'] == __version__


def test_the_citation_has_what_the_format_requires():
    assert CITATION.keys() >= {'cff-version', 'message', 'title', 'authors'}
    assert CITATION['license'] == 'Apache-2.0'
    assert CITATION['references'][0]['title'] == 'Simulation of a spin-stabilised sports disc'


def test_pre_commit_runs_the_checks_of_make_lint():
    config = yaml.safe_load((ROOT / '.pre-commit-config.yaml').read_text(encoding='utf-8'))
    hooks = [hook for repo in config['repos'] for hook in repo['hooks']]
    makefile = (ROOT / 'Makefile').read_text(encoding='utf-8')
    (checks,) = re.findall(r'^lint: .*\n\t@tools/check (.*)$', makefile, re.MULTILINE)
    assert [hook['entry'] for hook in hooks] == [
        f'tools/check {check}' for check in checks.split()
    ]
    assert {hook['language'] for hook in hooks} == {'system'}  # versions of .venv


def test_ci_runs_the_two_commands_with_chromium_and_nothing_else():
    lines = (ROOT / '.ci/run').read_text(encoding='utf-8').splitlines()
    start = ['set -euo pipefail', 'cd "$(dirname "$0")/.."']
    # Chromium is a program of the system, which a virtual environment cannot have.
    assert lines[1:] == [*start, 'tools/install-chromium', 'CI=true make fly', 'make test']


@pytest.mark.parametrize('file', sorted((ROOT / '.github/ISSUE_TEMPLATE').glob('*.yml')))
def test_issue_templates_have_fields_with_labels(file):
    template = yaml.safe_load(file.read_text(encoding='utf-8'))
    if file.name == 'config.yml':
        return
    fields = [field for field in template['body'] if field['type'] != 'markdown']
    assert template['name']
    assert template['description']
    assert all(field['attributes']['label'] for field in fields)
    assert len({field['id'] for field in fields}) == len(fields) > 1


def test_the_workflow_builds_each_distribution_that_the_page_names():
    """Only read here: it runs where industrial_ci does."""
    text = (ROOT / '.github/workflows/ros.yml').read_text(encoding='utf-8')
    job = yaml.safe_load(text)['jobs']['industrial_ci']
    page = (ROOT / 'docs/release.md').read_text(encoding='utf-8')
    named = re.search(r'by industrial_ci on (\w+), (\w+) and (\w+)', page)
    assert named is not None
    assert job['strategy']['matrix']['ros_distro'] == [name.lower() for name in named.groups()]
    assert job['env']['ROS_DISTRO'] == '${{ matrix.ros_distro }}'
    assert any('industrial_ci' in step['uses'] for step in job['steps'])
