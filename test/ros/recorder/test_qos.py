"""What the recorder requests of publishers with different quality of service."""

import pytest

pytest.importorskip('rclpy')

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from disc_sim_ros.ros.recorder.qos import adapt_request_to_offers, same_request


def offer(*, reliable: bool, latched: bool) -> QoSProfile:
    return QoSProfile(
        depth=1,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=(DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE),
    )


def test_every_offer_meets_the_request():
    best, least = offer(reliable=True, latched=True), offer(reliable=False, latched=False)
    assert adapt_request_to_offers([best]).reliability == ReliabilityPolicy.RELIABLE
    assert adapt_request_to_offers([best]).durability == DurabilityPolicy.TRANSIENT_LOCAL
    for offers in ([best, least], [least]):
        assert adapt_request_to_offers(offers).reliability == ReliabilityPolicy.BEST_EFFORT
        assert adapt_request_to_offers(offers).durability == DurabilityPolicy.VOLATILE


def test_requests_are_the_same_if_the_same_offers_meet_them():
    best, least = offer(reliable=True, latched=True), offer(reliable=False, latched=False)
    deeper = adapt_request_to_offers([best])  # as reliable and latched, but deeper
    assert same_request(deeper, best)
    assert not same_request(best, least)
    assert not same_request(best, offer(reliable=True, latched=False))
