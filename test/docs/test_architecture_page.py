"""docs/architecture.md shows the real packages, imports, files and names."""

import ast
from pathlib import Path
import re
import tomllib
import xml.etree.ElementTree as ET

import grimp
import pytest

ROOT = Path(__file__).parents[2]
PACKAGE = 'disc_sim_ros'
PAGE = (ROOT / 'docs/architecture.md').read_text(encoding='utf-8')
DOT = (ROOT / 'docs/architecture.dot').read_text(encoding='utf-8')
SVG = ROOT / 'docs/architecture.svg'
KERNELS, ROOT_MODULES = 'physics.kernels', 'root'
Edge = tuple[str, str]


# ---- diagram ----


def drawn_boxes(dot: str) -> dict[str, str]:
    """Return the labels of the boxes by name."""
    return dict(re.findall(r'^ *"([\w.]+)" \[label="([^"]*)"', dot, re.MULTILINE))


def drawn_edges(dot: str) -> set[Edge]:
    return set(re.findall(r'^ *"([\w.]+)" -> "([\w.]+)";', dot, re.MULTILINE))


@pytest.fixture(scope='module')
def graph() -> grimp.ImportGraph:
    return grimp.build_graph(PACKAGE, cache_dir=None)


def folders(graph: grimp.ImportGraph) -> set[str]:
    """Return the names of the packages directly below the root package."""
    children = graph.find_children(PACKAGE)
    return {c.rpartition('.')[2] for c in children if graph.find_children(c)}


def imports(graph: grimp.ImportGraph) -> set[Edge]:
    """Return the imports between boxes: packages, the kernels, and the modules of the root."""
    packages = folders(graph)

    def box(module: str) -> str:
        name = module.removeprefix(f'{PACKAGE}.')
        if f'{name}.'.startswith(f'{KERNELS}.'):
            return KERNELS
        return first if (first := name.split('.')[0]) in packages else ROOT_MODULES

    modules = graph.modules - {PACKAGE}  # the public API imports lazily from every package
    edges = {
        (box(module), box(other))
        for module in modules
        for other in graph.find_modules_directly_imported_by(module) - {PACKAGE}
    }
    return {(a, b) for a, b in edges if a != b}


def reachable(edges: set[Edge], start: str) -> set[str]:
    reached, waiting = set(), [start]
    while waiting:
        name = waiting.pop()
        new = {b for a, b in edges if a == name} - reached
        reached |= new
        waiting += new
    return reached


def without_implied(edges: set[Edge]) -> set[Edge]:
    """Return the edges that do not follow from others."""
    return {(a, b) for a, b in edges if b not in reachable(edges - {(a, b)}, a)}


def test_the_boxes_are_the_packages(graph):
    assert set(drawn_boxes(DOT)) == folders(graph) | {KERNELS, ROOT_MODULES}


def test_the_box_of_the_root_modules_lists_real_modules(graph):
    names = re.findall(r'\w+', drawn_boxes(DOT)[ROOT_MODULES].partition('\\n')[2])
    assert {f'{PACKAGE}.{name}' for name in names} <= graph.modules


def test_the_arrows_are_the_imports(graph):
    assert drawn_edges(DOT) == without_implied(imports(graph))


def test_the_arrows_go_down_the_layers_of_import_linter():
    settings = tomllib.loads((ROOT / 'pyproject.toml').read_text(encoding='utf-8'))
    (contract,) = [
        c for c in settings['tool']['importlinter']['contracts'] if c['type'] == 'layers'
    ]
    layer = {
        name.strip().removeprefix(f'{PACKAGE}.'): depth
        for depth, names in enumerate(contract['layers'])
        for name in names.split('|')
    }
    packages = set(drawn_boxes(DOT)) - {KERNELS, ROOT_MODULES}
    assert packages <= set(layer)
    lowest = max(layer[name] for name in packages)
    depth = {name: layer[name] for name in packages}
    depth |= {KERNELS: lowest + 0.5, ROOT_MODULES: lowest + 1}
    assert [(a, b) for a, b in drawn_edges(DOT) if depth[a] >= depth[b]] == []


def test_a_wrong_arrow_is_noticed(graph):
    real = without_implied(imports(graph))
    assert drawn_edges(DOT.replace('"bags" -> "root";', '')) != real
    assert drawn_edges(f'{DOT}\n"physics" -> "bags";\n') != real
    assert without_implied({('a', 'b'), ('b', 'c'), ('a', 'c')}) == {('a', 'b'), ('b', 'c')}


def in_drawing(kind: str) -> dict[str, list[str]]:
    """Return the lines of text of each node or edge of the drawing, by its title."""
    space = '{http://www.w3.org/2000/svg}'
    return {
        group.findtext(f'{space}title'): [text.text for text in group.iter(f'{space}text')]
        for group in ET.parse(SVG).getroot().iter(f'{space}g')
        if group.get('class') == kind
    }


def test_the_drawing_belongs_to_its_text():
    boxes = {name: label.split('\\n') for name, label in drawn_boxes(DOT).items()}
    assert in_drawing('node') == boxes, 'draw it again, see docs/architecture.md'
    assert set(in_drawing('edge')) == {f'{a}->{b}' for a, b in drawn_edges(DOT)}


# ---- tables ----


def rows() -> list[tuple[str, str]]:
    steps = re.findall(r'^\| `([\w/.]+\.py)` \| (.*) \|$', PAGE, re.MULTILINE)
    assert len(steps) > 25
    return steps


def test_every_file_exists():
    named = [file for file, _ in rows()] + re.findall(r'`((?:\w+/)+\w+\.py)`', PAGE)
    places = (ROOT, ROOT / PACKAGE)
    assert [f for f in named if not any((place / f).is_file() for place in places)] == []


def names_in(text: str) -> list[str]:
    """Return the code names of a step: `Class`, `Class.method` or `function`, before the colon."""
    return re.findall(r'`([A-Za-z_]\w*(?:\.\w+)?)`', re.split(r'[:;,]|\bcalls\b', text)[0])


@pytest.mark.parametrize(('file', 'step'), rows())
def test_every_step_names_something_of_its_file(file, step):
    (name, *_) = names_in(step)
    source = (ROOT / PACKAGE / file).read_text(encoding='utf-8')
    assert defines(source, name), f'{file} has no {name}'


def defines(source: str, name: str) -> bool:
    """Return True if a source defines a class, a member of it, a function or a constant."""
    first, _, member = name.partition('.')
    for node in ast.parse(source).body:
        match node:
            case ast.ClassDef(name=defined) if defined == first:
                return not member or member in members(node)
            case ast.FunctionDef(name=defined) if defined == first:
                return not member
            case ast.Assign(targets=[ast.Name(id=defined)]) if defined == first:
                return not member
            case ast.AnnAssign(target=ast.Name(id=defined)) if defined == first:
                return not member
    return False


def members(cls: ast.ClassDef) -> set[str]:
    """Return the names of methods and of attributes that methods assign to `self`."""
    nodes = list(ast.walk(cls))
    methods = {n.name for n in nodes if isinstance(n, ast.FunctionDef)}
    return methods | {
        n.attr for n in nodes if isinstance(n, ast.Attribute) and isinstance(n.ctx, ast.Store)
    }


def test_a_name_that_is_not_there_is_noticed():
    source = 'X: int = 1\n\n\nclass A:\n    def f(self): self.take = 1\n\n\ndef g(): ...\n'
    assert all(defines(source, name) for name in ('X', 'A', 'A.f', 'A.take', 'g'))
    assert not any(defines(source, name) for name in ('Y', 'A.g', 'f', 'B.f', 'g.f'))
