"""The services of sim_node: each asks the simulation thread to act and answers with the result."""

from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger

from disc_sim_ros.errors import DiscSimError
from disc_sim_ros.ros.sim.loop import SimLoop

PATIENCE = 5.0  # s, for the simulation thread to act


def create_services(node: Node, loop: SimLoop) -> None:
    """Create the services of a node that control a simulation."""

    def act(action: Callable[[], str], response: Any) -> Any:
        future = loop.submit(action)
        try:
            response.message = future.result(PATIENCE)
            response.success = True
        except TimeoutError:
            late = '' if future.cancel() else ', but has begun to act'
            response.message = f'the simulation did not answer within {PATIENCE:g} s{late}'
        except DiscSimError as error:
            response.message = str(error)
        return response

    def trigger(action: Callable[[], str]) -> Callable[[Any, Any], Any]:
        return lambda _, response: act(action, response)

    def pause(request: Any, response: Any) -> Any:
        return act(loop.pause if request.data else loop.resume, response)

    node.create_service(Trigger, '~/throw', trigger(loop.throw))
    node.create_service(Trigger, '~/reset', trigger(loop.reset))
    node.create_service(Trigger, '~/step', trigger(loop.step))
    node.create_service(SetBool, '~/pause', pause)
