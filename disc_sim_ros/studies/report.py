"""The summary of a study as text and as a JSON document."""

import math
from typing import Any

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.studies.columns import WIND, quantity
from disc_sim_ros.studies.scatter import Normal
from disc_sim_ros.studies.study import Study, study_document
from disc_sim_ros.studies.summary import ELLIPSES, MAIN_RESULTS, Ellipse, Summary
from disc_sim_ros.units import METRIC, System

_ONE = {'degrees': 'degree'}
_SHOWN = ('range_m', 'drift_m', 'time_s', 'apex_m')


def summary_text(summary: Summary, system: System = METRIC) -> str:
    """Return a summary as text that fits on one screen."""
    lines = [headline(summary)]
    lines += _spread_lines(summary, system)
    study = summary.study
    if study.count > 1 and not study.vary and summary.ellipse is not None:
        lines += _ellipse_lines(summary.ellipse, system)
    for best in summary.best:
        what = {'range_m': 'furthest', 'time_s': 'longest'}[best.result]
        where = ', '.join(_value(name, value, system) for name, value in best.values.items())
        unit = best.result.rpartition('_')[2]
        sd = f', sd {system.number(best.sd, unit):.2f}' if study.count > 1 else ''
        lines.append(f'  {what:9}{system.text(best.mean, unit)}{sd} at {where}')
    lines += _sensitivity_lines(summary, system)
    return '\n'.join(lines)


def headline(summary: Summary) -> str:
    """Return one line: the disc, the number of flights, and how they ended."""
    study, counts = summary.study, summary.counts
    design = []
    if study.vary:
        sizes = ' x '.join(str(n) for n in study.shape)
        design.append(f'grid of {sizes} points' if len(study.shape) > 1 else f'{sizes} points')
    if study.count > 1:
        design.append(f'{study.count} samples{" each" if study.vary else ""}')
    words = {'landed': 'landed', 'flying': 'still in the air', 'lost': 'lost'}
    ends = [f'{counts[status]} {text}' for status, text in words.items() if counts[status]]
    flights = f'{study.setup.disc.name}: {study.size} flights ({", ".join(design)})'
    return f'{flights}: {", ".join(ends)}'


def study_text(study: Study, system: System = METRIC) -> str:
    """Return one line: the quantities that differ from flight to flight, and the wind."""
    parts = []

    def add(name: str, *values: float, form: str) -> None:
        q = quantity('name', name)
        numbers = form.format(*(system.number(value, q.short_unit) for value in values))
        text = f'{q.name.replace("_", " ")} {numbers} {system.unit(q.short_unit)}'
        parts.append(text.rstrip().replace(' °', '°'))

    for name, values in study.vary.items():
        law = study.scatter.get(name)
        if isinstance(law, Normal):
            add(name, values[0], values[-1], law.sd, form='{:.4g} to {:.4g}, each ± {:.4g}')
        else:
            add(name, values[0], values[-1], form='{:.4g} to {:.4g}')
    for name, law in study.scatter.items():
        if not isinstance(law, Normal):
            add(name, law.low, law.high, form='{:.4g} to {:.4g}')
        elif name not in study.vary:
            add(name, _mean(study, name, law), law.sd, form='{:.4g} ± {:.4g}')
    wind = [system.number(study.fixed(name), 'm/s') + 0.0 for name in WIND]
    if any(wind):
        parts.append('wind {:.4g} {:.4g} {:.4g} '.format(*wind) + system.speed)
    if study.setup.wind.turbulence:
        parts.append(f'gusts of {system.text(study.setup.wind.turbulence, "m/s", ".4g")}')
    return '; '.join(parts)


def summary_document(summary: Summary) -> dict[str, Any]:
    """Return a summary as values for JSON; keys carry units."""
    ellipse = summary.ellipse
    return {
        'question': study_document(summary.study),  # keys are as in 0.1: programs read them
        'flights': summary.study.size,
        'counts': summary.counts,
        'results': {
            name: {
                'mean': s.mean,
                'sd': s.sd,
                'least': s.least,
                'greatest': s.greatest,
                'percentiles': {f'{p:g}': value for p, value in s.percentiles.items()},
            }
            for name, s in summary.spreads.items()
        },
        'landing_ellipse': None if ellipse is None else _ellipse_document(ellipse),
        'best': [
            {'of': b.result, 'at': columns_of(b.values), 'mean': b.mean, 'sd': b.sd}
            for b in summary.best
        ],
        'sensitivities': [
            {
                'quantity': s.quantity,
                'answer': s.result,
                'slope': s.slope,
                'correlation': s.correlation,
                'first_order': s.first_order,
            }
            for s in summary.sensitivities
        ],
        'explained_by_regression': summary.explained,
    }


def columns_of(values: dict[str, float]) -> dict[str, float]:
    """Return values under the column names of their quantities, which carry units."""
    return {quantity('name', name).key: value for name, value in values.items()}


def _spread_lines(summary: Summary, system: System) -> list[str]:
    if not summary.spreads:
        return ['  no flight ended as expected; try a longer --duration or a shorter --step']
    lines = ['                 mean       sd       5%      50%      95%    least greatest']
    for name in _SHOWN:
        s = summary.spreads[name]
        quantity_name, _, unit = name.rpartition('_')
        numbers = (s.mean, s.sd, *(s.percentiles[p] for p in (5.0, 50.0, 95.0)), s.least,
                   s.greatest)  # fmt: skip
        text = ''.join(f' {system.number(x, unit):8.2f}' for x in numbers)
        lines.append(f'  {quantity_name:7}{system.unit(unit):>3}{text}')
    return lines


def _ellipse_lines(ellipse: Ellipse, system: System) -> list[str]:
    x, y = (system.number(value, 'm') for value in ellipse.centre)
    angle = ellipse.semi_axes(50)[2]
    side = 'left' if angle >= 0.0 else 'right'
    lines = [
        f'  landings around x {x:.2f}, y {y:.2f} {system.length}; ellipses of a normal law, '
        f'long axis {abs(angle):.0f} degrees {side} of x'
    ]
    for percent in ELLIPSES:
        long, short = (system.number(axis, 'm') for axis in ellipse.semi_axes(percent)[:2])
        lines.append(
            f'    {percent}%: semi-axes {long:.2f} and {short:.2f} {system.length}, '
            f'{ellipse.inside[percent]:.1%} of the landings inside'
        )
    return lines


def _sensitivity_lines(summary: Summary, system: System) -> list[str]:
    if not summary.sensitivities:
        return []
    lines = []
    for result in MAIN_RESULTS:
        rows = [s for s in summary.sensitivities if s.result == result]
        if not rows:
            continue
        name, _, unit = result.rpartition('_')
        rows.sort(key=lambda s: -abs(s.correlation))
        share = '' if rows[0].first_order is None else '; share: first-order Sobol index'
        explained = summary.explained[result]
        lines.append(f'  {name} depends on (linear regression, R^2 {explained:.2f}{share})')
        for s in rows[:8]:
            q = quantity('name', s.quantity)
            per_what = system.unit(q.unit)
            per = f'{system.unit(unit)} per {_ONE.get(per_what, per_what) or "1"}'
            per_unit = system.number(s.slope, unit) / system.number(1.0, q.unit)
            share = '' if s.first_order is None else f', share {s.first_order:6.1%}'
            slope = f'{s.quantity:18}{per_unit:+11.4g} {per:16}'
            lines.append(f'    {slope} {s.correlation:+.2f} sd per sd{share}')
    return lines


def _ellipse_document(ellipse: Ellipse) -> dict[str, Any]:
    document: dict[str, Any] = {
        'centre_m': list(ellipse.centre),
        'covariance_m2': _listed(ellipse.covariance),
    }
    for percent in ELLIPSES:
        long, short, angle = ellipse.semi_axes(percent)
        document[f'{percent}%'] = {
            'semi_axes_m': [long, short],
            'angle_left_of_x_deg': angle,
            'landings_inside': ellipse.inside[percent],
        }
    return document


def _listed(matrix: FloatArray) -> list[list[float]]:
    rows: list[list[float]] = matrix.tolist()
    return rows


def _value(name: str, value: float, system: System) -> str:
    return f'{name} {system.text(value, quantity("name", name).unit, ".6g")}'.rstrip()


def _mean(study: Study, name: str, law: Normal) -> float:
    mean = study.fixed(name) if law.mean is None else law.mean
    return 0.0 if math.isclose(mean, 0.0, abs_tol=1e-300) else mean
