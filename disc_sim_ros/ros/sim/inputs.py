"""The inputs of the disc: control inputs and mean wind, as they begin, change and expire."""

from dataclasses import replace
import math

from disc_sim_ros.physics import frames
from disc_sim_ros.physics.environment import Wind
from disc_sim_ros.physics.kernels.equations import DISC_AIR
from disc_sim_ros.physics.simulator import FlightSimulator
from disc_sim_ros.ros.sim.clock import SimClock
from disc_sim_ros.ros.sim.commands import ActiveControl, Commands, pop_due
from disc_sim_ros.ros.sim.publishers import Publishers
from disc_sim_ros.units import NANOSECONDS

_NO_MOMENT = (0.0, 0.0, 0.0, DISC_AIR)
_NO_COEFFICIENTS = (0.0, 0.0, 0.0)


class Inputs:
    """The control inputs and the wind that act at present. It publishes each change.

    Methods that change something take the flight, which gets the change; None without a flight.

    Attributes:
        active: The control inputs.
        wind: The wind; its turbulence and seed wait for the next throw.
    """

    def __init__(
        self, commands: Commands, publishers: Publishers, clock: SimClock, wind: Wind
    ) -> None:
        """Begin with a wind and without control inputs; publish nothing yet."""
        self.active = ActiveControl()
        self.wind = wind
        self._commands = commands
        self._publishers = publishers
        self._clock = clock

    def next_change(self) -> float:
        """Return the first stamp at which a command begins or expires [ns], or inf."""
        return min(self._commands.next_change(), self.active.next_expiry())

    def expire(self, flight: FlightSimulator | None) -> bool:
        """Set to zero what expires at the present step; return True if anything does."""
        moment, coefficients = self.active.expired(self._clock.now)
        if moment:
            self._set_moment(_NO_MOMENT, math.inf, flight)
        if coefficients:
            self._set_coefficients(_NO_COEFFICIENTS, math.inf, flight)
        return moment or coefficients

    def apply_due(self, timeout: float, flight: FlightSimulator | None) -> None:
        """Apply the commands that act from the present step on, for `timeout` [s] at most."""
        now = self._clock.now
        until = now + round(timeout * NANOSECONDS)
        moment = pop_due(self._commands.moment, now)
        if moment is not None:
            self._set_moment(moment, until, flight)
        coefficients = pop_due(self._commands.coefficients, now)
        if coefficients is not None:
            self._set_coefficients(coefficients, until, flight)
        mean = pop_due(self._commands.wind, now)
        if mean is not None:
            self.set_wind(replace(self.wind, mean=mean), flight)

    def reset(self, wind: Wind) -> None:
        """Drop all commands and control inputs, and set the wind; there is no flight."""
        self._commands.clear('a reset came before its time')
        self._set_moment(_NO_MOMENT, math.inf, None)
        self._set_coefficients(_NO_COEFFICIENTS, math.inf, None)
        self.set_wind(wind, None)

    def set_wind(self, wind: Wind, flight: FlightSimulator | None) -> None:
        """Change mean and profile of the wind; a flight keeps its turbulence and seed."""
        self.wind = wind
        if flight is not None:
            turbulence = flight.setup.wind.turbulence
            flight.set_wind(replace(wind, turbulence=turbulence))
        self.publish_wind()

    def publish_wind(self) -> None:
        """Publish the mean wind that blows."""
        mean = frames.map_from_paper(self.wind.mean) + 0.0
        self._publishers.publish_applied_wind(self._clock.now, mean.tolist())

    def publish_control(self) -> None:
        """Publish the active control again, for a recording that begins with a throw."""
        c, now = self.active.control, self._clock.now
        if any((c.L, c.M, c.N)):
            self._publishers.publish_applied_moment(now, (c.L, c.M, c.N, c.axes))
        if any((c.C_L, c.C_M, c.C_N)):
            self._publishers.publish_applied_coefficients(now, (c.C_L, c.C_M, c.C_N))

    def _set_moment(
        self,
        moment: tuple[float, float, float, int],
        until: float,
        flight: FlightSimulator | None,
    ) -> None:
        before = self.active.control
        self.active.set_moment(moment, until)
        if self.active.control != before:
            self._publishers.publish_applied_moment(self._clock.now, moment)
            self._control(flight)

    def _set_coefficients(
        self, values: tuple[float, float, float], until: float, flight: FlightSimulator | None
    ) -> None:
        before = self.active.control
        self.active.set_coefficients(values, until)
        if self.active.control != before:
            self._publishers.publish_applied_coefficients(self._clock.now, values)
            self._control(flight)

    def _control(self, flight: FlightSimulator | None) -> None:
        if flight is not None:
            flight.take(self.active.control)
