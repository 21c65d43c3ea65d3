"""All figures by their name for `paper_figures --only`, in the order of the report."""

from typing import Any

from disc_sim_ros.paper import (
    fig03_coefficients,
    fig04_flight_f2302,
    fig05_typical_flight,
    fig06_launch_conditions,
    fig07_range,
    fig08_duration,
    fig09_landing,
    fig10_similarity,
    fig11_12_spirals,
    rigid_body_models,
    roll_rate_law,
)
from disc_sim_ros.paper.figure_files import PaperFigure

FIGURES: dict[str, PaperFigure[Any]] = {
    figure.key: figure
    for figure in (
        fig03_coefficients.FIGURE,
        fig04_flight_f2302.FIGURE,
        fig05_typical_flight.FIGURE,
        fig06_launch_conditions.FIGURE,
        fig07_range.FIGURE,
        fig08_duration.FIGURE,
        fig09_landing.FIGURE,
        fig10_similarity.FIGURE,
        fig11_12_spirals.TURN,
        fig11_12_spirals.ROLL,
        rigid_body_models.FIGURE,
        roll_rate_law.FIGURE,
    )
}
