"""A model that gives derivatives (FMI for model exchange), integrated by CVode over a communication step, events in it.

The solver is CVode's BDF with Newton, of fmpy's sundials: relative tolerance that of the experiment, else `TOLERANCE`;
absolute tolerance the same part of each state's nominal. Its steps are no longer than the communication step. It starts
anew after an event and after a change of an input; else it goes on as if there were no communication points.

An event is a root of an indicator, a time that the model has named, or what it asks for after a step. Then, in event
mode, discrete states are updated until they need no more.
"""

from collections.abc import Callable
from typing import Any, Protocol

TOLERANCE = 1e-6
"""Relative, where nobody says another."""

EVENTS = 10_000
"""How many events a step may have."""

NEAR = 1e-12
"""Times that differ by this part of the step are one."""


class Model(Protocol):
    """What is asked of a model, whatever its version of FMI: fmpy's names, and what differs between versions."""

    getContinuousStates: Callable[[Any, int], Any]
    setContinuousStates: Callable[[Any, int], Any]
    getEventIndicators: Callable[[Any, int], Any]
    setTime: Callable[[float], Any]

    def derivatives(self, values: Any, count: int) -> None:
        """Put the derivatives of the states into an array of C doubles."""
        ...

    def nominals(self, values: Any, count: int) -> None:
        """Put the nominal values of the states into an array of C doubles."""
        ...

    def completed(self) -> tuple[bool, bool]:
        """Tell of a step; return whether there is an event, and whether the run is to end."""
        ...

    def enter_events(self) -> None:
        """Enter event mode."""
        ...

    def update(self) -> tuple[bool, bool, float | None]:
        """Update discrete states; return whether once more, whether the run is to end, the time of the next event."""
        ...

    def leave_events(self) -> None:
        """Go on in continuous time."""
        ...


class Ended(Exception):
    """The model asks for the end of the run, at `time`, s."""

    def __init__(self, time: float) -> None:
        super().__init__(time)
        self.time = time


class Stuck(Exception):
    """The solver or the events come to no end; the text says which."""


class Integration:
    """A model's way from one communication point to the next; made when it has left initialization mode, at t s."""

    def __init__(self, model: Model, states: int, indicators: int, tolerance: float, t: float) -> None:
        self._model, self._sizes, self._tolerance = model, (states, indicators), tolerance
        self._solver: Any = None
        self._next: float | None = None
        self._failure: Exception | None = None
        self._in_events, self._changed = True, False
        self._update(t)

    def change(self, *, discrete: bool) -> None:
        """Note that an input is to be set; one that is discrete in event mode."""
        self._changed = True
        if discrete and not self._in_events:
            self._model.enter_events()
            self._in_events = True

    def advance(self, t: float, h: float) -> None:
        """Integrate from t to t + h; raises `Ended`, `Stuck`, and what a call of the model raises."""
        if self._in_events:
            self._update(t)
        if self._solver is None:
            self._solver = self._made(t, h)
        elif self._changed:
            self._solver.reset(t)
        self._changed = False
        end, time = t + h, t
        for _ in range(EVENTS):
            if end - time <= NEAR * h:
                return
            named = self._next is not None and self._next < end - NEAR * h
            time = self._to(time, max(time, self._next or t) if named else end, h)
        raise Stuck(f"{EVENTS} events in one step")

    def _to(self, time: float, until: float, h: float) -> float:
        """Go on to a time, or to the event before it; return the time that was reached."""
        crossed, reached = False, until
        if until - time > NEAR * h:
            crossed, reached = self._stepped(time, until)
        self._model.setTime(reached)
        event, ends = self._model.completed()
        if ends:
            raise Ended(reached)
        if crossed or event or (self._next is not None and self._next <= reached + NEAR * h):
            self._model.enter_events()
            self._update(reached)
            self._solver.reset(reached)
        return reached

    def _stepped(self, time: float, until: float) -> tuple[bool, float]:
        try:
            crossed, _, reached = self._solver.step(time, until)
        except RuntimeError as error:
            raise self._failure or Stuck(str(error)) from error
        if self._failure is not None:
            raise self._failure
        return crossed, reached if crossed else until

    def _update(self, t: float) -> None:
        """Update discrete states in event mode, at t s, and leave it."""
        again = True
        for _ in range(EVENTS):
            again, ends, self._next = self._model.update()
            if ends:
                raise Ended(t)
            if not again:
                break
        if again:
            raise Stuck(f"discrete states still need an update after {EVENTS}")
        self._model.leave_events()
        self._in_events = False

    def _made(self, t: float, h: float) -> Any:
        from fmpy.sundials import CVodeSolver  # loads libraries

        model = self._model
        return CVodeSolver(
            *self._sizes,
            model.getContinuousStates,
            model.setContinuousStates,
            self._guarded(model.derivatives),
            self._guarded(model.getEventIndicators),
            model.nominals,
            self._guarded(model.setTime),
            _Held(),
            t,
            maxStep=h,
            relativeTolerance=self._tolerance,
        )

    def _guarded(self, function: Callable[..., Any]) -> Callable[..., None]:
        """Return a function that CVode may call: what it raises must not go through C, it is kept for later."""

        def call(*arguments: Any) -> None:
            try:
                function(*arguments)
            except Exception as error:
                self._failure = self._failure or error

        return call


class _Held:
    """Inputs as fmpy's solver asks for them: they are held over the step."""

    def apply(self, _t: float) -> None:
        """Change nothing."""
