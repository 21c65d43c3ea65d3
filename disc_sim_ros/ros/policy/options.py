"""The parameters of policy_node, without ROS."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from disc_sim_ros.envs import steering
from disc_sim_ros.envs.policy import Policy, load_policy, trained_policy
from disc_sim_ros.quantities import POSITION
from disc_sim_ros.ros.parameter_spec import ParameterSpec, checked

POLICY_TABLE = (
    ParameterSpec(
        'target', (24.0, 0.0), 'fixed', 'x and y of the point to land at, in `map`.', POSITION
    ),
    ParameterSpec(
        'policy', '', 'fixed', "File of weights; '' for the policy that comes with the package."
    ),
    ParameterSpec(
        'lockstep',
        False,  # noqa: FBT003
        'fixed',
        'Throw once: pause the simulator, and step it from action to action.',
    ),
)


@dataclass(frozen=True, slots=True)
class PolicyConfig:
    """All parameters of policy_node, see POLICY_TABLE."""

    target: tuple[float, float]
    policy: Policy
    lockstep: bool


def policy_config(values: Mapping[str, object]) -> PolicyConfig:
    """Return the configuration from the values of parameters, with defaults for the others.

    Raises:
        ConfigError: A value is not allowed, or the file holds no policy for Steer-v0.
    """
    v: dict[str, Any] = checked(values, POLICY_TABLE)
    sizes = len(steering.OBSERVATION), len(steering.ACTION)
    policy = load_policy(Path(v['policy']), *sizes) if v['policy'] else trained_policy()
    x, y = v['target']
    return PolicyConfig((x, y), policy, v['lockstep'])
