"""A learned policy as a file of weights, and its arithmetic in numpy alone."""

from dataclasses import dataclass
import io
import itertools
from pathlib import Path
from typing import Any
import zipfile

import numpy as np

from disc_sim_ros import files
from disc_sim_ros.envs import steering
from disc_sim_ros.envs.components import Float32Array
from disc_sim_ros.errors import ConfigError

Layer = tuple[Float32Array, Float32Array]  # weights, shape (inputs, outputs), and biases
_MOST_LAYERS = 20
TRAINED = Path(__file__).parent / 'policies' / 'steer.npz'


@dataclass(frozen=True, slots=True, eq=False)
class Policy:
    """A network of rectified linear layers whose last layer is linear, clipped to -1 and 1.

    Attributes:
        mean: Subtracted from observations, shape (n,).
        scale: Then multiplied by, shape (n,).
        clip: Then clipped to -clip and clip.
        layers: Weights and biases of each layer.
    """

    mean: Float32Array
    scale: Float32Array
    clip: float
    layers: tuple[Layer, ...]

    def __call__(self, observations: Float32Array) -> Float32Array:
        """Return actions, shape (m, outputs), for observations, shape (m, n).

        The same observations give the same bits on one machine if `m` is the same; a matrix
        product may round otherwise for another `m`.
        """
        x = ((observations - self.mean) * self.scale).clip(-self.clip, self.clip)
        for weights, biases in self.layers[:-1]:
            x = np.maximum(x @ weights + biases, 0.0)
        weights, biases = self.layers[-1]
        actions: Float32Array = (x @ weights + biases).clip(-1.0, 1.0)
        return actions

    def save(self, path: Path) -> None:
        """Write the weights to an .npz file.

        Raises:
            OSError: The file cannot be written.
        """
        arrays: dict[str, Any] = {'mean': self.mean, 'scale': self.scale}
        arrays['clip'] = np.float32(self.clip)
        for i, (weights, biases) in enumerate(self.layers):
            arrays |= {f'weights_{i}': weights, f'biases_{i}': biases}
        buffer = io.BytesIO()
        np.savez(buffer, **arrays)
        files.write_whole(path, buffer.getvalue())


def trained_policy() -> Policy:
    """Return the policy for Steer-v0 that comes with the package."""
    return load_policy(TRAINED, len(steering.OBSERVATION), len(steering.ACTION))


def load_policy(path: Path, inputs: int, outputs: int) -> Policy:
    """Read a policy.

    Args:
        path: A file that `Policy.save` wrote.
        inputs: Numbers of an observation.
        outputs: Numbers of an action.

    Raises:
        ConfigError: The file cannot be read, is no policy or is one for other spaces.
    """
    try:
        content = io.BytesIO(path.read_bytes())
        if not zipfile.is_zipfile(content):
            raise ValueError('it is no archive')  # noqa: TRY301
        with np.load(content, allow_pickle=False) as stored:
            arrays = {name: np.asarray(stored[name], dtype=np.float32) for name in stored.files}
    except (OSError, ValueError, EOFError, zipfile.BadZipFile) as error:
        raise ConfigError('policy', str(path), f'give an .npz file of weights ({error})') from None
    count = sum(name.startswith('weights_') for name in arrays)
    names = {'mean', 'scale', 'clip'}
    names |= {f'{kind}_{i}' for kind in ('weights', 'biases') for i in range(count)}
    if set(arrays) != names or not 0 < count <= _MOST_LAYERS:
        raise ConfigError('policy', str(path), 'its arrays are not those of a policy')
    layers = tuple((arrays[f'weights_{i}'], arrays[f'biases_{i}']) for i in range(count))
    sizes = [inputs, *(biases.size for _, biases in layers)]
    shapes = [weights.shape for weights, _ in layers]
    vectors = (arrays['mean'], arrays['scale'])
    fits = shapes == list(itertools.pairwise(sizes)) and sizes[-1] == outputs
    fits &= all(x.shape == (inputs,) for x in vectors) and arrays['clip'].shape == ()
    fits &= all(biases.ndim == 1 for _, biases in layers)
    if not fits:
        allowed = f'give weights for {inputs} observed numbers and {outputs} of an action'
        raise ConfigError('policy', str(path), allowed)
    if not all(np.isfinite(x).all() for x in arrays.values()):
        raise ConfigError('policy', str(path), 'its weights must be finite numbers')
    return Policy(*vectors, float(arrays['clip']), layers)
