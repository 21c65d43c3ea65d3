"""The names under which gymnasium makes the environments."""

import gymnasium

_CLASSES = {
    'disc_sim/Throw-v0': ('throw', 'ThrowEnv', 'ThrowVectorEnv'),
    'disc_sim/Steer-v0': ('steer', 'SteerEnv', 'SteerVectorEnv'),
}


def register() -> None:
    """Register every environment, once."""
    for name, (module, single, vector) in _CLASSES.items():
        if name not in gymnasium.registry:
            gymnasium.register(
                name,
                entry_point=f'disc_sim_ros.envs.{module}:{single}',
                vector_entry_point=f'disc_sim_ros.envs.{module}:{vector}',
            )
