"""All that a script about ensembles needs, under one roof; docs/sweep.md has examples."""

from disc_sim_ros.analysis.ensembles.executors import opened
from disc_sim_ros.analysis.ensembles.flying import good_step
from disc_sim_ros.analysis.ensembles.optimise import Optimum, Problem, optimise
from disc_sim_ros.analysis.ensembles.question import Question
from disc_sim_ros.analysis.ensembles.run import InterruptedSweepError, collect, sweep
from disc_sim_ros.analysis.ensembles.scatter import Normal, Uniform
from disc_sim_ros.analysis.ensembles.summary import Summary, summarise
from disc_sim_ros.analysis.ensembles.tables import chunks, stored_question
from disc_sim_ros.analysis.ensembles.texts import summary_document, summary_text

__all__ = [
    'InterruptedSweepError',
    'Normal',
    'Optimum',
    'Problem',
    'Question',
    'Summary',
    'Uniform',
    'chunks',
    'collect',
    'good_step',
    'opened',
    'optimise',
    'stored_question',
    'summarise',
    'summary_document',
    'summary_text',
    'sweep',
]
