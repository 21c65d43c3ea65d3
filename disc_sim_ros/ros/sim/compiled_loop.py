"""The simulation loop in compiled code, where numba and the C functions of rcl are at hand.

`tick.run` flies between two rare things. This module hands over what it needs from the objects of
the loop, and takes the changes back.
"""

import math
from typing import NamedTuple

import numpy as np

from disc_sim_ros import topics
from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics import disc_file, simulator
from disc_sim_ros.physics.flight import NO_NOISE, Setup
from disc_sim_ros.physics.kernels import jit
from disc_sim_ros.physics.kernels.equations import Control, Velocity
from disc_sim_ros.physics.kernels.integrator import INTEGRATOR_STATE_SIZE
from disc_sim_ros.physics.kernels.state_arrays import STATE_SIZE
from disc_sim_ros.physics.simulator import NOTHING
from disc_sim_ros.quantities import CONTROL, CONTROL_MOMENT
from disc_sim_ros.ros.cdr_template import CdrTemplate
from disc_sim_ros.ros.internals import NativeTopics, native_topics
from disc_sim_ros.ros.sim.commands import END_OF_TIME, MOST_WAITING
from disc_sim_ros.ros.sim.publishers import Publishers
from disc_sim_ros.ros.sim.realtime import CATCH_UP, Pacer
from disc_sim_ros.ros.sim.simulation import Simulation
from disc_sim_ros.ros.sinks import PublisherSink, Sink
from disc_sim_ros.units import NANOSECONDS

if jit.COMPILED:
    from disc_sim_ros.ros.sim import tick, tick_inbox

LONGEST_SLEEP = 0.01  # s
LONGEST_QUANTUM = 1e-3  # s of simulated time between two polls of the command topics, at a pace
UNWATCHED_QUANTUM = 5e-3  # s, the same while no publisher of commands and no clock is matched
MOST_STEPS = 1000  # of one call
LONGEST_CALL = 0.2  # s of wall time; other threads see lateness and counts that late
_REST = False
_LARGEST = 2**62  # of the numbers from which a stamp is computed


class _Message(NamedTuple):
    sink: PublisherSink
    template: CdrTemplate
    sources: tuple[int, ...]  # places of its numbers among those of `tick`


class CompiledLoop:
    """Flies a simulation in compiled code while nothing rare happens.

    Only the simulation thread uses it, apart from `interrupt`.
    """

    def __init__(self, simulation: Simulation, publishers: Publishers, native: NativeTopics,
                 messages: list[_Message]) -> None:  # fmt: skip
        """Prepare the arrays that compiled code works in; `compiled_loop` checks the rest."""
        self._simulation = simulation
        self._publishers = publishers
        self._native = native
        self._attention = np.zeros(1, dtype=np.int64)
        self._interrupts = self._attention.data
        self._messages = messages
        n = len(messages)
        starts, size = [], 0  # of the messages, in words of 8 bytes
        for message in messages:
            starts.append(size)
            size += (4 + len(message.template.template) + 7) // 8
        self._floats = np.zeros(size)
        in_bytes, whole = self._floats.view(np.uint8), self._floats.view(np.int32)
        self._structs = np.zeros((n, 8), dtype=np.int64)
        stamps = np.full((n, 2), -1)
        sources: list[int] = []
        places: list[int] = []
        first = [0]
        for i, (_, template, numbers) in enumerate(messages):
            start = 8 * starts[i] + 4  # behind the header of 4 bytes, floats are aligned
            length = len(template.template)
            in_bytes[start : start + length] = np.frombuffer(template.template, dtype=np.uint8)
            self._structs[i, :3] = self._floats.ctypes.data + start, length, length
            for k, offset in enumerate(template.stamp_offsets):
                stamps[i, k] = (start + offset) // 4
            sources += numbers
            places += [(start + offset) // 8 for offset in template.float_offsets]
            first.append(len(places))
        self._wanted = np.zeros(n, dtype=np.int64)
        self._outbox = tick.Outbox(
            np.array(native.publishers, dtype=np.int64),
            self._structs.ctypes.data + 64 * np.arange(n),
            self._wanted,
            np.array(first),
            np.array(sources),
            np.array(places),
            stamps,
            self._floats,
            whole,
            np.zeros(tick.VALUES),
            np.zeros(2, dtype=np.int64),
            (0.0, 0.0, 0.0),
            0.0,
        )
        self._observation = np.empty(len(NOTHING))
        self._inbox = _inbox(native, publishers.frames)
        self._active, self._held = np.zeros(7), np.zeros(7)
        self._until = np.zeros(2, dtype=np.int64)
        self._state, self._landing = np.zeros(STATE_SIZE), np.empty(STATE_SIZE)
        self._before = np.zeros(INTEGRATOR_STATE_SIZE)
        self._time = np.zeros(2, dtype=np.int64)
        self._number = np.zeros(1, dtype=np.int64)
        self._result = np.zeros(4, dtype=np.int64)
        self._late = np.zeros(MOST_STEPS)
        self._points = np.zeros((MOST_STEPS, tick.POSE_SIZE))
        self._point_stamps = np.zeros(MOST_STEPS, dtype=np.int64)
        self._functions = tick_inbox.Functions(**native.functions)

    def interrupt(self) -> None:
        """Make `run` return soon; for any thread."""
        self._interrupts[0] = 1

    def close(self) -> None:
        """Release the publishers and subscriptions; `run` must not be called again."""
        self._native.close()

    def rearm(self) -> None:
        """Forget interrupts; what they were about is checked after this and before `run`."""
        self._interrupts[0] = 0

    def run(self, pacer: Pacer) -> bool:
        """Fly on, at a pace.

        Returns:
            False if the next step is Python's.
        """
        sim = self._simulation
        flight, now = sim.flight_simulator, sim.clock.now
        num = sim.clock.fraction[1]
        if self._needs_python() or num * (MOST_STEPS + 1) >= _LARGEST or now >= _LARGEST:
            return False
        if flight is not None and flight.steps == 0:
            return False  # the first step completes the release
        if any(len(t.waiting) > MOST_WAITING - tick_inbox.QUEUE for t in sim.commands.all):
            return False  # what arrives is refused
        reason = self._run(pacer, min(MOST_STEPS, max(1, int(LONGEST_CALL / pacer.period))))
        if reason == tick.TAKEN:
            topic = sim.commands.all[int(self._result[2])]
            sim.take(topic, self._native.taken())
        elif reason == tick.FAILED:
            sim.publish()  # raises the error
        return reason == tick.DONE

    def _needs_python(self) -> bool:
        """Return True if a topic has subscribers that compiled code does not publish."""
        out = self._publishers
        has_errors = not self._simulation.imu_errors.is_exact
        return out.clock_is_followed or (out.imu.has_subscribers and has_errors)

    def _run(self, pacer: Pacer, most: int) -> int:
        sim = self._simulation
        clock, config, flight = sim.clock, sim.config, sim.flight_simulator
        for i, message in enumerate(self._messages):
            self._wanted[i] = message.sink.has_subscribers
        out = self._publishers
        self._outbox.needs[:] = (
            out.quantities_have_subscribers,
            out.imu.has_subscribers or out.aero_wrench.has_subscribers,
        )
        self._state[:] = sim.state
        control = sim.inputs.active
        self._active[:] = control.control
        self._held[:] = control.control if flight is None else flight.control
        self._until[:] = _whole(control.moment_until), _whole(control.coefficients_until)
        reason: int = tick.run(
            self._functions,
            self._outbox._replace(
                imu_offset=sim.imu_errors.offset, diameter=float(config.setup.disc.diameter)
            ),
            self._inbox,
            tick.Inputs(
                self._active,
                self._held,
                self._until,
                round(config.command_timeout * NANOSECONDS),
            ),
            self._flight(most),
            tick.Time(
                clock.now,
                *clock.fraction,
                clock.steps % config.steps_per_publish,
                config.steps_per_publish,
                pacer.epoch,
                pacer.period,
                pacer.done,
                max(1, round(LONGEST_QUANTUM / config.setup.fixed_step)),
                max(1, round(UNWATCHED_QUANTUM / config.setup.fixed_step)),
                LONGEST_SLEEP,
                CATCH_UP,
            ),
            tick.Limits(
                most,
                _whole(sim.commands.next_change()),
                _whole(sim.next_throw),
                sim.steps_to_path,
                0 if out.path.has_subscribers else sim.steps_per_point,
            ),
            tick.Shared(
                self._attention,
                clock.counter,
                self._time,
                self._time.ctypes.data,
                self._number,
                self._number.ctypes.data,
                self._late,
                self._points,
                self._point_stamps,
                self._result,
            ),
        )
        steps, deadlines, _, points = self._result.tolist()
        poses = zip(
            self._point_stamps[:points].tolist(), self._points[:points].tolist(), strict=True
        )
        for stamp, pose in poses:
            out.keep_point(stamp, pose)
        pacer.add(steps, self._late[:deadlines].tolist())
        moment_until, coefficients_until = map(_stamp, self._until.tolist())
        control.restore(_control(self._active), moment_until, coefficients_until)
        if flight is not None:
            flight.take(_control(self._held))
            flight.count(steps)
        self._take_queues()
        return reason

    def _flight(self, steps: int) -> 'tick.Flight':
        """Return the arguments of the compiled step."""
        sim = self._simulation
        flight, config = sim.flight_simulator, sim.config
        if flight is None or flight.landed:
            setup = config.setup
            plant, wind, noise, step = setup.plant, setup.wind_data, NO_NOISE, setup.fixed_step
            array, ground, landing = self._before, config.ground, self._landing
        else:
            array, plant, wind, noise, step, ground, landing = flight.step_arguments(steps)
        return tick.Flight(
            flight is not None and not flight.landed, 1,
            self._state, Velocity(*map(float, sim.wind)), array, self._before,
            plant, wind, noise, step, ground, landing, self._observation,
        )  # fmt: skip

    def _take_queues(self) -> None:
        """Let Python know the commands that compiled code has accepted."""
        commands, inbox = self._simulation.commands, self._inbox
        for i in (tick_inbox.MOMENT, tick_inbox.COEFFICIENTS):
            topic = commands.all[i]
            topic.accepted += int(inbox.accepted[i])
            n = int(inbox.waiting[i])
            rows = zip(inbox.stamps[i, :n].tolist(), inbox.queue[i, :n].tolist(), strict=True)
            for stamp, (x, y, z, axes) in rows:
                moment = i == tick_inbox.MOMENT
                commands.enqueue(topic, stamp, (x, y, z, int(axes)) if moment else (x, y, z))
        inbox.accepted[:] = 0
        inbox.waiting[:] = 0


def compiled_loop(simulation: Simulation, publishers: Publishers) -> CompiledLoop | None:
    """Return the compiled form of a simulation's loop.

    None where numba is absent or switched off, where the messages go to a bag, or where rclpy does
    not give the handles of rcl.
    """
    if not jit.COMPILED:
        return None
    motion = tuple(range(tick.MOTION, tick.SPIN))
    vector = (0, 1, 2)
    spin = (tick.SPIN, tick.SPIN + 1)
    out = publishers
    rows: list[tuple[Sink, CdrTemplate | None, tuple[int, ...]]] = [
        (out.applied_coefficients, None, vector)
    ]
    rows += [(out.applied_moment, out.moments[axes], vector) for axes in sorted(out.moments)]
    rows += [
        (out.odom, None, motion),
        (out.pose, None, motion[:7]),
        (out.transform, None, motion[:7]),
        (out.transform, out.spin_transform, spin),
        (out.joint_states, None, (tick.JOINT, tick.JOINT + 1)),
    ]
    imu, wrench = (range(at, at + 6) for at in (tick.IMU, tick.WRENCH))
    rows += [(out.imu, None, tuple(imu)), (out.aero_wrench, None, tuple(wrench))]
    rows += [(sink, None, (tick.QUANTITIES + i,)) for i, sink in enumerate(out.quantities)]
    if out.tf is not None:
        rows.append((out.tf, None, motion[:7] + spin))
    messages = []
    for sink, other, sources in rows:
        template = other or getattr(sink, 'template', None)
        if not isinstance(sink, PublisherSink) or template is None:
            return None
        messages.append(_Message(sink, template, sources))
    native = native_topics(
        [message.sink.publisher for message in messages], simulation.commands.subscriptions
    )
    return None if native is None else CompiledLoop(simulation, publishers, native, messages)


def first_call_note() -> str:
    """Return one line for users on why `warm_up` takes long; '' if it does not."""
    return simulator.first_call_note(*((tick.run,) if jit.COMPILED else ()), seconds=12)


def warm_up() -> None:
    """Load or compile the machine code of a simulator and of its loop, before a node exists."""
    simulator.warm_up()
    if not jit.COMPILED:
        return
    whole, rows = np.zeros(1, dtype=np.int64), np.zeros((1, 1), dtype=np.int64)
    floats, table = np.zeros(1), np.zeros((1, 1))
    small = np.zeros(1, dtype=np.int32)
    names = np.zeros((1, 1), dtype=np.uint8)
    setup = Setup(disc=disc_file.load_disc('frisbee'))
    constants = (setup.plant, setup.wind_data, NO_NOISE, setup.fixed_step, True)
    tick.run(
        tick_inbox.Functions(0, 0, 0, 0, 0),
        tick.Outbox(
            whole,
            whole,
            whole,
            whole,
            whole,
            whole,
            rows,
            floats,
            small,
            floats,
            whole,
            (0.0, 0.0, 0.0),
            0.0,
        ),
        tick_inbox.Inbox(
            whole, 0, whole, names, whole, table, 0, rows, np.zeros((1, 1, 1)), whole, whole
        ),
        tick.Inputs(floats, floats, whole, 0),
        tick.Flight(
            _REST, 1, floats, Velocity(0.0, 0.0, 0.0), floats, floats, *constants, floats, floats
        ),
        tick.Time(0, 0, 1, 1, 0, 1, 0.0, 1.0, 0, 1, 1, LONGEST_SLEEP, CATCH_UP),
        tick.Limits(0, 0, 0, 0, 0),
        tick.Shared(
            whole, whole, whole, 0, whole, 0, floats, table, whole, np.zeros(4, dtype=np.int64)
        ),
    )


def _inbox(native: NativeTopics, frames: topics.Frames) -> 'tick_inbox.Inbox':
    names = [name.encode() for name in (frames.disc, frames.disc_body, frames.disc_air)]
    characters = np.zeros((len(names), max(map(len, names))), dtype=np.uint8)
    for row, name in zip(characters, names, strict=True):
        row[: len(name)] = np.frombuffer(name, dtype=np.uint8)
    highest = [[q.highest for q in table.values()] for table in (CONTROL_MOMENT, CONTROL)]
    return tick_inbox.Inbox(
        np.array(native.subscriptions, dtype=np.int64),
        native.inbox.ctypes.data,
        native.inbox,
        characters,
        np.array([len(name) for name in names]),
        np.array(highest),
        END_OF_TIME,
        np.zeros((2, tick_inbox.QUEUE), dtype=np.int64),
        np.zeros((2, tick_inbox.QUEUE, 4)),
        np.zeros(2, dtype=np.int64),
        np.zeros(2, dtype=np.int64),
    )


def _control(values: FloatArray) -> Control:
    C_L, C_M, C_N, L, M, N, axes = values.tolist()
    return Control(C_L, C_M, C_N, L, M, N, int(axes))


def _whole(stamp: float) -> int:
    """Return a stamp [ns] as a whole number, infinity as `tick.NEVER`."""
    return int(stamp) if stamp < tick.NEVER else tick.NEVER


def _stamp(whole: int) -> float:
    return whole if whole < tick.NEVER else math.inf
