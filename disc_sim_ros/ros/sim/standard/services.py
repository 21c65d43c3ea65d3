"""The services and the action of simulation_interfaces, under their standard names."""

from collections.abc import Callable
import concurrent.futures
from contextlib import suppress
import math
import time
from typing import Any

from rclpy.action.server import ActionServer, CancelResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.task import Future

from disc_sim_ros import __version__, topics
from disc_sim_ros.errors import ConfigError, DiscSimError, brief
from disc_sim_ros.physics import frames as paper_frames
from disc_sim_ros.physics.kernels.equations import State
from disc_sim_ros.physics.kernels.integrator import Observation
from disc_sim_ros.physics.launch import require_above_ground
from disc_sim_ros.ros import messages
from disc_sim_ros.ros.cdr_template import assign
from disc_sim_ros.ros.sim.loop import SimLoop
from disc_sim_ros.ros.sim.standard import rules
from disc_sim_ros.ros.sim.standard.offers import OFFERS, is_installed, new_entity_state
from disc_sim_ros.ros.sim.standard.rules import DONE, Answer, Code, Feature, SimState

GOODBYE = 0.3  # s until the program ends that a client has asked to quit, for the response
LONGEST_BATCH = 10_000  # steps of a batch, if wall time does not end it before
FEEDBACK_BATCH = 10  # steps until their feedback is published: a client keeps 10 by default
FEEDBACK_DEPTH = 1000
_SOURCE = 'set_entity_state'  # of a release, in its event
_MOTION = ('twist.linear', 'twist.angular', 'acceleration.linear', 'acceleration.angular')
_Entity = tuple[int, State, Observation]  # stamp [ns]


def offer_standard_services(
    node: Node, loop: SimLoop, frames: topics.Frames
) -> 'StandardServices | None':
    """Offer the standard services of a node; None if simulation_interfaces is not installed."""
    return StandardServices(node, loop, frames) if is_installed() else None


class StandardServices:
    """Offers the types that the installed version of simulation_interfaces has.

    No callback waits for the simulation: the executor goes on meanwhile. They run in a group of
    their own, so that they do not keep back the other callbacks of the node either.

    Attributes:
        offered: The names of what is offered.
        end: When the program has to end because a client has asked for it; steady clock [s].
    """

    def __init__(self, node: Node, loop: SimLoop, frames: topics.Frames) -> None:
        """Create the services; log the types that the installed version lacks."""
        self._node = node
        self._loop = loop
        self._frames = frames
        self._matcher = concurrent.futures.ThreadPoolExecutor(1, 'matcher')
        self._stepping = False
        self._interruption = ''
        self.end = math.inf
        self._features: set[Feature] = set()
        self.offered: list[str] = []
        missing = []
        group = ReentrantCallbackGroup()
        for offer in OFFERS:
            interface = offer.type()
            if interface is None:
                missing.append(offer.type_name)
                continue
            handler = getattr(self, f'_{offer.name}')
            if offer.is_action:
                self._steps_type = interface
                self._action = ActionServer(
                    node,
                    interface,
                    offer.name,
                    handler,
                    callback_group=group,
                    cancel_callback=lambda _: CancelResponse.ACCEPT,
                    feedback_pub_qos_profile=QoSProfile(depth=FEEDBACK_DEPTH),
                )
            else:
                node.create_service(interface, offer.name, handler, callback_group=group)
            self.offered.append(offer.name)
            self._features.update(offer.features)
        if missing:
            node.get_logger().info(
                f'the installed simulation_interfaces has no {", ".join(missing)}: not offered'
            )

    @property
    def entity(self) -> str:
        """Return the name of the only entity, the disc: that of its frame."""
        return self._frames.disc

    @property
    def state(self) -> SimState:
        """Return the state of the simulation."""
        if self.end < math.inf:
            return SimState.QUITTING
        if self._loop.stopped:
            return SimState.STOPPED
        paused = self._loop.paused and not self._stepping
        return SimState.PAUSED if paused else SimState.PLAYING

    # ---- the simulation ----

    def _get_simulator_features(self, _: Any, response: Any) -> Any:
        response.features.features = sorted(self._features)
        period = self._loop.config.publish_period
        response.features.custom_info = (
            f'disc_sim_ros {__version__}; one step is {period:g} s, the period of publish_rate'
        )
        return response

    def _get_simulation_state(self, _: Any, response: Any) -> Any:
        response.state.state = self.state
        return _answered(response, DONE)

    async def _set_simulation_state(self, request: Any, response: Any) -> Any:
        target = int(request.state.state)

        def change() -> Answer:
            answer = rules.transition(self.state, target)
            if answer is not DONE:
                return answer
            self._interruption = f'set_simulation_state {target}'
            if target == SimState.PLAYING:
                self._loop.resume()
            elif target == SimState.PAUSED:
                self._loop.pause()
            else:
                self._loop.stop()
            return DONE

        answer = await self._on_simulation(change)
        if answer is DONE and target == SimState.QUITTING:
            self.end = time.monotonic() + GOODBYE
        return _answered(response, answer)

    async def _reset_simulation(self, request: Any, response: Any) -> Any:
        answer = rules.check_scope(int(request.scope))
        if answer.code == Code.OK:

            def reset() -> Answer:
                self._interruption = 'reset_simulation'
                self._loop.restart()
                return answer

            answer = await self._on_simulation(reset)
        return _answered(response, answer)

    async def _step_simulation(self, request: Any, response: Any) -> Any:
        return _answered(response, await self._steps(int(request.steps)))

    async def _simulate_steps(self, goal: Any) -> Any:
        feedback = self._steps_type.Feedback
        steps = int(goal.request.steps)

        def report(done: int) -> bool:
            goal.publish_feedback(feedback(completed_steps=done, remaining_steps=steps - done))
            return not goal.is_cancel_requested

        answer = await self._steps(steps, report)
        if goal.is_cancel_requested:
            goal.canceled()
        elif answer is DONE:
            goal.succeed()
        else:
            goal.abort()
        return _answered(self._steps_type.Result(), answer)

    async def _steps(self, steps: int, report: Callable[[int], bool] | None = None) -> Answer:
        """Make steps in batches; `report(done)` after each returns whether to go on."""
        answer = rules.check_steps(steps, self.state)
        if answer is not DONE:
            return answer
        self._stepping, self._interruption = True, ''
        longest = LONGEST_BATCH if report is None else FEEDBACK_BATCH
        done = 0

        def batch() -> int:  # none after a reset, which runs on the same thread
            return 0 if self._interruption else self._loop.steps(min(steps - done, longest))

        try:
            while done < steps:
                made = await self._on_simulation(batch)
                if isinstance(made, Answer):
                    return made
                goes_on = True
                for k in range(made):
                    goes_on = report is None or report(done + k + 1)
                done += made
                if done < steps and (self._interruption or not goes_on):
                    cause = self._interruption or 'a cancellation'
                    return Answer(
                        Code.OPERATION_FAILED, f'{done} of {steps} steps were made until {cause}'
                    )
        finally:
            self._stepping = False
        return DONE

    # ---- the disc ----

    async def _get_entities(self, request: Any, response: Any) -> Any:
        answer, names, _ = await self._matching(request.filters)
        response.entities = names
        return _answered(response, answer)

    async def _get_entities_states(self, request: Any, response: Any) -> Any:
        answer, names, entity = await self._matching(request.filters)
        if entity is not None:
            message = new_entity_state()
            self._fill(message, entity)
            response.entities, response.states = names, [message]
        return _answered(response, answer)

    async def _get_entity_state(self, request: Any, response: Any) -> Any:
        answer = self._named(request.entity)
        if answer is DONE:
            self._fill(response.state, await self._on_simulation(self._loop.snapshot))
        return _answered(response, answer)

    async def _set_entity_state(self, request: Any, response: Any) -> Any:
        answer = self._named(request.entity)
        if answer is DONE:
            answer = await self._on_simulation(lambda: self._place(request))
        invalid_pose = getattr(type(response), 'INVALID_POSE', int(Code.OPERATION_FAILED))
        if answer.code == rules.INVALID_POSE:
            answer = answer._replace(code=invalid_pose)
        return _answered(response, answer)

    def _get_entity_info(self, request: Any, response: Any) -> Any:
        answer = self._named(request.entity)
        if answer is DONE:
            disc = self._loop.config.setup.disc
            response.info.category.category = rules.Category.DYNAMIC_OBJECT
            response.info.description = (
                f'{disc.name}: a disc of {disc.mass:g} kg and {disc.diameter:g} m'
            )
        return _answered(response, answer)

    def _named(self, name: str) -> Answer:
        if name == self.entity:
            return DONE
        return Answer(Code.NOT_FOUND, f'entity: {brief(name)} is unknown; give {self.entity}')

    def _place(self, request: Any) -> Answer:
        """Put the disc into a state, on the simulation thread."""
        s, state = self._loop.snapshot()[1], request.state
        e = s.e0, s.e1, s.e2, s.e3
        try:  # versions without the flags set both
            if getattr(request, 'set_pose', True):
                (X, Y, Z), e = messages.pose_from_entity(state, self._frames)
                if self._loop.config.ground:
                    require_above_ground(paper_frames.flip(Z))
                s = s._replace(X=X, Y=Y, Z=Z, e0=e[0], e1=e[1], e2=e[2], e3=e[3])
        except ConfigError as error:
            return Answer(rules.INVALID_POSE, str(error))
        releases = False
        if getattr(request, 'set_twist', True):
            (VX, VY, VZ), (p, q, r) = messages.twist_from_entity(state, e, self._frames)
            s = s._replace(VX=VX, VY=VY, VZ=VZ, p=p, q=q, r=r)
            releases = any((VX, VY, VZ, p, q, r))
        if s != self._loop.snapshot()[1] or releases:
            self._loop.place(s, release=releases, source=_SOURCE)
        return DONE

    async def _matching(self, filters: Any) -> tuple[Answer, list[str], _Entity | None]:
        """Return the entities that pass the filters: the disc or none."""
        nothing: list[str] = []
        if filters.tags.tags:
            return Answer(Code.FEATURE_UNSUPPORTED, 'filters.tags: no tags'), nothing, None
        match = self._matcher.submit(rules.match_name, self.entity, filters.filter)
        answer, matches = await self._result(match)
        categories = {int(category.category) for category in filters.categories}
        matches = matches and (not categories or rules.Category.DYNAMIC_OBJECT in categories)
        entity = await self._on_simulation(self._loop.snapshot)
        if answer is DONE and filters.bounds.type:
            answer, inside = self._in_bounds(filters.bounds, entity[1])
            matches = matches and inside
        if answer is not DONE or not matches:
            return answer, nothing, None
        return DONE, [self.entity], entity

    def _in_bounds(self, bounds: Any, s: State) -> tuple[Answer, bool]:
        if bounds.type != rules.SPHERE:
            text = f'filters.bounds.type: {bounds.type} is not possible; give 3, a sphere'
            return Answer(Code.FEATURE_UNSUPPORTED, text), False
        numbers = [getattr(point, axis) for point in bounds.points for axis in 'xyz']
        if len(numbers) != 6 or not all(map(math.isfinite, numbers[:4])) or numbers[3] < 0.0:
            text = 'filters.bounds.points: give a centre and, as x of a second point, a radius'
            return Answer(Code.OPERATION_FAILED, text), False
        X, Y, Z = paper_frames.flip_yz((numbers[0], numbers[1], numbers[2]))
        centre = paper_frames.body_from_earth(
            (s.e0, s.e1, s.e2, s.e3), (X - s.X, Y - s.Y, Z - s.Z)
        )
        radius = self._loop.config.setup.disc.diameter / 2
        return DONE, rules.overlaps_sphere(radius, centre, numbers[3])

    def _fill(self, message: Any, entity: _Entity) -> None:
        """Fill an EntityState: everything in `map`, as the standard demands."""
        stamp, s, rates = entity
        message.header.frame_id = self._frames.map
        message.header.stamp.sec, message.header.stamp.nanosec = messages.stamp(stamp)
        for path, value in zip(messages.POSE_FIELDS, messages.pose(s), strict=True):
            assign(message, path, value)
        motion = paper_frames.motion_in_map(s, rates[:3], rates[3:6])
        for path, vector in zip(_MOTION, motion.tolist(), strict=True):
            for axis, value in zip('xyz', vector, strict=True):
                assign(message, f'{path}.{axis}', value)

    # ---- the simulation thread ----

    async def _on_simulation(self, action: Callable[[], Any]) -> Any:
        """Return the result of an action on the simulation thread, or an Answer if it fails."""

        def act() -> Any:
            try:
                return action()
            except DiscSimError as error:
                return Answer(Code.OPERATION_FAILED, str(error))

        return await self._result(self._loop.submit(act))

    async def _result(self, pending: concurrent.futures.Future[Any]) -> Any:
        """Return the result that another thread will set; the executor goes on meanwhile."""
        executor = self._node.executor
        future = Future(executor=executor)

        def finish(done: concurrent.futures.Future[Any]) -> None:
            future.set_result(done.result())
            if executor is not None:
                with suppress(RuntimeError):  # rclpy's, once it is shut down
                    executor.wake()

        pending.add_done_callback(finish)
        return await future


def _answered(response: Any, answer: Answer) -> Any:
    response.result.result = int(answer.code)
    response.result.error_message = answer.text
    return response
