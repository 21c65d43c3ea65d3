"""Nodes for further types of a topic, of which the middleware takes one for each participant."""

from rclpy.context import Context
from rclpy.node import Node


class ExtraNodes:
    """Makes hidden nodes, each in a context of its own, where a topic has several types.

    Attributes:
        nodes: Those made so far; the n-th takes the type n + 2 of any topic.
    """

    def __init__(self, node: Node) -> None:
        """Prepare; `node` is the one that takes the first type of each topic."""
        self.nodes: list[Node] = []
        self._first = node

    def of(self, number: int) -> Node:
        """Return the node for a type of a topic, `number` 0 for the first that was recorded."""
        while len(self.nodes) < number:
            context = Context()
            context.init(domain_id=self._first.context.get_domain_id())
            self.nodes.append(
                Node(
                    f'_{self._first.get_name()}_{len(self.nodes) + 2}',
                    namespace=self._first.get_namespace(),
                    context=context,
                    use_global_arguments=False,
                    enable_rosout=False,
                    start_parameter_services=False,
                )
            )
        return self.nodes[number - 1] if number else self._first

    def close(self) -> None:
        """Destroy the nodes and end their contexts."""
        for node in self.nodes:
            node.destroy_node()
            node.context.try_shutdown()
        self.nodes = []
