"""What sim_node reports on /diagnostics: how the simulation keeps pace, and what it counted."""

import time

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from disc_sim_ros.ros.sim.loop import SimLoop
from disc_sim_ros.ros.sim.simulation import FAR
from disc_sim_ros.units import NANOSECONDS

LATE = 0.01  # s; a worse lateness in a period is a warning
STUCK = 0.3  # s without a step; of its last 0.1 s the thread has not told


class SimDiagnostics:
    """Makes the diagnostic status of a simulation, from period to period."""

    def __init__(self, loop: SimLoop, node_name: str, hardware_id: str) -> None:
        """Begin the first period.

        Args:
            loop: The simulation.
            node_name: Name of the node, with namespace, without the leading slash.
            hardware_id: What the status is about: the frame of the disc.
        """
        self._loop = loop
        self._name = f'{node_name}: simulation'
        self._hardware_id = hardware_id
        self._wall, self._stamp = time.monotonic(), loop.clock.now
        self._dropped = 0

    def end_period(self) -> DiagnosticStatus:
        """Return the status of the period since the last call, and begin the next one."""
        loop = self._loop
        wall, stamp = time.monotonic(), loop.clock.now
        factor = (stamp - self._stamp) / NANOSECONDS / (wall - self._wall)
        self._wall, self._stamp = wall, stamp
        worst = loop.pacer.take_worst()
        dropped = sum(topic.dropped for topic in loop.commands.all)
        problems = []
        if worst > LATE:
            problems.append(f'up to {worst * 1e3:.1f} ms late')
        if (overdue := self._overdue()) > STUCK:
            problems.append(f'no step for {overdue:.1f} s')
        if dropped > self._dropped:
            problems.append(f'{dropped - self._dropped} commands dropped')
        self._dropped = dropped
        now = loop.clock.now
        lead, name = loop.commands.furthest(now)
        if lead > FAR and not loop.follows_wall:
            problems.append(f'{name} waits {lead / NANOSECONDS:.3f} s until its stamp')
        values: dict[str, object] = {
            'paused': loop.paused,
            'real_time_factor': f'{factor:.4f}',
            'worst_lateness_s': f'{worst:.6f}',
            'lateness_p50_s': f'{loop.pacer.quantile(0.5):.6f}',
            'lateness_p99_s': f'{loop.pacer.quantile(0.99):.6f}',
            'missed_deadlines': loop.pacer.missed,
            'slips': loop.pacer.slips,
            'slipped_s': f'{loop.pacer.slipped:.6f}',
            'time_jumps': loop.counts.jumps,
            'jumped_s': f'{loop.counts.jumped / NANOSECONDS:.6f}',
            'throws': loop.counts.throws,
            'landings': loop.counts.landings,
            'failed_flights': loop.counts.failures,
            'expired_commands': loop.counts.expired,
            'dropped_commands': dropped,
        }
        for topic in loop.commands.all:
            ahead = topic.ahead(now)
            values[f'{topic.name} accepted'] = topic.accepted - len(ahead)
            values[f'{topic.name} waiting'] = len(ahead)
            if ahead:
                values[f'{topic.name} furthest lead_s'] = f'{max(ahead) / NANOSECONDS:.6f}'
            values[f'{topic.name} dropped'] = topic.dropped
            if topic.dropped:
                values[f'{topic.name} last reason'] = topic.reason
        return DiagnosticStatus(
            level=DiagnosticStatus.WARN if problems else DiagnosticStatus.OK,
            name=self._name,
            message=', '.join(problems) or self._no_problem(),
            hardware_id=self._hardware_id,
            values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
        )

    def _overdue(self) -> float:
        """Return how late the next step is [s]; 0 or less if it is not due."""
        loop = self._loop
        if loop.paused or loop.config.real_time_factor == 0.0:
            return 0.0
        return -loop.pacer.wait(time.monotonic(), 1)

    def _no_problem(self) -> str:
        if self._loop.paused:
            return 'paused'
        return 'in time' if self._loop.config.real_time_factor else 'as fast as possible'
