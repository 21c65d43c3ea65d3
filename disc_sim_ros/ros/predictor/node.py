"""`predictor_node`: predicts where a disc lands, from measurements that arrive while it flies."""

from collections.abc import Sequence
from dataclasses import replace
import sys
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import (
    PointStamped,
    PoseStamped,
    PoseWithCovarianceStamped,
    Vector3Stamped,
)
from nav_msgs.msg import Odometry, Path
import numpy as np
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from visualization_msgs.msg import MarkerArray

from disc_sim_ros import topics
from disc_sim_ros.errors import ConfigError
from disc_sim_ros.estimation.prediction.predictor import Prediction, Predictor, first_call_note
from disc_sim_ros.ros import node_main, parameters
from disc_sim_ros.ros.internals import PolledSubscription
from disc_sim_ros.ros.predictor import outputs
from disc_sim_ros.ros.predictor.measured import measurement, stamp_of
from disc_sim_ros.ros.predictor.options import PREDICTOR_TABLE, node_config
from disc_sim_ros.ros.qos import MEASUREMENT_QOS, STATE_QOS
from disc_sim_ros.ros.recorder.polling_thread import PollingThread
from disc_sim_ros.topics import Frames, PredictorTopic
from disc_sim_ros.units import NANOSECONDS

POLLING_PERIOD = 0.001  # s
DIAGNOSTIC_PERIOD = 1.0  # s
SILENCE = 0.5  # s without a measurement in a throw, which is told
_TYPES = {
    'point': (PointStamped, PredictorTopic.MEASURED_POINT),
    'pose': (PoseStamped, PredictorTopic.MEASURED_POSE),
    'pose_with_covariance': (
        PoseWithCovarianceStamped,
        PredictorTopic.MEASURED_POSE_WITH_COVARIANCE,
    ),
    'odom': (Odometry, topics.ODOM),
}
_NOISE_SEED = 0


class PredictorNode(Node):
    """Takes measurements on a thread of its own, and predicts from all that have arrived.

    Attributes:
        predictions: Number of predictions so far.
        refused: Number of measurements that were refused so far.
    """

    def __init__(self, **kwargs: Any) -> None:
        """Compile and subscribe; `start` begins to predict, while the node spins.

        Raises:
            ConfigError: A parameter is not allowed.
        """
        super().__init__('predictor_node', **kwargs)
        parameters.declare(self, PREDICTOR_TABLE)
        self._config = node_config(parameters.values(self, PREDICTOR_TABLE))
        self._frames = Frames()
        self._ground = self._config.predictor.ground_height
        self._predictor = Predictor(self._config.predictor)
        self._noise = np.random.default_rng(_NOISE_SEED)
        self._epoch: int | None = None
        self._last_ellipse = -np.inf
        self._throw = 0
        self._measured_at = time.monotonic()
        self._flies_on = 0.0  # s from the last prediction to its landing
        self._covariance = np.full((3, 3), np.nan)
        self._likely: dict[str, float] = {}  # weight of each disc, by its name
        self.predictions = self.refused = 0
        # Before topics exist: who sees them may throw.
        if note := first_call_note():
            self.get_logger().info(note)
        self._predictor.warm_up()

        def publisher(kind: type, name: str) -> Any:
            return self.create_publisher(kind, name, STATE_QOS)

        self._landing = publisher(PoseWithCovarianceStamped, PredictorTopic.LANDING)
        self._path = publisher(Path, PredictorTopic.PATH)
        self._estimate = publisher(Odometry, PredictorTopic.ESTIMATE)
        self._ellipse = publisher(MarkerArray, PredictorTopic.ELLIPSE)
        self._intercept = publisher(PoseStamped, PredictorTopic.INTERCEPT)
        self._wind = publisher(Vector3Stamped, PredictorTopic.WIND)
        self._weights = publisher(DiagnosticStatus, PredictorTopic.DISC_WEIGHTS)
        self._diagnostics = publisher(DiagnosticArray, topics.DIAGNOSTICS)
        self._subscriptions_by_source = {
            source: PolledSubscription(self, *_TYPES[source], MEASUREMENT_QOS)
            for source in self._config.sources
        }
        parameters.refuse_unused(self)
        self._thread = PollingThread(self._take, POLLING_PERIOD)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(DIAGNOSTIC_PERIOD, self._publish_diagnostics, clock=steady)
        discs = ' or '.join(self._config.predictor.discs)
        self.get_logger().info(f'ready: {", ".join(self._config.sources)}, {discs}')

    def start(self) -> None:
        """Start the thread that predicts."""
        self._thread.start()

    @property
    def is_working(self) -> bool:
        """Return True while the thread runs."""
        return self._thread.is_alive()

    def stop(self) -> str:
        """End the thread.

        Raises:
            DiscSimError: It ended early.
        """
        self._thread.end()
        if self._thread.failure is not None:
            raise self._thread.failure
        return ''

    # ---- the thread ----

    def _take(self) -> bool:
        """Take all that has arrived, then predict once: a late node skips, it does not queue."""
        added = False
        for source, subscription in self._subscriptions_by_source.items():
            while (taken := subscription.take()) is not None:
                added |= self._add(source, taken[0])
        if added:
            self._measured_at = time.monotonic()
            self._predict()
        return False

    def _add(self, source: str, message: Any) -> bool:
        try:
            stamp = stamp_of(source, message)
            if self._epoch is None:
                self._epoch = stamp
            m = measurement(source, message, self._config, (stamp - self._epoch) / NANOSECONDS)
            if self._config.added_noise > 0.0:
                x, y, z = np.add(m.position, self._noise.normal(0.0, self._config.added_noise, 3))
                m = type(m)(m.time, (float(x), float(y), float(z)), m.axis, m.position_sigma)
        except ConfigError as error:
            self.refused += 1
            self.get_logger().warning(f'refused: {error}', throttle_duration_sec=1.0)
            return False
        return self._predictor.add(m)

    def _predict(self) -> None:
        newest = self._predictor.newest
        last, period = self._last_ellipse, self._config.ellipse_period
        prediction = self._predictor.update(ellipse=not last <= newest < last + period)
        if prediction is None:
            return
        self._publish(prediction)
        self.predictions += 1
        self._flies_on = prediction.landing_time - prediction.time
        if prediction.throw != self._throw:
            self._throw = prediction.throw
            self.get_logger().info(f'throw {self._throw}: following')

    def _publish(self, p: Prediction) -> None:
        now, ground, frames = self._stamp(p.time), self._ground, self._frames
        has_ellipse = bool(np.isfinite(p.covariance).all())
        if has_ellipse:
            self._last_ellipse, self._covariance = p.time, p.covariance
            self._ellipse.publish(outputs.ellipses(p, now, ground, frames))
        else:
            p = replace(p, covariance=self._covariance)
        self._landing.publish(outputs.landing(p, self._stamp(p.landing_time), ground, frames))
        self._estimate.publish(outputs.estimate(p, now, ground, frames))
        self._wind.publish(outputs.wind(p, now, frames))
        if has_ellipse:
            self._publish_rarely(p)

    def _publish_rarely(self, p: Prediction) -> None:
        discs = self._config.predictor.discs
        self._likely = dict(zip(discs, p.weights.tolist(), strict=True))
        if len(discs) > 1:
            self._weights.publish(outputs.disc_weights(p.throw, self._likely))
        if self._config.path_rate <= 0.0:
            return
        times, states = self._predictor.path(p, self._config.path_rate)
        path = outputs.path([self._stamp(t) for t in times], states, self._ground, self._frames)
        self._path.publish(path)
        crossing = outputs.intercept(path, self._config.plane)
        if crossing is not None:
            self._intercept.publish(crossing)

    def _stamp(self, time: float) -> int:
        return max(0, (self._epoch or 0) + round(time * NANOSECONDS))

    def _doing(self) -> tuple[bool, str]:
        """Return whether all is well, and what this node does."""
        if not self._predictor.is_following:
            return True, 'waiting for a throw'
        silent = time.monotonic() - self._measured_at
        if silent < SILENCE:
            return True, 'following a throw'
        if silent > self._flies_on + SILENCE:
            return True, 'waiting for a throw: the last one must have landed'
        return False, f'in a throw of which nothing was measured for {silent:.1f} s'

    def _publish_diagnostics(self) -> None:
        well, doing = self._doing()
        values: dict[str, object] = {
            'throws': self._predictor.throws,
            'predictions': self.predictions,
            'refused measurements': self.refused,
            'late or repeated measurements': self._predictor.late,
        }
        if len(self._likely) > 1:
            weights = outputs.disc_weights(self._throw, self._likely).values
            values |= {f'weight of {v.key}': v.value for v in weights}
        status = DiagnosticStatus(
            level=DiagnosticStatus.OK if well else DiagnosticStatus.WARN,
            name=f'{self.get_fully_qualified_name()}: prediction',
            message=doing,
            values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(message)


def main(args: Sequence[str] | None = None) -> int:
    """Predict until Ctrl-C or SIGTERM.

    Returns:
        The exit code: 0, 1 if the node failed, 2 for bad arguments or parameters.
    """
    return node_main.run('predictor_node', PredictorNode, args)


if __name__ == '__main__':
    sys.exit(main())
