"""What a measurement was made on, and how long something takes."""

import os
import platform
import sys
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import mujoco
import numpy as np


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0))


def processor_name() -> str:
    """As the system calls it."""
    listing = Path("/proc/cpuinfo")
    lines = listing.read_text().splitlines() if listing.exists() else []
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), platform.machine())


def describe_machine() -> str:
    """Processor, cores, versions, date, and how busy the machine was before the measurement."""
    versions = f"Python {platform.python_version()}, NumPy {np.__version__}, MuJoCo {mujoco.__version__}"
    where = f"{processor_name()}, {cores()} cores, {platform.system()}; {versions}"
    return f"{where}; {datetime.now(UTC):%Y-%m-%d}; load before {os.getloadavg()[0]:.1f}"


def seconds_of(run: Callable[[], object]) -> float:
    """Wall time of a call."""
    start = time.perf_counter()
    run()
    return time.perf_counter() - start


def processor_seconds_of(run: Callable[[], object]) -> float:
    """Processor time of a call, all threads together."""
    start = time.process_time()
    run()
    return time.process_time() - start


def peak_memory_mb() -> float:
    """The most memory that this process has held [MB]."""
    import resource

    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e6
