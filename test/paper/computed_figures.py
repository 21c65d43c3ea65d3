"""The figures and the table of statements, each computed once for all tests."""

import functools

from disc_sim_ros.paper import crosscheck
from disc_sim_ros.paper.figures import FIGURES
from disc_sim_ros.paper.statements import table

__all__ = ['FIGURES', 'computed', 'example', 'judged', 'second_distance']


@functools.cache
def computed(key):
    return FIGURES[key].compute()


@functools.cache
def example(key):
    return FIGURES[key].example(computed(key)).flight


@functools.cache
def second_distance(key):
    return crosscheck.largest_distance(example(key))


@functools.cache
def judged():
    return table.evaluate()
