"""What every peer's program does: get ready, then step for some seconds whenever it is told to, and say how far it got.

Nothing but the standard library; the programs run in environments of their own. Import it before anything else: what
libraries print goes to standard error from then on, and the processor cores are those given.
"""

import json
import os
import sys
import time
from collections.abc import Callable, Mapping

JOB = json.loads(sys.argv[1]) if len(sys.argv) > 1 else {}
_answers = os.fdopen(os.dup(1), "w", buffering=1)
os.dup2(2, 1)
if "cores" in JOB:
    os.sched_setaffinity(0, JOB["cores"])


def serve(step: Callable[[], None], simulated_s: float, about: Mapping[str, object]) -> None:
    """Answer each line on standard input: step for so many seconds; report simulated, wall and processor seconds.

    Args:
        step: One step of everything that runs side by side.
        simulated_s: Simulated seconds that it advances, added up over what runs side by side.
        about: What is reported when ready.
    """
    step()
    print(json.dumps(dict(about)), file=_answers)
    for line in sys.stdin:
        seconds, steps, start, used = float(line), 0, time.perf_counter(), time.process_time()
        while time.perf_counter() - start < seconds:
            step()
            steps += 1
        spent = (time.perf_counter() - start, time.process_time() - used)
        print(json.dumps([steps * simulated_s, *spent]), file=_answers)
