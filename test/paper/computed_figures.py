"""The figures and the table of statements, each computed once for all tests."""

import functools

from disc_sim_ros.paper.figures import FIGURES
from disc_sim_ros.paper.statements import table

__all__ = ['FIGURES', 'computed', 'judged']


@functools.cache
def computed(key):
    return FIGURES[key].compute()


@functools.cache
def judged():
    return table.evaluate()
