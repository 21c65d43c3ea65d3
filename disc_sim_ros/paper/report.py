"""The report of all figures and statements, as Markdown and as HTML."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
import platform

from disc_sim_ros import __version__
from disc_sim_ros.paper import figure_files
from disc_sim_ros.paper.conditions import SHARES, percent
from disc_sim_ros.paper.figure_files import WrittenFigure
from disc_sim_ros.paper.statements import table
from disc_sim_ros.paper.statements.rule import DIFFERS, NOT_REPRODUCIBLE, REPRODUCED, TAKEN, Result
from disc_sim_ros.paper.style import DARK, LIGHT

CLOSE = 0.01  # m, allowed distance of the second integration
INTRODUCTION = (
    'Every figure of Crowther & Potts, Simulation of a spin-stabilised sports disc, Sports '
    'Engineering 10 (2007) 3-21, as disc_sim_ros computes it, compared with the paper.',
    'No coefficient was changed to reproduce a statement. Each flight is computed with the roll '
    'and pitch damping that the paper prints and with 10 % of it; every figure names the damping. '
    'Moment coefficients act in axes 3 (zero-sideslip body axes) unless a figure says axes 4. The '
    'figures use the constant-spin model, as the paper does. Corrections of printed equations are '
    'listed in docs/deviations.md.',
    'Launches are those that the legends print, in two readings without which the curves do not '
    'follow: "angle of attack 0" of Figs. 6c, d, 7 and 8 is the angle of no lift, with the '
    'printed pitch as that of the path; and "AdvR 0.5" of Figs. 6e to h and 9 is r c / V, 0.25 by '
    'eqn 63. '
    'Verdicts are computed, for each damping by itself: a number is reproduced if ours is within '
    'half a unit of its last printed digit, or within the tolerance that the table states with '
    'its reason. Statements in words are read as bounds on one side, which the table marks: they '
    'are weaker evidence.',
)
CHECK = (
    'One flight of each figure was integrated a second time in this run, with another formulation '
    "(vectors in earth axes, no quaternion) and another integrator (scipy's DOP853). Largest "
    'distance between both on the flight:'
)
THIRD = (
    'The tests have a third integration, in axes that spin with the disc, written from the paper '
    'alone: python -m pytest test/paper/test_reference_of_figures.py'
)
MARKS = {REPRODUCED: '✓', DIFFERS: '✗', NOT_REPRODUCIBLE: '?', TAKEN: '='}


@dataclass(frozen=True)
class Report:
    """The results of a run; `results` is None without the table of statements."""

    figures: tuple[WrittenFigure, ...]
    results: tuple[Result, ...] | None
    dark: bool

    def summary(self) -> list[str]:
        """Return the outcome, in sentences."""
        lines = []
        if self.results is not None:
            for share in reversed(SHARES):
                counts = table.tally(self.results, share)
                verdicts = ', '.join(f'{count} {verdict}' for verdict, count in counts.items())
                total, met = table.bounds(self.results, share)
                lines.append(
                    f'Of {len(self.results)} statements, {percent(share)}: {verdicts}; {met} of '
                    f'the reproduced are bounds on one side, of {total}.'
                )
        if self.figures:
            worst = max(figure.distance for figure in self.figures)
            within = 'within' if worst < CLOSE else 'NOT within'
            lines.append(
                f'A second, independent integration of {len(self.figures)} of the flights is '
                f'{within} 1 cm of them, at most {1e3 * worst:.2g} mm away.'
            )
        return lines

    def checks(self) -> list[tuple[str, ...]]:
        """Return the rows of the table of second integrations."""
        return [
            (
                figure.title.partition(':')[0],
                figure.example,
                f'{1e3 * figure.distance:.2g} mm',
                'within 1 cm' if figure.distance < CLOSE else 'NOT within 1 cm',
            )
            for figure in self.figures
        ]

    def made_with(self) -> str:
        """Return the versions that computed the report."""
        return f'disc_sim_ros {__version__}, Python {platform.python_version()}'


CHECK_HEADER = ('figure', 'flight', 'largest distance', 'verdict')


def markdown(report: Report) -> str:
    """Return the report as Markdown, with the light pictures."""
    lines = ['# The figures of Crowther & Potts (2007), flown again', '']
    for paragraph in (*INTRODUCTION, *report.summary()):
        lines += [paragraph, '']
    for figure in report.figures:
        lines += [f'## {figure.title}', '']
        shown = _pictures(figure)
        if shown:
            lines += [f'![{figure.title}]({shown[0]})', '']
        lines += [figure.conditions, '']
        lines += [f'- {finding}' for finding in figure.findings]
        lines += ['', 'Files: ' + ', '.join(f'[{name}]({name})' for name in figure.files), '']
    if report.figures:
        lines += ['## Second integration', '', CHECK, '']
        lines += [*_markdown_table(CHECK_HEADER, report.checks()), '', THIRD, '']
    if report.results is not None:
        lines += [
            '## Every statement with a number',
            '',
            'Also as [statements.csv](statements.csv).',
        ]
        lines += ['', *_markdown_table(table.HEADER, _marked(report.results)), '']
    return '\n'.join([*lines, report.made_with(), ''])


def html(report: Report) -> str:
    """Return the report as an HTML page; its pictures are files beside it."""
    body = ['<h1>The figures of Crowther &amp; Potts (2007), flown again</h1>']
    body += [f'<p>{escape(text)}</p>' for text in INTRODUCTION]
    body += [f'<p class="sum">{escape(text)}</p>' for text in report.summary()]
    links = [
        f'<a href="#{figure_files.stem(f.key)}">{escape(_short(f))}</a>' for f in report.figures
    ]
    links += ['<a href="#check">second integration</a>'] * bool(report.figures)
    links += ['<a href="#statements">statements</a>'] * (report.results is not None)
    body.append(f'<nav>{" · ".join(links)}</nav>')
    for figure in report.figures:
        body.append(_html_figure(figure, dark=report.dark))
    if report.figures:
        body.append(f'<h2 id="check">Second integration</h2><p>{escape(CHECK)}</p>')
        body.append(_html_table(CHECK_HEADER, report.checks()))
        body.append(f'<p>{escape(THIRD)}</p>')
    if report.results is not None:
        body.append('<h2 id="statements">Every statement with a number</h2>')
        body.append('<p>Also as <a href="statements.csv">statements.csv</a>.</p>')
        body.append(_html_table(table.HEADER, _marked(report.results)))
    body.append(f'<footer>{escape(report.made_with())}</footer>')
    return _PAGE.replace('BODY', '\n'.join(body))


def _short(figure: WrittenFigure) -> str:
    return figure.title.partition(':')[0]


def _pictures(figure: WrittenFigure) -> list[str]:
    """Return the names of the light pictures of a figure, PNG first."""
    names = [figure_files.picture(figure.key, kind, LIGHT) for kind in figure_files.FORMATS]
    return [name for name in names if name in figure.files]


def _html_figure(figure: WrittenFigure, *, dark: bool) -> str:
    pictures = _pictures(figure)
    title = escape(figure.title)
    parts = [f'<h2 id="{figure_files.stem(figure.key)}">{title}</h2>']
    if pictures:
        name = pictures[0]
        kind = name.rpartition('.')[2]
        source = ''
        if dark:
            other = figure_files.picture(figure.key, kind, DARK)
            source = f'<source srcset="{other}" media="(prefers-color-scheme: dark)">'
        parts.append(f'<picture>{source}<img src="{name}" alt="{title}" loading="lazy"></picture>')
    parts.append(f'<p class="conditions">{escape(figure.conditions)}</p><ul>')
    parts += [f'<li>{escape(finding)}</li>' for finding in figure.findings]
    links = ', '.join(f'<a href="{name}">{name}</a>' for name in figure.files)
    return '\n'.join([*parts, f'</ul><p class="files">{links}</p>'])


def _marked(results: Sequence[Result]) -> list[tuple[str, ...]]:
    rows = []
    for result in results:
        cells = list(table.cells(result))
        for column, verdict in zip(table.VERDICT_COLUMNS, result.verdicts, strict=True):
            cells[column] = f'{MARKS[verdict]} {verdict}'
        rows.append(tuple(cells))
    return rows


def _markdown_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    def line(cells: Sequence[str]) -> str:
        return '| ' + ' | '.join(cell.replace('|', '\\|') for cell in cells) + ' |'

    return [line(header), '|' + '---|' * len(header), *(line(row) for row in rows)]


def _html_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    classes = {mark: f'v{i}' for i, mark in enumerate(MARKS.values())}

    def line(cells: Sequence[str]) -> str:
        out = []
        for cell in cells:
            name = classes.get(cell[:1]) if cell[1:2] == ' ' else None
            kind = f' class="{name}"' if name else ''
            out.append(f'<td{kind}>{escape(cell)}</td>')
        return f'<tr>{"".join(out)}</tr>'

    head = ''.join(f'<th>{escape(cell)}</th>' for cell in header)
    body = '\n'.join(line(row) for row in rows)
    return f'<div class="wide"><table><tr>{head}</tr>\n{body}</table></div>'


_PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>Crowther &amp; Potts (2007), flown again</title>
<style>
:root { --face: #ffffff; --ink: #1a1a1a; --faint: #d0d0d0; --link: #0072b2; --good: #006e4f;
  --bad: #b34700; }
@media (prefers-color-scheme: dark) { :root { --face: #0d1117; --ink: #e8e8e8; --faint: #454b54;
  --link: #56b4e9; --good: #2fc79a; --bad: #e69f00; } }
body { background: var(--face); color: var(--ink); font: 16px/1.5 system-ui, sans-serif;
  max-width: 1060px; margin: 2em auto; padding: 0 1em; }
h2 { margin-top: 2.2em; border-top: 1px solid var(--faint); padding-top: 0.8em; }
a { color: var(--link); }
img { max-width: 100%; height: auto; }
.sum { font-weight: 600; }
.conditions { font-style: italic; }
.files, footer { font-size: 0.85em; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: 0.85em; }
th, td { border: 1px solid var(--faint); padding: 0.3em 0.5em; text-align: left;
  vertical-align: top; }
.v0 { color: var(--good); white-space: nowrap; }
.v1 { color: var(--bad); font-weight: 600; white-space: nowrap; }
.v2, .v3 { white-space: nowrap; }
</style>
</head>
<body>
BODY
</body>
</html>
"""
