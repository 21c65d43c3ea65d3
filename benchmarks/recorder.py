"""Record Odometry at 10 kHz: losses and cost, beside a plain callback and `mcap` alone.

.venv/bin/python benchmarks/recorder.py [seconds, 60]
"""

from collections.abc import Callable
import os
from pathlib import Path
import signal
import struct
import subprocess
import sys
import tempfile
import time

from mcap.writer import Writer
from nav_msgs.msg import Odometry
import rclpy
from rclpy.node import Node
from rclpy.serialization import serialize_message
from rclpy.signals import SignalHandlerOptions

from disc_sim_ros.bags import schemas
from disc_sim_ros.bags.reader import open_bag
from disc_sim_ros.bags.topic import Topic
from disc_sim_ros.bags.writer import BagWriter
from disc_sim_ros.ros import processes
from disc_sim_ros.ros.cdr_template import CdrTemplate
from disc_sim_ros.ros.messages import ODOMETRY_FIELDS
from disc_sim_ros.ros.qos import STATE_QOS
from disc_sim_ros.ros.recorder.writer_thread import BagTopic, WriterThread
from lines import Line, number, print_lines

RATE = 10_000  # Hz
BURST = 0.001  # s between two bursts of messages
TYPE = 'nav_msgs/msg/Odometry'
NUMBER = struct.Struct('<d')
TICKS = os.sysconf('SC_CLK_TCK')
PAGE = os.sysconf('SC_PAGE_SIZE')
LEAST = 0.5  # of the rate of mcap.Writer alone


def odometry() -> Odometry:
    """Return a message as sim_node publishes it."""
    message = Odometry(child_frame_id='disc')
    message.header.frame_id = 'map'
    return message


def place_of_number() -> int:
    """Return the offset of position.x, which carries the number of a message, in its bytes."""
    message = odometry()
    message.pose.pose.position.x = 12345.6789
    return serialize_message(message).index(NUMBER.pack(12345.6789))


def publish(seconds: float) -> None:
    """Publish numbered messages: the body of the publishing process."""
    rclpy.init()
    node = Node('publisher')
    publisher = node.create_publisher(Odometry, 'odom', STATE_QOS)
    pack = CdrTemplate(odometry(), ODOMETRY_FIELDS).pack
    rest = (0.0,) * (len(ODOMETRY_FIELDS) - 1)
    while not publisher.get_subscription_count():
        time.sleep(0.05)
    time.sleep(1.0)
    start, n = time.monotonic(), 0
    while n < seconds * RATE:
        due = min(round((time.monotonic() - start) * RATE), round(seconds * RATE))
        for i in range(n, due):
            publisher.publish(pack(0, 0, float(i), *rest))
        n = max(n, due)
        time.sleep(BURST)
    print(f'{n / (time.monotonic() - start):.0f}', flush=True)
    time.sleep(2.0)  # until the last message is acknowledged
    node.destroy_node()
    rclpy.try_shutdown()


def record_plainly(file: str) -> None:
    """Record in an ordinary callback: the body of the process that is compared with ours."""
    signals: list[int] = []
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    signal.signal(signal.SIGINT, lambda number, _: signals.append(number))
    node = Node('plain_recorder')
    with Path(file).open('wb') as stream:
        writer, channel = started_writer(stream)

        def write(data: bytes) -> None:
            now = time.time_ns()
            writer.add_message(channel, now, data, now)

        node.create_subscription(Odometry, 'odom', write, 10, raw=True)
        while not signals:
            rclpy.spin_once(node, timeout_sec=0.1)
        writer.finish()


def started_writer(stream: object) -> tuple[Writer, int]:
    """Return a writer of the `mcap` package, and its channel for Odometry."""
    writer = Writer(stream)
    writer.start('ros2')
    schema = writer.register_schema(TYPE, 'ros2msg', (schemas.definition(TYPE) or '').encode())
    return writer, writer.register_channel('/odom', 'cdr', schema)


def usage(pid: int) -> tuple[float, float]:
    """Return the CPU time [s] and the memory [MB] of a process."""
    fields = Path(f'/proc/{pid}/stat').read_text(encoding='utf-8').rpartition(')')[2].split()
    cpu = (int(fields[11]) + int(fields[12])) / TICKS
    return cpu, int(fields[21]) * PAGE / 1e6


def measured(recorder: list[str], seconds: float) -> tuple[float, list[float], float]:
    """Run a recorder and the publisher; return the CPU of a core, the memory [MB], the rate."""
    process = subprocess.Popen(recorder, stderr=subprocess.DEVNULL)
    sender = subprocess.Popen(
        [sys.executable, __file__, 'publish', str(seconds)], stdout=subprocess.PIPE, text=True
    )
    time.sleep(4.0)  # until they have discovered each other
    cpu, memory = usage(process.pid)
    start, memories = time.monotonic(), [memory]
    for _ in range(3):
        time.sleep((seconds - 2.0) / 3)
        memories.append(usage(process.pid)[1])
    share = (usage(process.pid)[0] - cpu) / (time.monotonic() - start)
    rate = float(sender.communicate()[0])
    process.send_signal(signal.SIGINT)
    process.wait()
    return share, memories, rate


def numbers(messages: Callable[[], object]) -> list[int]:
    """Return the numbers of recorded messages."""
    at = place_of_number()
    return [int(NUMBER.unpack_from(m.data, at)[0]) for m in messages()]  # type: ignore[attr-defined]


def alone(messages: int, file: Path) -> float:
    """Return how many messages `mcap.Writer` alone writes in a second of CPU time."""
    data = serialize_message(odometry())
    start = time.process_time()
    with file.open('wb') as stream:
        writer, channel = started_writer(stream)
        for n in range(messages):
            writer.add_message(channel, n, data, n)
        writer.finish()
    return messages / (time.process_time() - start)


def written(messages: int, folder: Path) -> float:
    """Return how many messages the recorder's thread writes in a second of CPU time."""
    data = serialize_message(odometry())
    thread, topic = WriterThread(BagWriter(folder), 0.5), BagTopic()
    thread.add_topic(topic, Topic(name='/odom', type=TYPE))
    start = time.process_time()
    for n in range(messages):
        thread.put(topic, data, n, n)
    thread.start()
    thread.end()
    thread.join()
    return messages / (time.process_time() - start)


def main() -> None:
    """Print the results, or run one of the processes."""
    if sys.argv[1:2] == ['publish']:
        publish(float(sys.argv[2]))
    elif sys.argv[1:2] == ['plain']:
        record_plainly(sys.argv[2])
    else:
        print_lines(lines(float(sys.argv[1]) if len(sys.argv) > 1 else 60.0))


def lines(seconds: float = 60.0) -> tuple[Line, ...]:
    """Record for some time [s], and write as fast as possible; return the results."""
    with tempfile.TemporaryDirectory() as scratch, processes.own_domain():
        folder = Path(scratch)
        total = round(seconds * RATE)
        ours = [sys.executable, '-m', 'disc_sim_ros.ros.recorder', '--ros-args']
        ours += ['-p', f'bag:={folder / "bag"}', '-p', 'topics:=/odom']
        share, memory, rate = measured(ours, seconds)
        bag = open_bag(folder / 'bag')
        recorded = numbers(lambda: bag.raw(['/odom']))
        whole = recorded == list(range(total))
        print(f'published {total} messages at {rate:.0f} Hz')
        plain = [sys.executable, __file__, 'plain', str(folder / 'plain.mcap')]
        plain_share, _, _ = measured(plain, min(seconds, 10.0))
        sent = round(min(seconds, 10.0) * RATE)
        kept = len(numbers(lambda: open_bag(folder / 'plain.mcap').raw(['/odom'])))
        writer = alone(100_000, folder / 'alone.mcap')
        own = written(100_000, folder / 'written')
    result = 'all, in order' if whole else 'NOT ALL, OR NOT IN ORDER'
    whole_path = rate / share
    return (
        Line(
            what=f'`recorder_node`, {RATE:,} Odometry a second for {seconds:g} s',
            ours=f'{len(recorded):,} of {total:,}, {result}',
            beside=f'a plain callback {kept / sent:.0%}',
            ratio=len(recorded) / total / (kept / sent),
            bound='nothing lost',
            kept=whole,
            short=True,
        ),
        Line(
            what='the same, CPU',
            ours=f'{share:.0%} of a core, {max(memory):.0f} MB',
            beside=f'a plain callback {plain_share:.0%}',
            ratio=plain_share / share,
        ),
        Line(
            what='its writing thread, Odometry',
            ours=f'{number(own)} per CPU-second',
            beside=f'`mcap.Writer` alone {number(writer)}',
            ratio=own / writer,
            bound=f'at least {LEAST:g} times',
            kept=own / writer >= LEAST,
        ),
        Line(
            what='all of it, with ROS and network',
            ours=f'{number(whole_path)} per CPU-second',
            beside=f'`mcap.Writer` alone, no network {number(writer)}',
            ratio=whole_path / writer,
        ),
    )


if __name__ == '__main__':
    main()
