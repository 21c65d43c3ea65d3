"""Writes a bag until it is killed. usage: killed.py FOLDER PERIOD_S RATE_HZ MAX_SIZE

Prints after each flush how many messages are on the disk, and keeps the log time of the last
message that was taken [ns, 8 bytes] in FOLDER.taken, which outlives the kill.
"""

import mmap
import os
from pathlib import Path
import struct
import sys
import time

from disc_sim_ros.bags.topic import Topic
from disc_sim_ros.bags.writer import BagWriter

folder, period, rate, max_size = sys.argv[1:]
bag = BagWriter(Path(folder), flush_period=float(period), max_size=int(max_size))
topic = bag.add(Topic(name='/noise', type='std_msgs/msg/String', definition='string data'))
Path(f'{folder}.taken').write_bytes(bytes(8))
taken = mmap.mmap(os.open(f'{folder}.taken', os.O_RDWR), 8)
printed = 0
written = 0
start = time.monotonic()
while True:
    due = int((time.monotonic() - start) * float(rate))
    for number in range(written, due):
        now = time.time_ns()
        bag.write(topic, os.urandom(725), now, number)
        struct.pack_into('<Q', taken, 0, now)
    written = max(written, due)
    flushed = bag.flushed
    if flushed != printed:
        os.write(1, f'{flushed}\n'.encode())
        printed = flushed
    time.sleep(0.001)
