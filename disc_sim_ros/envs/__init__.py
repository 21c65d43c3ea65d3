"""Gymnasium environments, and what flies a learned policy without gymnasium.

`import disc_sim_ros.envs` registers `disc_sim/Throw-v0` and `disc_sim/Steer-v0` where gymnasium is
installed (the extra `envs`). Without it, `steering` and `policy` work: they need numpy only.
"""

try:
    import gymnasium as _gymnasium
except ModuleNotFoundError:  # a policy flies without it
    _gymnasium = None  # type: ignore[assignment]

if _gymnasium is not None:
    from disc_sim_ros.envs.registration import register

    register()
