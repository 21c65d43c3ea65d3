"""The standard services of simulation_interfaces, where that package is installed."""
