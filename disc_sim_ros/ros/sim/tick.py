"""The compiled form of the simulation loop: many steps in one call that holds no GIL.

It does what `loop`, `simulation` and `publishers` do between two rare things: take commands, sleep
to the deadline, step, patch the changing numbers of the serialised messages and publish them. It
returns before whatever is rare (a landing, a throw, a command that it does not accept, an expiry,
a request, a stall, a point of `path`), and Python does that step. `compiled_loop` calls it.

Import this module only where `jit.COMPILED`.
"""

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from disc_sim_ros.arrays import FloatArray
from disc_sim_ros.physics import frames, imu, trajectory
from disc_sim_ros.physics.kernels.equations import Control, Plant, State, Velocity
from disc_sim_ros.physics.kernels.integrator import FLYING, advance_steps, observe
from disc_sim_ros.physics.kernels.jit import entry_with, inline
from disc_sim_ros.physics.kernels.native import call
from disc_sim_ros.physics.kernels.wind import WindData, wind_at
from disc_sim_ros.ros.sim import tick_inbox
from disc_sim_ros.ros.sim.tick_inbox import (
    MOMENT,
    OK,
    SECOND,
    Functions,
    Inbox,
    Ints,
    count_due,
    drop,
    is_watched,
    poll,
)

DONE, PYTHON, TAKEN, FAILED = range(4)  # why `run` returns
NEVER = 2**62  # ns
APPLIED_COEFFICIENTS, APPLIED_MOMENT = 0, 1  # messages: that, one for each of `axes`, then states
FIRST_STATE = APPLIED_MOMENT + 3
MOTION, SPIN, JOINT, QUANTITIES, IMU, WRENCH, VALUES = 0, 13, 15, 17, 22, 28, 34  # in `values`
POSE_SIZE = 7  # position and quaternion, the first numbers of a motion
_MONOTONIC, _ABSOLUTE = 1, 1  # CLOCK_MONOTONIC, TIMER_ABSTIME of Linux


class Outbox(NamedTuple):
    """The messages and where their numbers are; m messages with n numbers in all."""

    publishers: Ints  # addresses of rcl_publisher_t, shape (m,)
    messages: Ints  # addresses of rcl_serialized_message_t, shape (m,)
    wanted: Ints  # 1 where a message of a state is to be published, shape (m,)
    first: Ints  # the first number of each message, and n; shape (m + 1,)
    sources: Ints  # places of the numbers in `values`, shape (n,)
    places: Ints  # and in `floats`, shape (n,)
    stamps: Ints  # places of the seconds in `whole`, or -1; shape (m, 2)
    floats: FloatArray  # all serialised messages
    whole: NDArray[np.int32]  # the same memory
    values: FloatArray  # shape (VALUES,): the numbers of a state, from MOTION, SPIN, ... on
    needs: Ints  # 1 if quantities of the paper, and imu or loads, are wanted; shape (2,)
    imu_offset: tuple[float, float, float]  # m, position of the IMU in `disc_body`
    diameter: float  # m


class Inputs(NamedTuple):
    """The control inputs."""

    active: FloatArray  # the `Control` that acts, shape (7,)
    held: FloatArray  # that of the flight, shape (7,): equal, but for the signs of zeros
    until: Ints  # stamps at which moment and coefficients expire, shape (2,)
    timeout: int  # ns


class Flight(NamedTuple):
    """The arguments of `integrator.advance_steps`."""

    flies: bool
    steps: int  # 1; as a literal it would compile another version, for 5 s
    state: FloatArray  # of a disc that does not fly, shape (14,) ...
    wind_at_rest: Velocity  # ... and the wind there
    flight: FloatArray
    before: FloatArray  # of the shape of `flight`
    plant: Plant
    wind: WindData
    noise: FloatArray
    step: float
    ground: bool
    landing: FloatArray
    observation: FloatArray  # shape (12,)


class Time(NamedTuple):
    """Simulated time and its deadlines at the call; k is the number of steps since."""

    now: int  # stamp [ns]; after k steps it is now + (rest + k num) // den
    rest: int
    num: int
    den: int
    phase: int  # steps since the last message
    every: int  # steps from message to message
    epoch: float  # s, the deadline of step k is epoch + (done + k) period, of CLOCK_MONOTONIC
    period: float  # s
    done: int
    quantum: int  # steps between two polls of the command topics ...
    unwatched_quantum: int  # ... while no publisher of commands is matched
    longest_sleep: float  # s
    catch_up: float  # s, a greater lateness is a slip


class Limits(NamedTuple):
    """What Python does."""

    most: int  # steps of this call
    change: int  # stamp from which a step is Python's [ns]
    throw_at: int  # stamp from which a message is Python's [ns]
    point_step: int  # number of the next step whose pose is a point of the path; 0: there is none
    point_every: int  # steps from point to point, which are kept; 0: that message is Python's


class Shared(NamedTuple):
    """Memory that other threads write or read."""

    attention: Ints  # not 0 if Python has something to do, shape (1,)
    counter: Ints  # steps of the clock, shape (1,)
    time: Ints  # a timespec, shape (2,)
    time_address: int
    number: Ints  # shape (1,)
    number_address: int
    late: FloatArray  # lateness at each deadline [s], shape (most,) or more
    points: (
        FloatArray  # position and quaternion of each pose that is kept, shape (most, 7) or more
    )
    stamps: Ints  # their stamps [ns], shape (most,) or more
    result: Ints  # steps made, deadlines met, topic of a command that was taken, poses kept; (4,)


@entry_with(*(Path(str(m.__file__)) for m in (frames, imu, trajectory, tick_inbox)))
def run(  # noqa: PLR0917
    c: Functions,
    outbox: Outbox,
    inbox: Inbox,
    inputs: Inputs,
    flight: Flight,
    time: Time,
    limits: Limits,
    shared: Shared,
) -> int:
    """Fly, publish and take commands until Python has something to do.

    Returns:
        DONE: call again; PYTHON: the next step is Python's; TAKEN: the message in the inbox is
        Python's; FAILED: it could not publish the message that is due now.
    """
    k = deadlines = points = 0
    reason = DONE
    while k < limits.most and reason == DONE and shared.attention[0] == 0:
        now = _stamp(time, k)
        topic = poll(c, inbox, now)
        if topic >= 0:
            shared.result[2] = topic
            reason = TAKEN
            break
        quantum = time.unwatched_quantum
        if is_watched(c, inbox, shared.number, shared.number_address):
            quantum = time.quantum
        quantum = max(1, min(quantum, time.every - (time.phase + k) % time.every))
        deadline = time.epoch + (time.done + k + quantum) * time.period
        t = _monotonic(c, shared)
        if deadline > t:
            _sleep(c, shared, min(deadline, t + time.longest_sleep))
            t = _monotonic(c, shared)
        late = t - deadline
        if late < 0.0:
            continue
        if late > time.catch_up:
            reason = PYTHON
            break
        due = math.floor((t - time.epoch) / time.period + 1e-9) - (time.done + k)
        first = True
        while due > 0 and k < limits.most:
            now = _stamp(time, k)
            at_message = (time.phase + k + 1) % time.every == 0
            python_message = (
                (limits.point_every == 0 and k + 1 == limits.point_step)
                or shared.attention[0] != 0
                or _stamp(time, k + 1) >= limits.throw_at
            )
            changes = now >= min(limits.change, inputs.until[0], inputs.until[1])
            if changes or (at_message and python_message):
                reason = PYTHON
                break
            if first:
                shared.late[deadlines] = late
                deadlines += 1
                first = False
            if not _apply(c, outbox, inbox, inputs, now) or not _step(flight, inputs.held):
                reason = PYTHON
                break
            k += 1
            due -= 1
            shared.counter[0] += 1
            if at_message and not _publish_state(c, outbox, flight, inputs.held, _stamp(time, k)):
                reason = FAILED
                break
            points = _keep_point(outbox, limits, shared, points, k, _stamp(time, k))
    for i, number in ((0, k), (1, deadlines), (3, points)):
        shared.result[i] = number
    return reason


@inline
def _keep_point(  # noqa: PLR0917
    outbox: Outbox, limits: Limits, shared: Shared, points: int, k: int, now: int
) -> int:
    """Keep the pose for the path, if that is due at step `k`; return how many are kept."""
    steps = k - limits.point_step
    if limits.point_every <= 0 or steps < 0 or steps % limits.point_every != 0:
        return points
    for i in range(POSE_SIZE):
        shared.points[points, i] = outbox.values[MOTION + i]
    shared.stamps[points] = now
    return points + 1


@inline
def _stamp(time: Time, k: int) -> int:
    return time.now + (time.rest + k * time.num) // time.den


# ---- the clock of the machine ----


@inline
def _monotonic(c: Functions, shared: Shared) -> float:
    call(c.time, _MONOTONIC, shared.time_address, 0, 0)
    return float(shared.time[0]) + 1e-9 * float(shared.time[1])


@inline
def _sleep(c: Functions, shared: Shared, until: float) -> None:
    whole = math.ceil(until * 1e9)  # exact for 100 days, then to a few ns
    shared.time[0], shared.time[1] = whole // SECOND, whole % SECOND
    call(c.sleep, _MONOTONIC, _ABSOLUTE, shared.time_address, 0)


# ---- steps ----


@inline
def _step(flight: Flight, held: FloatArray) -> bool:
    """Make a step unless it ends the flight: Python repeats that one."""
    if not flight.flies:
        return True
    for i in range(len(flight.flight)):
        flight.before[i] = flight.flight[i]
    status, _ = advance_steps(
        flight.flight,
        flight.steps,
        flight.plant,
        _control(held),
        flight.wind,
        flight.noise,
        flight.step,
        flight.ground,
        flight.landing,
    )
    if status == FLYING:
        return True
    for i in range(len(flight.flight)):
        flight.flight[i] = flight.before[i]
    return False


# ---- messages ----


@inline
def _publish_state(
    c: Functions, outbox: Outbox, flight: Flight, held: FloatArray, now: int
) -> bool:
    a = flight.state
    if flight.flies:
        a = flight.flight[1:15]
    s = State(
        a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7], a[8], a[9], a[10], a[11], a[12], a[13]
    )
    values = outbox.values
    motion = frames.odometry(s)
    for i in range(len(motion)):
        values[MOTION + i] = motion[i]
    spin, joint = frames.spin_transform(s), frames.spin_joint(s)
    for i in range(2):
        values[SPIN + i] = spin[i]
        values[JOINT + i] = joint[i]
    if outbox.needs[0] != 0:
        wind = flight.wind_at_rest
        if flight.flies:
            f = flight.flight
            wind = wind_at(s.Z, Velocity(f[15], f[16], f[17]), flight.wind)
        quantities = trajectory.quantities(s, wind, outbox.diameter)
        for i in range(len(quantities)):
            values[QUANTITIES + i] = quantities[i]
    if outbox.needs[1] != 0:
        _observe(outbox, flight, held, s)
    for i in range(FIRST_STATE, len(outbox.messages)):
        if outbox.wanted[i] != 0 and not _publish(c, outbox, i, now):
            return False
    return True


@inline
def _observe(outbox: Outbox, flight: Flight, held: FloatArray, s: State) -> None:
    """Write what an ideal IMU reads and the aerodynamic force and moment."""
    values, o = outbox.values, flight.observation
    for i in range(len(o)):
        o[i] = 0.0
    if flight.flies:
        observe(flight.flight, flight.plant, _control(held), flight.wind, o)
    g = flight.plant.g
    reading = imu.reading(s, (o[0], o[1], o[2]), (o[3], o[4], o[5]), outbox.imu_offset, g)
    force = frames.flip_yz((o[6], o[7], o[8]))
    moment = frames.flip_yz((o[9], o[10], o[11]))
    for i in range(len(reading)):
        values[IMU + i] = reading[i]
    for i in range(3):
        values[WRENCH + i] = force[i]
        values[WRENCH + 3 + i] = moment[i]


@inline
def _control(a: FloatArray) -> Control:
    return Control(a[0], a[1], a[2], a[3], a[4], a[5], int(a[6]))


@inline
def _publish(c: Functions, outbox: Outbox, i: int, now: int) -> bool:
    """Publish a message with the numbers that stand in `values`; return False if rcl fails."""
    sec, nanosec = now // SECOND, now % SECOND
    for k in range(outbox.first[i], outbox.first[i + 1]):
        outbox.floats[outbox.places[k]] = outbox.values[outbox.sources[k]]
    for k in range(2):
        place = outbox.stamps[i, k]
        if place >= 0:
            outbox.whole[place] = sec
            outbox.whole[place + 1] = nanosec
    return bool(call(c.publish, outbox.publishers[i], outbox.messages[i], 0, 0) == OK)


# ---- control inputs ----


@inline
def _apply(c: Functions, outbox: Outbox, inbox: Inbox, inputs: Inputs, now: int) -> bool:
    """Apply the newest commands that act from `now` on; return False if rcl fails."""
    active, values, sent = inputs.active, outbox.values, True
    for topic in range(2):
        due = count_due(inbox, topic, now)
        if due > 0:
            command = inbox.queue[topic, due - 1]
            inputs.until[topic] = now + inputs.timeout
            first = 3 if topic == MOMENT else 0
            changed = False
            for i in range(3):
                changed = changed or active[first + i] != command[i]
                active[first + i] = command[i]
            if topic == MOMENT:
                changed = changed or active[6] != command[3]
                active[6] = command[3]
            if changed:
                for i in range(len(active)):
                    inputs.held[i] = active[i]
                x, y, z = command[0], command[1], command[2]
                message = APPLIED_COEFFICIENTS
                if topic == MOMENT:
                    x, y, z = frames.flip_yz((x, y, z))
                    message = APPLIED_MOMENT + int(command[3])
                values[0], values[1], values[2] = x, y, z
                sent = _publish(c, outbox, message, now) and sent
            drop(inbox, topic, due)
    return sent
