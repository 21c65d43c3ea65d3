"""Which topics of a bag report a motion."""

from disc_sim_ros import topics
from disc_sim_ros.analysis.odometry import ODOMETRY, POSE
from disc_sim_ros.bags.reader import Bag
from disc_sim_ros.bags.topic import full_type
from disc_sim_ros.errors import BagError

_SINGLE_STATES = (topics.RELEASE, topics.THROW)  # of type Odometry, but not a motion


def moving_topics(bag: Bag, topic: str | None) -> dict[str, str]:
    """Return the types of the topics to take motion from, by their names."""
    kinds: dict[str, list[str]] = {}
    for info in bag.topics:
        kinds.setdefault(info.name, []).append(full_type(info.type))
    if topic is not None:
        name = topic if topic in kinds else f'/{topic.strip("/")}'
        if name not in kinds:
            raise BagError(f'{bag.path}: no topic {topic}; {contents(bag)}')
        moving = [kind for kind in (ODOMETRY, POSE) if kind in kinds[name]]
        if not moving:
            raise BagError(
                f'{bag.path}: {name} is {", ".join(kinds[name])}; '
                f'motion is read from {ODOMETRY} and {POSE}'
            )
        return {name: moving[0]}
    filled = [(i.name, full_type(i.type)) for i in bag.topics if i.message_count]
    odometry = [
        name
        for name, kind in filled
        if kind == ODOMETRY and name.rpartition('/')[2] not in _SINGLE_STATES
    ]
    spaces = {name.rpartition('/')[0] for name in odometry}
    poses = [
        name for name, kind in filled if kind == POSE and name.rpartition('/')[0] not in spaces
    ]
    if not odometry and not poses:
        raise BagError(f'{bag.path}: no {ODOMETRY} or {POSE} to analyse; {contents(bag)}')
    return dict.fromkeys(odometry, str(ODOMETRY)) | dict.fromkeys(poses, str(POSE))


def contents(bag: Bag) -> str:
    """Return the topics of a bag, for an error."""
    filled = [info for info in bag.topics if info.message_count]
    return 'it holds ' + ', '.join(f'{i.topic.name} ({i.topic.type})' for i in filled)
