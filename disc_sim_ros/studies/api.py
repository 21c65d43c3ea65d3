"""The names that a script about ensembles of flights needs; docs/sweep.md has examples."""

from disc_sim_ros.studies.executors import opened
from disc_sim_ros.studies.flying import good_step
from disc_sim_ros.studies.optimise import Optimum, Problem, optimise
from disc_sim_ros.studies.report import summary_document, summary_text
from disc_sim_ros.studies.runner import InterruptedSweepError, collect, sweep
from disc_sim_ros.studies.scatter import Normal, Uniform
from disc_sim_ros.studies.study import Study
from disc_sim_ros.studies.summary import Summary, summarise
from disc_sim_ros.studies.tables import chunks, stored_study

__all__ = [
    'InterruptedSweepError',
    'Normal',
    'Optimum',
    'Problem',
    'Study',
    'Summary',
    'Uniform',
    'chunks',
    'collect',
    'good_step',
    'opened',
    'optimise',
    'stored_study',
    'summarise',
    'summary_document',
    'summary_text',
    'sweep',
]
