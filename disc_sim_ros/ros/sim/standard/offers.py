"""What simulation_interfaces has: the types that a simulator of one disc can offer."""

import re
from typing import Any, NamedTuple

from disc_sim_ros.ros.sim.standard.rules import Feature

try:  # not among the wheels on PyPI
    from simulation_interfaces import action, msg, srv
except ImportError:
    action = msg = srv = None


class Offer(NamedTuple):
    """One service or action.

    Attributes:
        type_name: Name of the type.
        features: What it lets the simulator claim.
        module: The module with its type, or None if the package is not installed.
    """

    type_name: str
    features: tuple[Feature, ...] = ()
    module: Any = srv

    @property
    def name(self) -> str:
        """Return the standard name: that of the type in lower case, words joined by _."""
        return re.sub('(?<=.)(?=[A-Z])', '_', self.type_name).lower()

    @property
    def is_action(self) -> bool:
        """Return True for an action, False for a service."""
        return self.module is action

    def type(self) -> Any:
        """Return the type, or None if the installed version lacks it."""
        return getattr(self.module, self.type_name, None)


OFFERS = (
    Offer('GetSimulatorFeatures'),
    Offer('GetSimulationState', (Feature.SIMULATION_STATE_GETTING,)),
    Offer(
        'SetSimulationState',
        (Feature.SIMULATION_STATE_SETTING, Feature.SIMULATION_STATE_PAUSE),
    ),
    Offer(
        'ResetSimulation',
        (
            Feature.SIMULATION_RESET,
            Feature.SIMULATION_RESET_STATE,
        ),
    ),
    Offer(
        'StepSimulation',
        (Feature.STEP_SIMULATION_SINGLE, Feature.STEP_SIMULATION_MULTIPLE),
    ),
    Offer(
        'SimulateSteps',
        (Feature.STEP_SIMULATION_MULTIPLE, Feature.STEP_SIMULATION_ACTION),
        action,
    ),
    Offer('GetEntities', (Feature.ENTITY_CATEGORIES,)),
    Offer('GetEntitiesStates'),
    Offer('GetEntityState', (Feature.ENTITY_STATE_GETTING,)),
    Offer('SetEntityState', (Feature.ENTITY_STATE_SETTING,)),
    Offer('GetEntityInfo', (Feature.ENTITY_INFO_GETTING,)),
)


def is_installed() -> bool:
    """Return True if the package simulation_interfaces is installed."""
    return srv is not None


def new_entity_state() -> Any:
    """Return an empty simulation_interfaces/EntityState."""
    return msg.EntityState()
