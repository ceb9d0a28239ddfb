"""One run of the loop, with the recorder and the progress as its guests."""

import logging
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from cosim.checkpoints import Keeping
from cosim.errors import StepFailed
from cosim.masters.events import Events
from cosim.masters.interrupt import Asked, interruptible
from cosim.masters.master import Course, Flown
from cosim.masters.point import Part, Point
from cosim.masters.run import run
from cosim.masters.watch import Watch
from cosim.results.claim import release
from cosim.results.folder import write_info
from cosim.results.recorder import Recorder
from cosim.slaves.crew import Crew
from cosim.slaves.pending import Patience
from cosim.slaves.said import Said

Progress = Callable[[float, float], None]

_log = logging.getLogger(__name__)
_told: set[str] = set()


class Flight:
    """One run of the loop over a crew, which stands at a point; rows are kept whatever ends it."""

    def __init__(
        self,
        course: Course,
        crew: Crew,
        point: Point,
        events: Events,
        folder: Path | None,
        progress: Progress | None,
        info: Mapping[str, Any],
        patience: Patience,
        keeping: Keeping,
    ) -> None:
        self.patience, self.keeping = patience, keeping
        self.course, self.crew, self.point, self.events = course, crew, point, events
        self.folder, self.progress, self.info = folder, progress, info
        schedule = course.schedule
        rows = schedule.steps // schedule.every + len(schedule.events) + 3
        self.recorder = Recorder(folder, course.layout.columns, point.texts, rows, keeping.kept)
        self.flown = Flown("none", "nothing was flown")
        self.control, self.evaluations = course.control(), 0
        self.failure: Exception | None = None
        self.ended_by = ""  # the FMU that asked for the end
        self.interrupted = False
        self.asked = Asked()
        self.wall_time = 0.0

    def parts(self, watch: Watch) -> Mapping[str, Part]:
        """Return what remembers something from point to point beside the points: a checkpoint has it all."""
        return {"control": self.control, "interludes": self.events, "watch": watch, "said": Said(self.crew)}

    def fly(self, problem: Exception | None = None) -> None:
        """Fly to the end; what ends it early, or a `problem` at once, stands in `failure` and `interrupted`."""
        schedule = self.course.schedule
        began = time.perf_counter()
        try:
            if problem is not None:
                raise problem
            with self.recorder as recorder:
                watch = Watch(self.course.layout, schedule, recorder.block, self.patience.stop)
                algorithm, self.flown = self.course.algorithm(self.crew, watch)
                _tell(self.flown)
                self.keeping.begin(recorder, watch, self.crew, self.parts(watch))
                with interruptible(watch.stop, self._last_words) as self.asked:
                    going = run(algorithm, self.control, self.point, watch, self.events)
                    try:
                        for self.point in going:
                            recorder.look()
                            self.keeping.look(self.point)
                            if self.progress is not None:
                                self.progress(schedule.time(self.point.index), schedule.time(schedule.steps))
                        self.keeping.end(self.point)
                    except KeyboardInterrupt:
                        self.interrupted = True  # the last row tells how far it came
                    finally:
                        going.close()
                        self.evaluations = watch.evaluations
                        self.interrupted = self.interrupted or bool(watch.stop.value)
        except StepFailed as error:
            if error.terminated:
                self.ended_by = error.component
            else:
                self.failure = error
        except Exception as error:
            self.failure = error
        self.wall_time = time.perf_counter() - began

    def _last_words(self) -> None:
        """Write the rows that there are and say how it ended, for the process ends within a step of an FMU."""
        if self.folder is not None:
            self.recorder.flush()
            write_info(self.folder, {**self.info, "status": "interrupted", "rows": self.recorder.rows})
            release(self.folder)


def _tell(flown: Flown) -> None:
    """Say once why a run flies in Python that was to fly in the kernel, fifty times faster."""
    if flown.reason and not flown.reason.startswith("kernel="):
        warn(f"the loop runs in Python, not in the kernel, for {flown.reason}")


def warn(line: str) -> None:
    """Say a line once a process."""
    if line not in _told:
        _told.add(line)
        _log.warning("%s", line)
