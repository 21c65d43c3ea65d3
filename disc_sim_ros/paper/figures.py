"""All figures, by what `paper_figures --only` calls them, in the order of the report."""

from types import ModuleType

from disc_sim_ros.paper import (
    fig03_coefficients,
    fig04_flight_f2302,
    fig05_typical_flight,
    fig06_launch_conditions,
    fig07_range,
    fig08_duration,
    fig09_landing,
    fig10_similarity,
    fig11_spiral_turn,
    fig12_spiral_roll,
    rigid_body_models,
    roll_rate_law,
)

FIGURES: dict[str, ModuleType] = {
    module.KEY: module
    for module in (
        fig03_coefficients,
        fig04_flight_f2302,
        fig05_typical_flight,
        fig06_launch_conditions,
        fig07_range,
        fig08_duration,
        fig09_landing,
        fig10_similarity,
        fig11_spiral_turn,
        fig12_spiral_roll,
        rigid_body_models,
        roll_rate_law,
    )
}
