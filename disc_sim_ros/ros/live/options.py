"""The parameters of live_view, checked together, without ROS."""

from collections.abc import Mapping
from dataclasses import dataclass
import ipaddress
from typing import Any

from disc_sim_ros.errors import ConfigError
from disc_sim_ros.quantities import LIVE_VIEW
from disc_sim_ros.ros.parameter_spec import ParameterSpec, checked, spec_of
from disc_sim_ros.units import SYSTEMS

LOCAL = '127.0.0.1'
LIVE_TABLE = (
    ParameterSpec(
        'address',
        LOCAL,
        'fixed',
        'Address of the network interface that serves the page; 0.0.0.0 for all.',
        constraint='a numeric IPv4 or IPv6 address',
    ),
    spec_of(LIVE_VIEW['port'], 'fixed'),
    spec_of(LIVE_VIEW['page_rate'], 'fixed', 'rate'),
    ParameterSpec('units', 'metric', 'fixed', 'Units of the page.', choices=tuple(SYSTEMS)),
)


@dataclass(frozen=True, slots=True)
class LiveConfig:
    """All parameters of live_view, see LIVE_TABLE."""

    address: str
    port: int
    rate: float
    units: str

    @property
    def is_local(self) -> bool:
        """Return True if only this machine can open the page."""
        return ipaddress.ip_address(self.address).is_loopback


def live_config(values: Mapping[str, object]) -> LiveConfig:
    """Return the configuration from the values of parameters, with defaults for the others.

    Raises:
        ConfigError: A value is not allowed.
    """
    v: dict[str, Any] = checked(values, LIVE_TABLE)
    try:
        ipaddress.ip_address(v['address'])
    except ValueError:
        allowed = f'give a numeric address, such as {LOCAL}'
        raise ConfigError('address', v['address'], allowed) from None
    return LiveConfig(**v)
