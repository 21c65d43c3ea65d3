"""The roll-rate law: eqn 64 as printed, corrected and simulated, and eqn 54 along Fig. 5."""

from dataclasses import dataclass
import math
import sys

from matplotlib.figure import Figure
import numpy as np

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.paper import conditions, figure_files, style
from disc_sim_ros.paper.conditions import Curve
from disc_sim_ros.paper.fig05_typical_flight import DURATION, LAUNCH
from disc_sim_ros.paper.fig10_similarity import ALPHA, GRAVITY, SPEED, plate
from disc_sim_ros.paper.figure_files import PaperFigure
from disc_sim_ros.physics import theory
from disc_sim_ros.physics.flight import Setup, fly
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.physics.trajectory import Trajectory

TITLE = 'Roll rate: eqns 54 and 64 as printed, corrected and simulated'
CONDITIONS = (
    'a: flat plate of Fig. 10, exact model, no damping, mean over the first nutation. b: throw of '
    'Fig. 5, exact model, table aerodynamics, 10 % damping.\nMoments in axes 3 (body) in both.'
)
RATIOS = np.geomspace(0.7, 3.8, 12)
SAMPLES = 200  # per nutation


@dataclass(frozen=True)
class Data:
    """Roll rates from the laws and from the simulation.

    Attributes:
        printed: 8 k_n / AdvR at `RATIOS` [1].
        corrected: 4 k_n / AdvR [1].
        simulated: p V / g of the exact model, mean over the first nutation [1].
        flight: The throw of Fig. 5.
    """

    printed: FloatArray
    corrected: FloatArray
    simulated: FloatArray
    flight: Curve


def nutation(ratio: float, model: str = 'exact') -> Trajectory:
    """Fly the plate of Fig. 10 over its first nutation; I_z / I_x = 2."""
    disc = plate()
    spin = theory.spin_rate(ratio, disc.diameter, SPEED)
    duration = math.pi / spin
    flight = fly(
        Launch(speed=SPEED, pitch=0.0, angle_of_attack=ALPHA, spin=spin),
        Setup(disc=disc, model=model, step=duration / SAMPLES),
        duration=duration,
        ground=False,
        sample_rate=SAMPLES / duration,
    )
    return flight.trajectory


def compute() -> Data:
    """Fly the plate at all advance ratios, and the throw of Fig. 5."""
    k_n = theory.static_margin(plate())
    rates = [nutation(float(ratio)).rates[:-1, 0].mean() for ratio in RATIOS]
    flight = conditions.flown(LAUNCH, conditions.TENTH, duration=DURATION, model='exact')
    return Data(
        theory.printed_roll_rate_law(k_n, RATIOS),
        theory.roll_rate_law(k_n, RATIOS),
        theory.dimensionless_roll_rate(rates, SPEED, GRAVITY),
        Curve('Fig. 5, exact, 10 % damping', conditions.TENTH, flight),
    )


def roll_rate(t: Trajectory) -> FloatArray:
    """Return the roll rate about x of axes 3 [rad/s]."""
    u, v, _ = t.air_velocity.T
    rate: FloatArray = (t.rates[:, 0] * u + t.rates[:, 1] * v) / np.hypot(u, v)
    return rate


def law_54(t: Trajectory) -> FloatArray:
    """Return -M / (r I_z) along a flight of the paper's disc, M the steady moment [rad/s]."""
    disc = conditions.frisbee()
    if disc.table is None:
        raise ValueError('the disc frisbee needs a table')
    C_M = np.interp(t.alpha, disc.table.alpha, disc.table.coefficients[:, 2])
    M = 0.5 * 1.225 * t.airspeed**2 * disc.area * disc.diameter * C_M
    return theory.precession_roll_rate(M, t.spin, disc.inertia_axial)


@style.styled
def plot(data: Data, look: style.Look = style.LIGHT) -> Figure:
    """Draw the law against the advance ratio, and the roll rate along the throw of Fig. 5."""
    figure = style.sheet(4.9, TITLE, CONDITIONS)
    law, along = figure.subplots(1, 2)
    dashed = (0, (4, 1.6))
    law.plot(RATIOS, -data.printed, color=look.tenth, ls=dashed, label='printed, 8 k_n / AdvR')
    law.plot(RATIOS, -data.corrected, color=look.printed, label='corrected, 4 k_n / AdvR')
    law.plot(RATIOS, -data.simulated, 'o', color=look.ink, label='simulated')
    law.set(xlabel='advance ratio', ylabel='−p V / g', xscale='log', yscale='log')
    law.set_xticks([0.7, 1, 2, 3.5], ['0.7', '1', '2', '3.5'])
    law.set_yticks([0.1, 0.3, 1, 3], ['0.1', '0.3', '1', '3'])
    law.minorticks_off()
    t = data.flight.t
    p = law_54(t)
    for values, label, line in (
        (-2.0 * p, 'printed, 2 M / (r I_z)', {'color': look.tenth, 'ls': dashed}),
        (p, 'corrected, −M / (r I_z)', {'color': look.printed}),
        (roll_rate(t), 'simulated', {'color': look.ink, 'lw': 1.0}),
    ):
        along.plot(t.t, values, label=label, **line)
    along.set(xlabel='time, s', ylabel='roll rate in axes 3, rad/s')
    style.letter(law, 'a', 'eqn 64')
    style.letter(along, 'b', 'eqn 54 along Fig. 5')
    for axis in (law, along):
        axis.legend(loc='best')
    return figure


def factor(data: Data) -> FloatArray:
    """Return simulated p V / g over k_n / AdvR: 8 as printed, 4 as corrected, shape (12,)."""
    ratio: FloatArray = 4.0 * data.simulated / data.corrected
    return ratio


def findings(data: Data) -> list[str]:
    """Return the simulated value of the printed factor 8."""
    simulated = factor(data)
    t = data.flight.t
    apart = float(np.sqrt(np.mean((roll_rate(t) - law_54(t)) ** 2)))
    printed = float(np.sqrt(np.mean((roll_rate(t) + 2.0 * law_54(t)) ** 2)))
    return [
        f'Simulated p V / g over k_n / AdvR: {simulated[-1]:.2f} at AdvR {RATIOS[-1]:.1f}, '
        f'{simulated[0]:.2f} at AdvR {RATIOS[0]:.1f}. Eqn 64 prints 8; corrected it is 4.',
        f'Along the throw of Fig. 5 the simulated rate is {apart:.2f} rad/s rms from −M / (r I_z) '
        f'and {printed:.2f} rad/s from 2 M / (r I_z) as printed.',
    ]


def table(data: Data) -> str:
    """Return the law against the advance ratio as CSV."""
    header = ['AdvR', 'p_hat_printed', 'p_hat_corrected', 'p_hat_simulated']
    columns = (RATIOS, data.printed, data.corrected, data.simulated)
    return conditions.csv_text(header, np.column_stack(columns))


def example(data: Data) -> Curve:
    """Return the flight to integrate a second time."""
    return data.flight


FIGURE = PaperFigure(
    key='roll_rate',
    title=TITLE,
    conditions=CONDITIONS,
    compute=compute,
    plot=plot,
    findings=findings,
    table=table,
    example=example,
)


if __name__ == '__main__':
    sys.exit(figure_files.main(FIGURE))
