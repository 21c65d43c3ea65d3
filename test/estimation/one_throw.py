"""One simulated throw without noise whose damping is fitted."""

from dataclasses import replace

import numpy as np

from disc_sim_ros.estimation.identification.coefficients import NAMES, base_of, disc_with
from disc_sim_ros.estimation.identification.fitting import solve
from disc_sim_ros.estimation.identification.observations import NOISE
from disc_sim_ros.estimation.identification.problem import Prior, Problem
from disc_sim_ros.estimation.identification.throws import throw_of
from disc_sim_ros.physics.disc_file import load_disc
from disc_sim_ros.physics.flight import Setup
from disc_sim_ros.physics.launch import Launch
from disc_sim_ros.quantities import COEFFICIENT_SPREAD
from estimation import synthetic_sessions

BASE = Setup(disc=load_disc('ultrastar'))


def damping_problem(kinds: tuple[str, ...], damping: float) -> tuple[Problem, np.ndarray]:
    """Return one throw without noise, of a disc with another damping, and the best parameters."""
    base = base_of(BASE)
    values = base.values.copy()
    place = NAMES.index('damping')
    values[place] = damping
    setup = replace(BASE, disc=disc_with(base, values, 'true', ''), step=5e-4)
    launch = Launch(
        speed=17.0, pitch=10.0, angle_of_attack=4.0, spin=60.0, height=1.3, roll_rate=2
    )
    generator = np.random.default_rng(1)
    none = dict.fromkeys(kinds, 0.0)
    made = synthetic_sessions.measured(launch, setup, kinds, generator, noise=none)
    throw = replace(throw_of('one', made, BASE.disc, spin=60.0), start=np.array(launch.state()))
    problem = Problem(
        setup=BASE,
        base=base,
        free=(place,),
        throws=(throw,),
        prior=Prior(np.array([COEFFICIENT_SPREAD[name] for name in NAMES])),
        noise=NOISE,
        held=values,
    )
    x = problem.means.copy()
    x[0] = damping
    return problem, solve(problem, x).x
