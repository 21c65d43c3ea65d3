"""Build file for colcon (ament_python) and pip."""

from pathlib import Path
import re
import sys

from setuptools import Distribution, find_packages, setup

NAME = 'disc_sim_ros'

# A new executable is one line here, one in cli/disc_sim.py, its functions in cli/start.py unless
# it is a node, and one file in scripts/, a copy of scripts/fly with another name.
EXECUTABLES = {
    'analyse_bag': 'disc_sim_ros.cli.start:analyse_bag',
    'demo': 'disc_sim_ros.cli.start:demo',
    'disc-sim': 'disc_sim_ros.cli.start:disc_sim',
    'fly': 'disc_sim_ros.cli.start:fly',
    'identify': 'disc_sim_ros.cli.start:identify',
    'live_view': 'disc_sim_ros.cli.live_view:main',
    'optimise': 'disc_sim_ros.cli.start:optimise',
    'paper_figures': 'disc_sim_ros.cli.start:paper_figures',
    'policy_node': 'disc_sim_ros.cli.policy_node:main',
    'predict': 'disc_sim_ros.cli.start:predict',
    'predictor_node': 'disc_sim_ros.cli.predictor_node:main',
    'recorder_node': 'disc_sim_ros.cli.recorder_node:main',
    'repair_bag': 'disc_sim_ros.cli.start:repair_bag',
    'sim_node': 'disc_sim_ros.cli.sim_node:main',
    'sweep': 'disc_sim_ros.cli.start:sweep',
}

SHARED_FOLDERS = ('config', 'launch', 'urdf', 'rviz', 'security')


class DataDistribution(Distribution):
    """Makes `pip install -e` install the data files; setuptools would skip them."""

    def has_data(self) -> bool:
        """Return True if there are data files; editable_wheel calls this."""
        return self.has_data_files()


def version() -> str:
    """Read the version without importing the package and what it needs."""
    text = Path(NAME, '__init__.py').read_text(encoding='utf-8')
    match = re.search(r"^__version__ = '([^']+)'$", text, re.MULTILINE)
    if match is None:
        raise RuntimeError(f"{NAME}/__init__.py: no line __version__ = '...'")
    return match[1]


def data_files() -> list[tuple[str, list[str]]]:
    """Return the files outside the package, by the folder in which they are installed."""
    files = [
        ('share/ament_index/resource_index/packages', [f'resource/{NAME}']),
        (f'share/{NAME}', ['package.xml']),
    ]
    shared = [path for top in SHARED_FOLDERS for path in sorted(Path(top).rglob('*'))]
    files += [
        (f'share/{NAME}/{path.parent.as_posix()}', [path.as_posix()])
        for path in shared
        if path.is_file() and '__pycache__' not in path.parts
    ]
    # A wheel ignores install_scripts in setup.cfg; only colcon fills lib/disc_sim_ros by itself.
    if {'bdist_wheel', 'editable_wheel', 'sdist'} & set(sys.argv):
        files.append(
            (f'lib/{NAME}', sorted(path.as_posix() for path in Path('scripts').iterdir()))
        )
    return files


setup(
    name=NAME,
    version=version(),
    description='Real-time flight simulator of a spin-stabilised disc for ROS 2',
    long_description=(
        'Flies a Frisbee after Crowther and Potts (2007): correct gyroscopics, control inputs, '
        'ROS 2 messages, MCAP bags.'
    ),
    author='disc_sim_ros maintainers',
    maintainer='disc_sim_ros maintainers',
    maintainer_email='maintainers@disc-sim.example.org',
    license='Apache-2.0',
    keywords=['disc', 'flight dynamics', 'frisbee', 'MCAP', 'ROS 2', 'simulation'],
    # No URLs: the project has no public address yet.
    classifiers=[
        'Development Status :: 4 - Beta',
        'Intended Audience :: Developers',
        'Intended Audience :: Education',
        'Intended Audience :: Science/Research',
        'Operating System :: POSIX :: Linux',
        'Programming Language :: Python :: 3',
        'Programming Language :: Python :: 3.11',
        'Programming Language :: Python :: 3.12',
        'Programming Language :: Python :: 3.13',
        'Programming Language :: Python :: 3.14',
        'Topic :: Scientific/Engineering :: Physics',
        'Topic :: Scientific/Engineering :: Visualization',
        'Typing :: Typed',
    ],
    packages=find_packages(include=[NAME, f'{NAME}.*']),
    package_data={
        NAME: [
            'py.typed',
            'physics/discs/*.yaml',
            'paper/data/*',
            'view/assets/*',
            'envs/policies/*',
        ]
    },
    data_files=data_files(),
    distclass=DataDistribution,
    zip_safe=False,
    python_requires='>=3.11',
    install_requires=[
        'numpy>=1.26,<3',
        'PyYAML>=6.0,<7',
        'matplotlib>=3.6,<4',
        'lz4>=4.0.2,<5',
        'mcap>=1.2,<2',
        'mcap-ros2-support>=0.5.5,<1',
        'Pillow>=9.1',
        'scipy>=1.11,<2',
        'zstandard>=0.22,<1',
    ],
    extras_require={
        # For machines without a ROS installation. Always the ros-jazzy- names: names without the
        # distribution are of a later one.
        'jazzy': [
            'ros-jazzy-rclpy[fastrtps]',
            'ros-jazzy-common-interfaces',
        ],
        # Compiled equations, hundreds of times faster.
        'fast': ['llvmlite>=0.43,<1', 'numba>=0.60,<1'],
        # Parquet tables of `sweep`.
        'parquet': ['pyarrow>=15,<30'],
        # Pages with flights in 3D: `--html`, `--view`, live_view. Their viewer is no promise of
        # trimesh. Ubuntu 24.04 has websockets 10, without the server in use.
        'view': ['trimesh>=5,<6', 'websockets>=13,<18'],
        # `sweep --executor dask`.
        'dask': ['dask>=2024.5', 'distributed>=2024.5'],
        # Environments for reinforcement learning, docs/learning.md.
        'envs': ['gymnasium>=1.1,<2'],
        # examples/train_steer.py; PyTorch takes 0.2 to 3 GB.
        'learn': ['gymnasium>=1.1,<2', 'stable-baselines3>=2.4,<3', 'torch>=2.3,<3'],
        # `make docs`. soupsieve 3, which furo needs, refuses Python 3.11.0 to
        # 3.11.4; Debian 12 has 3.11.2.
        'docs': ['furo>=2024.8', 'myst-parser>=4,<6', 'soupsieve<3', 'Sphinx>=8,<10'],
        'fuzz': ['atheris>=2.3,<4'],
        'test': [
            'packaging>=23',
            'dask>=2024.5',
            'distributed>=2024.5',
            'pytest>=8,<9.2',
            'pytest-timeout>=2.3,<3',
            'pytest-xdist>=3.5,<4',
            'gymnasium>=1.1,<2',
            'hypothesis>=6.100,<7',
            'rosbags>=0.10.4,<1',
            'ruff>=0.14,<1',
            'mypy>=1.15,<3',
            'types-PyYAML',
            'import-linter>=2.3,<3',
            'colcon-core>=0.19,<1',
            'colcon-ros>=0.5,<1',
        ],
    },
    entry_points={
        'console_scripts': [f'{name} = {target}' for name, target in EXECUTABLES.items()],
    },
)
