"""A disc: mass, size, inertia and aerodynamic coefficients, checked on construction."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from disc_sim_ros import validation
from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.physics.disc_checks import check_body, check_number
from disc_sim_ros.quantities import DAMPING, DISC, LINEAR_AERO

AERODYNAMICS = ('table', 'linear')
GROUND_CONTACTS = ('centre', 'rim')


@dataclass(frozen=True, kw_only=True, slots=True)
class LinearAero:
    """Steady coefficients as straight lines in alpha, and drag as a parabola; per radian.

    C_Lift = CL_0 + CL_alpha a; C_Drag = CD_0 + CD_alpha (a - alpha_0)^2; C_M = CM_0 + CM_alpha a.
    Not limited: outside the fitted range the lines continue. Source: paper, Fig. 3.

    Raises:
        ConfigError: A number is not finite, or `CD_0` or `CD_alpha` is negative.
    """

    CL_0: float
    CL_alpha: float
    CD_0: float
    CD_alpha: float
    alpha_0: float  # rad, angle of least drag
    CM_0: float
    CM_alpha: float

    def __post_init__(self) -> None:
        for name, quantity in LINEAR_AERO.items():
            quantity.check(getattr(self, name))


@dataclass(frozen=True, slots=True, eq=False)
class AeroTable:
    """Steady coefficients over the angle of attack, linear between the rows.

    Attributes:
        alpha_deg: Angles of attack, ascending, at least -90 to 90 [degrees], shape (n,).
        coefficients: Columns C_Lift, C_Drag, C_M (nose up positive), shape (n, 3).
    """

    alpha_deg: FloatArray
    coefficients: FloatArray

    @property
    def alpha(self) -> FloatArray:
        """Angles of attack [rad], shape (n,)."""
        return np.radians(self.alpha_deg)

    @classmethod
    def of(cls, *, alpha_deg: ArrayLike, CL: ArrayLike, CD: ArrayLike, CM: ArrayLike) -> Self:
        """Build a table from four columns of one length.

        Raises:
            ConfigError: Columns are short, of different lengths, not finite, not ascending, have
                negative drag, or leave out some angle of attack between -90 and 90 degrees.
        """
        degrees = validation.ascending('alpha_deg', validation.column('alpha_deg', alpha_deg))
        for where, end, missing in (
            ('alpha_deg[0]', degrees[0], degrees[0] > -90.0),
            ('alpha_deg[-1]', degrees[-1], degrees[-1] < 90.0),
        ):
            if missing:
                raise ConfigError(where, float(end), 'the table must cover -90 to 90 degrees')
        columns = []
        for name, values in (('CL', CL), ('CD', CD), ('CM', CM)):
            column = validation.column(name, values)
            if len(column) != len(degrees):
                allowed = f'alpha_deg has {len(degrees)} rows, so must this'
                raise ConfigError(name, f'{len(column)} rows', allowed)
            columns.append(column)
        for i, drag in enumerate(columns[1]):
            validation.number(f'CD[{i}]', float(drag), 0.0)
        return cls(degrees, np.ascontiguousarray(np.stack(columns, axis=1)))


@dataclass(frozen=True, slots=True, eq=False)
class SpinTable:
    """A coefficient caused by the spin, over advance ratio and angle of attack.

    Bilinear inside the table, held constant outside. The opposite spin gives the opposite sign,
    so that the mirrored throw flies the mirrored path; the row without spin is therefore 0.

    Attributes:
        advance_ratio: r c / (2 V), ascending from 0, shape (m,).
        alpha_deg: Angles of attack, ascending [degrees], shape (n,).
        coefficient: For a spin clockwise from above, shape (m, n).
    """

    advance_ratio: FloatArray
    alpha_deg: FloatArray
    coefficient: FloatArray

    @property
    def alpha(self) -> FloatArray:
        """Angles of attack [rad], shape (n,)."""
        return np.radians(self.alpha_deg)

    @classmethod
    def of(cls, *, advance_ratio: ArrayLike, alpha_deg: ArrayLike, coefficient: object) -> Self:
        """Build a table from its two axes and one row of coefficients per advance ratio.

        Raises:
            ConfigError: An axis does not ascend, the advance ratio does not begin at 0, a row has
                the wrong length, or the row without spin is not 0.
        """
        ratio = validation.ascending(
            'advance_ratio', validation.column('advance_ratio', advance_ratio)
        )
        if ratio[0] != 0.0:
            raise ConfigError('advance_ratio[0]', float(ratio[0]), 'the first must be 0')
        degrees = validation.ascending('alpha_deg', validation.column('alpha_deg', alpha_deg))
        allowed = f'give {len(ratio)} rows of {len(degrees)} numbers'
        if not isinstance(coefficient, list | tuple | np.ndarray) or len(coefficient) != len(
            ratio
        ):
            raise ConfigError('coefficient', coefficient, allowed)
        rows = [validation.column(f'coefficient[{i}]', row) for i, row in enumerate(coefficient)]
        for i, row in enumerate(rows):
            if len(row) != len(degrees):
                raise ConfigError(f'coefficient[{i}]', f'{len(row)} numbers', allowed)
        if np.any(rows[0] != 0.0):
            allowed = 'without spin there is no coefficient, all must be 0'
            raise ConfigError('coefficient[0]', rows[0].tolist(), allowed)
        return cls(ratio, degrees, np.array(rows))


@dataclass(frozen=True, kw_only=True, eq=False)
class Disc:
    """One disc. SI units; z is the spin axis; coefficients are for area `area`, length `diameter`.

    Raises:
        ConfigError: A number is out of range, mass, size and inertia contradict each other, or the
            disc has no aerodynamics of the kind that it names as its own.
    """

    name: str
    mass: float  # kg
    diameter: float  # m, the paper's c
    area: float  # m^2, the paper's S
    inertia_axial: float  # kg m^2, I_z
    inertia_diametral: float  # kg m^2, I_x = I_y
    C_Lp: float = DAMPING['C_Lp'].default  # roll damping, per p c / (2 V)
    C_Mq: float = DAMPING['C_Mq'].default  # pitch damping, per q c / (2 V)
    C_Nr: float = DAMPING['C_Nr'].default  # spin damping, per r c / (2 V)
    aero: str = 'table'  # the coefficients used unless a Setup names others
    ground_contact: str = 'centre'  # what touches the ground unless a Setup names another
    table: AeroTable | None = None
    linear: LinearAero | None = None
    spin_roll_moment: SpinTable | None = None  # rolling moment in axes 3
    spin_side_force: SpinTable | None = None  # C_Side, along y of axes 3
    description: str = ''
    # Standard deviations of what is added to the coefficients: lift_offset, drag_offset,
    # pitching_offset; empty where they are not known.
    uncertainty: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, quantity in DISC.items():
            check_number(quantity, getattr(self, name))
        for name, quantity in DAMPING.items():
            quantity.check(getattr(self, name))
        check_body(**{name: getattr(self, name) for name in DISC})
        validation.choice('aero', self.aero, AERODYNAMICS)
        validation.choice('ground', self.ground_contact, GROUND_CONTACTS)
        if not self.has(self.aero):
            held = [kind for kind in AERODYNAMICS if self.has(kind)]
            allowed = f'disc {self.name} holds {" and ".join(held) or "no"} coefficients'
            raise ConfigError('aero', self.aero, allowed)

    def has(self, aero: str) -> bool:
        """Return True if the disc holds coefficients of the kind `aero`."""
        return (self.table if aero == 'table' else self.linear) is not None

    def steepest_moment(self, aero: str) -> float:
        """Return the largest slope of C_M over the angle of attack, of either sign [1/rad]."""
        if aero == 'linear' and self.linear is not None:
            return abs(self.linear.CM_alpha)
        alpha, C_M = self.table_rows[:, 0], self.table_rows[:, 3]
        return float(np.max(np.abs(np.diff(C_M) / np.diff(alpha))))

    @cached_property
    def table_rows(self) -> FloatArray:
        """Return the table as `aerodynamics.table_coefficients` takes it, shape (n, 8).

        Columns are alpha [rad], C_Lift, C_Drag, C_M, the alpha of the next row, and the slopes of
        the three coefficients up to there [1/rad]. The slopes of the last row are not used, nor
        are the two rows of a disc without a table.
        """
        if self.table is None:
            return np.array([[-np.pi, 0, 0, 0, np.pi, 0, 0, 0], [np.pi, 0, 0, 0, np.inf, 0, 0, 0]])
        alpha, C = self.table.alpha, self.table.coefficients
        slopes = np.diff(C, axis=0) / np.diff(alpha)[:, np.newaxis]
        slopes = np.vstack([slopes, np.zeros(3)])
        return np.column_stack([alpha, C, np.append(alpha[1:], np.inf), slopes])

    @cached_property
    def corner_rows(self) -> FloatArray:
        """Return `table_rows` with a row at each corner of the spin tables too, shape (m, 8).

        The coefficients are the same: flights with error control end steps at all corners.
        """
        rows, terms = self.table_rows, self.spin_terms
        if len(terms) == 0:
            return rows
        corners = np.setdiff1d(terms[0, 0, 1:], rows[:, 0])
        corners = corners[(corners > rows[0, 0]) & (corners < rows[-1, 0])]
        added = rows[np.searchsorted(rows[:, 0], corners) - 1]
        added[:, 1:4] += added[:, 5:] * (corners - added[:, 0])[:, np.newaxis]
        added[:, 0] = corners
        rows = np.vstack([rows, added])
        rows = rows[np.argsort(rows[:, 0])]
        rows[:, 4] = np.append(rows[1:, 0], np.inf)
        return rows

    @cached_property
    def spin_terms(self) -> FloatArray:
        """Return the spin tables as `aerodynamics.spin_coefficients` takes them; may be empty.

        Both tables are interpolated to the advance ratios and angles of both, which changes no
        value between them.
        """
        tables = (self.spin_roll_moment, self.spin_side_force)
        given = [table for table in tables if table is not None]
        if not given:
            return np.empty((0, 0, 0))
        ratio = np.unique(np.concatenate([table.advance_ratio for table in given]))
        alpha = np.unique(np.concatenate([table.alpha for table in given]))
        terms = np.zeros((2, 1 + len(ratio), 1 + len(alpha)))
        terms[:, 1:, 0] = ratio
        terms[:, 0, 1:] = alpha
        for term, table in zip(terms, tables, strict=True):
            if table is not None:
                wide = [np.interp(alpha, table.alpha, row) for row in table.coefficient]
                high = [np.interp(ratio, table.advance_ratio, c) for c in np.transpose(wide)]
                term[1:, 1:] = np.transpose(high)
        return terms
