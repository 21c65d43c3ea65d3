"""The topics of DDS that the policies of SROS 2 in security/policies allow."""

from dataclasses import dataclass
from pathlib import Path
import xml.etree.ElementTree as ET

POLICIES = Path(__file__).parents[2] / 'security/policies'
GRAPH = 'ros_discovery_info'  # the topic of the ROS graph: every participant needs it
_SERVICES = ('send_goal', 'cancel_goal', 'get_result')  # of an action
_REQUESTS = tuple(f'rq{{}}/_action/{name}Request' for name in _SERVICES)
_ANSWERS = tuple(f'rr{{}}/_action/{name}Reply' for name in _SERVICES)
_REPORTS = ('rt{}/_action/feedback', 'rt{}/_action/status')
# A permission of a policy as topics of DDS: patterns to publish and to subscribe to.
TOPICS_OF = {
    ('topics', 'publish'): (('rt{}',), ()),
    ('topics', 'subscribe'): ((), ('rt{}',)),
    ('services', 'reply'): (('rr{}Reply',), ('rq{}Request',)),
    ('services', 'request'): (('rq{}Request',), ('rr{}Reply',)),
    ('actions', 'execute'): (_ANSWERS + _REPORTS, _REQUESTS),
    ('actions', 'call'): (_REQUESTS, _ANSWERS + _REPORTS),
}


@dataclass(frozen=True)
class Enclave:
    """The topics of DDS that one enclave may publish and subscribe to; * is a wildcard."""

    publish: frozenset[str]
    subscribe: frozenset[str]


def read_policy(name: str, folder: Path = POLICIES) -> Enclave:
    """Return the enclave of a policy file, for nodes in the namespace /.

    Raises:
        KeyError: The file has a permission that is not in TOPICS_OF, such as a DENY.
    """
    root = ET.parse(folder / f'{name}.xml').getroot()
    assert (root.tag, root.get('version')) == ('policy', '0.2.0')
    (enclave,) = root.findall('enclaves/enclave')
    assert enclave.get('path') == f'/disc_sim/{name}'
    publish, subscribe = {GRAPH}, {GRAPH}
    for profile in enclave.findall('profiles/profile'):
        node = profile.attrib['node']
        for rule in profile:
            ((verb, answer),) = rule.attrib.items()
            sent, received = TOPICS_OF[rule.tag, verb if answer == 'ALLOW' else answer]
            names = [full_name(node, item.text or '') for item in rule]
            publish |= {pattern.format(name) for pattern in sent for name in names}
            subscribe |= {pattern.format(name) for pattern in received for name in names}
    return Enclave(frozenset(publish), frozenset(subscribe))


def full_name(node: str, name: str) -> str:
    """Return the full name of a topic or service of a node in the namespace /."""
    if name.startswith('/'):
        return name
    return f'/{node}{name[1:]}' if name.startswith('~') else f'/{name}'
