"""How fast `BagWriter` writes, beside `mcap.Writer` alone, with the same messages.

Both write the same 40,000 serialised Odometry messages, no two alike, to chunks of the same size,
zstd, index and all; `BagWriter` also flushes to the disk twice a second and keeps metadata.yaml.
CPU time, in turns, the best of a few rounds each. The last line is the ratio of the rates.

usage: benchmarks/bag_writer.py [FOLDER]   (a folder on the disk to measure with; default: here)
"""

from pathlib import Path
import platform
import shutil
import sys
import tempfile
import time

from mcap.writer import Writer
from nav_msgs.msg import Odometry
import numpy as np
from rclpy.serialization import serialize_message

from disc_sim_ros.bags import schemas
from disc_sim_ros.bags.mcap_writer import CHUNK_SIZE
from disc_sim_ros.bags.topic import Qos, Topic
from disc_sim_ros.bags.writer import BagWriter
from lines import Line, number, print_lines

COUNT = 40_000
ROUNDS = 5
LEAST = 0.5  # of the rate of mcap.Writer
TYPE = 'nav_msgs/msg/Odometry'
START = 1_700_000_000_000_000_000  # ns
STEP = 1_000_000  # ns


def main() -> None:
    """Print what was measured."""
    print_lines(lines(Path(sys.argv[1]) if len(sys.argv) > 1 else Path()))


def lines(parent: Path = Path()) -> tuple[Line, ...]:
    """Measure both on the disk of a folder, print rates and sizes and return the ratio."""
    data = messages()
    ways = {
        'mcap.Writer': lambda folder: plain(folder, data),
        'BagWriter': lambda folder: bag(folder, data),
    }
    best = dict.fromkeys(ways, float('inf'))
    sizes = dict.fromkeys(ways, 0)
    with tempfile.TemporaryDirectory(dir=parent) as scratch:
        for _ in range(ROUNDS):
            for name, way in ways.items():
                folder = Path(scratch, 'run')
                start = time.process_time()
                path = way(folder)
                best[name] = min(best[name], time.process_time() - start)
                sizes[name] = path.stat().st_size
                shutil.rmtree(folder)
    print(f'Python {platform.python_version()}; {COUNT} Odometry of {len(data[0])} bytes')
    for name, seconds in best.items():
        print(f'{name:12} {COUNT / seconds:9.0f} messages per CPU-second, {sizes[name]} bytes')
    ratio = best['mcap.Writer'] / best['BagWriter']
    rates = {name: number(COUNT / seconds) for name, seconds in best.items()}
    return (
        Line(
            what='`BagWriter`, Odometry',
            ours=f'{rates["BagWriter"]} per CPU-second, with flushes and metadata.yaml',
            beside=f'`mcap.Writer` alone {rates["mcap.Writer"]}',
            ratio=ratio,
            bound=f'at least {LEAST:g} times',
            kept=ratio >= LEAST,
        ),
    )


def messages() -> list[bytes]:
    """Return Odometry messages of a disc that flies and spins, serialised."""
    rng = np.random.default_rng(1)
    noise = rng.normal(size=(COUNT, 13))
    message = Odometry(child_frame_id='disc')
    message.header.frame_id = 'map'
    pose, twist = message.pose.pose, message.twist.twist
    done = []
    for n, row in enumerate(noise.tolist()):
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(n * STEP, 10**9)
        pose.position.x, pose.position.y, pose.position.z = row[:3]
        o = pose.orientation
        o.x, o.y, o.z, o.w = row[3:7]
        twist.linear.x, twist.linear.y, twist.linear.z = row[7:10]
        twist.angular.x, twist.angular.y, twist.angular.z = row[10:13]
        done.append(serialize_message(message))
    return done


def plain(folder: Path, data: list[bytes]) -> Path:
    """Write with the package `mcap` alone."""
    folder.mkdir()
    path = folder / 'plain.mcap'
    with path.open('wb') as file:
        writer = Writer(file, chunk_size=CHUNK_SIZE)
        writer.start('ros2')
        text = schemas.definition(TYPE) or ''
        channel = writer.register_channel(
            '/odom', 'cdr', writer.register_schema(TYPE, 'ros2msg', text.encode())
        )
        for n, message in enumerate(data):
            writer.add_message(channel, START + n * STEP, message, START + n * STEP)
        writer.finish()
    return path


def bag(folder: Path, data: list[bytes]) -> Path:
    """Write a bag as the recorder does."""
    topic = Topic(
        name='/odom',
        type=TYPE,
        definition=schemas.definition(TYPE),
        type_hash=schemas.type_hash(TYPE) or '',
        qos=(Qos(depth=1000),),
    )
    with BagWriter(folder) as writer:
        odom = writer.add(topic)
        for n, message in enumerate(data):
            writer.write(odom, message, START + n * STEP, START + n * STEP)
    return writer.files[0]


if __name__ == '__main__':
    main()
