"""What an FMU of a component does between its FMI calls, in Python: the twin of native/fmi2.c, rule for rule.

Travels inside the python FMU beside the component's source. All numbers come from the component's CasADi functions,
called through buffers without allocation.

Unit vectors that were typed are divided by their length when initialization mode is entered and left, and when a
parameter is set in flight. Calculated parameters, calculated states and step means follow every set in initialization
mode; frozen at its exit, after the component's conditions have been checked. A step: n equal internal steps of at most
solver.step. Sample n of a sampled component is due when |t - t0 - n T| <= 1 ns (and rounding) or it has passed; while
due, the outputs show what it would give, and it is committed at the start of the next step; samples inside a step are
taken with the inputs of that instant. Outputs are evaluated when they are read.
"""

import hashlib
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from fmus.description.annotations import COMMIT_SHOWN, SAMPLE_TIME, SOLVER_STEP
from fmus.export.python import plain
from fmus.export.python.buffered import Buffered
from fmus.export.python.conditions import OF_ANYTHING, OF_INPUTS, OF_PARAMETERS
from fmus.export.python.failure import RuntimeFailure
from fmus.export.python.internal_step import InternalStep, automatic, judged
from fmus.export.python.modes import FAILED, INITIALIZATION, INSTANTIATED, STEPPING, TERMINATED, admit
from fmus.export.python.normalising import normalise
from fmus.export.python.starting import Starting

TICK = 1e-9  # s, how near to a communication point a sample counts as due there
MOST_STEPS = 1e9
EPSILON = float(np.finfo(float).eps)


class Runtime(Starting):
    """State and behaviour of one instance."""

    def __init__(self, component: Any, name: str = ""):
        super().__init__(component, name or component.name)
        part = component
        self._identity = [self.name, hashlib.sha256("\0".join(self.names).encode()).hexdigest()]
        self.t0 = 0.0
        self.stop: float | None = None
        self._s, self._h = np.zeros(1), np.zeros(1)
        self._u1, self._u2, self._u3 = (np.zeros_like(self.u) for _ in range(3))  # input derivatives
        self._derivatives_new, self._derivatives_left = False, False  # given for the next step; any not zero
        self._u_now, self._x_next, self._no_x = np.zeros_like(self.u), np.zeros_like(self.x), np.zeros_like(self.x)
        self._x_views = self.x.data, self._x_next.data  # copied faster than arrays
        self._means = sum(o.size for o in part.outputs_declared if o.step_mean)
        self.m, self._q0, self._q1 = (np.zeros(self._means) for _ in range(3))
        self.sample, self.due = 0, False
        self._step_index = self._index(SOLVER_STEP)
        self._period_index = self._index(SAMPLE_TIME)
        self._shown_index = self._index(COMMIT_SHOWN)
        self._internal: InternalStep | None = None  # what is to be told of it, once
        self._automatic = 0.0  # longest internal step where none is set, s; 0: to be found
        self._bind()

    def _bind(self) -> None:
        """Bind the CasADi functions to this instance's arrays."""
        part = self.component
        if part.python_only:
            return
        f = part.functions
        t, x, u, p, c, m = self._t, self.x, self.u, self.p, self.c, self.m
        self._calculate = Buffered(f.calculate, [p], [c])
        self._initial = Buffered(f.initial, [t, x, u, p, c, self.e], [self._x_next])
        self._outputs = Buffered(f.outputs, [t, x, u, p, c, m], [self.y])
        if part.sampled:
            self._update = Buffered(f.update, [t, x, u, p, c], [self._x_next])
            self._update_inside = Buffered(f.update, [self._s, x, self._u_now, p, c], [self._x_next])
            self._outputs_next = Buffered(f.outputs, [t, self._x_next, u, p, c, m], [self.y])
            self._outputs_inside = Buffered(f.outputs, [self._s, x, self._u_now, p, c, m], [self.y])
        else:
            again, self._rates_now, self._y_slopes = np.zeros_like(self.y), np.zeros_like(x), np.zeros_like(self.y)
            self._slopes = Buffered(f.slopes, [t, x, u, p, c, m, self._u1], [again, self._rates_now, self._y_slopes])
        if part.states and not part.sampled:
            arguments = [t, x, u, self._u1, self._u2, self._u3, p, c, self._s, self._h]
            self._advance = Buffered(f.advance, arguments, [self._x_next])
            self._seed, self._along = np.zeros_like(x), np.zeros_like(x)
            still = [np.zeros_like(v) for v in (t, u, p, c)]
            arguments = [t, x, u, p, c, np.zeros(0), still[0], self._seed, *still[1:]]
            self._tangent = Buffered(f.rates.forward(1), arguments, [self._along])
        if self._means:
            self._mean_rates = Buffered(f.mean_rates, [t, x, u, p, c], [m])
            self._quantities = Buffered(f.means, [t, x, p, c], [self._q1])

    def release(self) -> None:
        """Drop the CasADi objects: they must not live until the interpreter is torn down. Values stay as they are."""
        self._stale, self.component = False, None
        for name, value in list(vars(self).items()):
            if isinstance(value, Buffered):
                delattr(self, name)

    # ---- values --------------------------------------------------------------------------------------------

    def set_input_derivatives(self, references: Sequence[int], orders: Sequence[int], values: Sequence[float]) -> None:
        """Set time derivatives (order 1 to 3) of inputs, for the next step."""
        given = self._input_positions(references, orders, values)
        self._forget_derivatives()
        self._derivatives_new = self._derivatives_left = True
        for i, order, value in given:
            (self._u1, self._u2, self._u3)[order - 1][i] = value

    def get_output_derivatives(self, references: Sequence[int], orders: Sequence[int]) -> np.ndarray:
        """Return y' = dy/dt + dy/dx x' + dy/du u' of outputs, step means held, shape (n,)."""
        admit(self.mode, "fmi2GetRealOutputDerivatives", STEPPING | TERMINATED)
        self._require_slopes(references, orders)
        if self._stale:
            self._evaluate()
        self._slopes.run()
        slopes = np.zeros_like(self.v)
        slopes[self._first_state : len(self.v) - len(self.taken)] = np.concatenate([self._rates_now, self._y_slopes])
        return slopes[list(references)]

    def _require_slopes(self, references: Sequence[int], orders: Sequence[int]) -> None:
        part = self.component
        shown = [s.output for s in part.states for _ in range(s.size)] + [True] * len(self.y)
        for reference, order in zip(references, orders, strict=True):
            place = reference - self._first_state
            if part.sampled or part.python_only or order != 1 or not (0 <= place < len(shown) and shown[place]):
                name = self.names[reference] if 0 <= reference < len(self.v) else "(none)"
                why = "sampled outputs have no derivatives" if part.sampled else "outputs, order 1 only"
                raise RuntimeFailure(f"fmi2GetRealOutputDerivatives: variable {name}, order {order}: {why}.")

    # ---- evaluation ----------------------------------------------------------------------------------------

    def _calculate_parameters(self) -> None:
        self._calculate.run()
        self._parameters_stale, self._automatic = False, 0.0

    def _begin(self) -> None:
        if not self.component.python_only:
            self._initial.run()
            self.x[:] = self._x_next
            if self._means:
                self._mean_rates.run()

    def _evaluate(self) -> None:
        self._stale = False
        if self._parameters_stale and not self.component.python_only:
            self._calculate_parameters()
        if self.given is not None:
            self._begin_waiting()
        elif self.mode == INITIALIZATION:
            self._begin()
        if self.component.python_only:
            plain.evaluate_outputs(self.component, self.t, self)
        elif not self.component.sampled:
            was_set = self.e.copy() if self.starting else None
            self._outputs.run()
            if was_set is not None:
                self.e[:] = was_set
        elif self.due or self.mode == INITIALIZATION:
            self._update.run()
            self._outputs_next.run()

    # ---- life cycle ----------------------------------------------------------------------------------------

    def setup(self, start_time: float, stop_time: float | None = None) -> None:
        """Set the start time, and the stop time where there is one (fmi2SetupExperiment)."""
        admit(self.mode, "fmi2SetupExperiment", INSTANTIATED)
        if not math.isfinite(start_time):
            raise RuntimeFailure(f"fmi2SetupExperiment: start time = {start_time:g} is not finite.")
        if stop_time is not None and not stop_time >= start_time:
            raise RuntimeFailure(
                f"fmi2SetupExperiment: stop time {stop_time:g} s is not after start time {start_time:g} s."
            )
        self.t0 = self._t[0] = start_time
        self.stop = stop_time
        self._stale = True

    def enter_initialization(self) -> None:
        """From now on what is calculated follows every set (fmi2EnterInitializationMode)."""
        super().enter_initialization()
        self._normalise()

    def _normalise(self) -> None:
        """Divide unit vectors that were typed by their length, and say so."""
        for text in normalise(self.component, self, self.mode == STEPPING):
            self._stale = self._parameters_stale = True
            self.warn(text)

    def exit_initialization(self) -> None:
        """Check the conditions, then freeze what initialization has calculated (fmi2ExitInitializationMode)."""
        admit(self.mode, "fmi2ExitInitializationMode", INITIALIZATION)
        self._normalise()
        if not self.component.python_only:  # outputs in plain Python may fail of what the conditions have words for
            self._evaluate()
        self.mode = FAILED
        if self._period_index is not None and not self.v[self._period_index] > 0:
            raise RuntimeFailure(f"{self.name}: sample_time = {self.v[self._period_index]:g} s is not positive.")
        refused = self._broken()
        if any(kind != OF_INPUTS for kind, _ in refused):
            self._refuse(OF_ANYTHING)
        self.due = bool(self.component.sampled)
        self.mode = STEPPING
        if refused:
            self._wait_for_inputs(refused)
        elif self._stale:
            self._evaluate()
        self._judge()

    def _judge(self) -> None:
        """See up to which internal step RK4 follows the dynamics as they are now."""
        if self._step_index is not None:
            self._internal = judged(self._jacobian_times, len(self.x), float(self.v[self._step_index]))
            self._longest_internal_step()

    def _jacobian_times(self, vector: np.ndarray) -> np.ndarray:
        """Return the product of df/dx, as it is now, with a vector."""
        self._seed[:] = vector
        self._tangent.run()
        return self._along.copy()

    def _longest_internal_step(self) -> float:
        """Return the longest internal step that is allowed now, s: the one set, or that of the dynamics."""
        largest = float(self.v[self._step_index])
        if largest == 0 and self._automatic == 0:
            self._automatic = automatic(self._jacobian_times, len(self.x))
        return largest or self._automatic

    def terminate(self) -> None:
        """End the run; variables can still be read (fmi2Terminate)."""
        admit(self.mode, "fmi2Terminate", STEPPING | FAILED)
        if self._stale and self.mode == STEPPING:
            self._evaluate()
        self.mode = TERMINATED

    def _check_tuned(self) -> None:
        """Check the conditions that are of parameters alone, then take unit vectors as such.

        Of a Python-only component no one knows which conditions are.
        """
        if not self.component.python_only:
            self._calculate.run()
            self._refuse(OF_PARAMETERS)
        self._normalise()

    def do_step(self, t: float, step: float) -> None:
        """Advance from t to t + step (fmi2DoStep)."""
        admit(self.mode, "fmi2DoStep", STEPPING)
        if not 0 < step < math.inf:
            raise RuntimeFailure(f"fmi2DoStep: step {step:g} s is not positive.")
        if not abs(t - self._t.item()) <= TICK + 4 * EPSILON * abs(t):
            raise RuntimeFailure(f"fmi2DoStep: asked to start at {t:.17g} s, the FMU is at {self.t:.17g} s.")
        if self.stop is not None and t + step > self.stop + TICK + 4 * EPSILON * abs(self.stop):
            raise RuntimeFailure(f"fmi2DoStep: a step to {t + step:.17g} s passes the stop time {self.stop:.17g} s.")
        self._t[0] = t
        self._forget_derivatives()
        if self._parameters_stale and not self.component.python_only:
            self._calculate_parameters()
        if self.given is not None:
            self._take_inputs()
            self._automatic = 0.0
            self._judge()
            if self.component.sampled:
                self._evaluate()  # what a sample that is due commits: solver.commit_shown
        part = self.component
        if part.python_only:
            plain.advance(part, t, step, self)
        elif part.sampled:
            self._take_samples(t, step)
        elif part.states:
            self._integrate(t, step)
        if self._derivatives_new:
            self._inputs_at(step, self.u)
            self._u1 += step * (self._u2 + 0.5 * step * self._u3)
            self._u2 += step * self._u3
            self._derivatives_new = False
        self._t[0] = t + step
        self._stale = True
        if part.sampled:
            self._arrive()
        if not math.isfinite(self.x.dot(self._no_x)):  # 0 times what is not finite is not finite
            bad = np.flatnonzero(~np.isfinite(self.x))
            if bad.size:
                self.mode = FAILED
                name = self.names[self._first_state + int(bad[0])]
                raise RuntimeFailure(f"fmi2DoStep: state {name} is not finite at {self.t:.9g} s.")

    def _integrate(self, t: float, step: float) -> None:
        largest = self._longest_internal_step()
        if not largest > 0 or step / largest > MOST_STEPS:
            raise RuntimeFailure(f"fmi2DoStep: solver.step = {largest:g} s does not suit a step of {step:g} s.")
        # A master's step is a difference of two times, each rounded: it may be longer than meant by some ulp of t.
        n = max(1, math.ceil((step - 4 * EPSILON * (abs(t) + step)) / largest - 1e-9))
        h = self._h[0] = self.taken[:] = step / n
        if self._means:
            self._quantities.run()
            self._q0[:] = self._q1
        if self._internal is not None and h > self._internal.longest:
            self.warn(self._internal.told(self.name, h))
            self._internal = None
        run, (x, x_next), s = self._advance.run, self._x_views, self._s
        for i in range(n):
            s[0] = i * h
            run()
            x[:] = x_next
        if self._means:
            self._t[0] += step
            self._quantities.run()
            np.divide(self._q1 - self._q0, step, out=self.m)

    def _forget_derivatives(self) -> None:
        """Let input derivatives that were given for a step that is over be zero."""
        if self._derivatives_left and not self._derivatives_new:
            self._u1[:] = self._u2[:] = self._u3[:] = 0
            self._derivatives_left = False

    def _inputs_at(self, since: float, out: np.ndarray) -> None:
        """u(s) = u + s (u1 + s (u2 + s u3 / 3) / 2)."""
        out[:] = self.u + since * (self._u1 + 0.5 * since * (self._u2 + since * self._u3 / 3))

    # ---- samples -------------------------------------------------------------------------------------------

    def _take_samples(self, t: float, step: float) -> None:
        """Commit a sample that is due at t, take those inside the step."""
        period = float(self.v[self._period_index])
        if step / period > MOST_STEPS:
            raise RuntimeFailure(f"fmi2DoStep: sample_time = {period:g} s does not suit a step of {step:g} s.")
        if self.due:
            if not self.v[self._shown_index]:
                self._update.run()
                self._outputs_next.run()
            self.x[:] = self._x_next
            self.sample += 1
            self.due = False
        while (tick := self.t0 + self.sample * period) < t + step - self._slack(t + step):
            self._inputs_at(tick - t, self._u_now)
            self._s[0] = tick
            self._update_inside.run()
            self.x[:] = self._x_next
            self._outputs_inside.run()
            self.sample += 1

    def _slack(self, t: float) -> float:
        """How far from t a sample is due there, s.

        Rounding parts what is meant to be one time: t0 + n T by eps/2 |n T| for T, as much for the product, eps/2 |t|
        for the sum, t by eps/2 |t|: by no more than eps (2 |t| + |t0|), which passes 1 ns at some 1e6 s.
        """
        return TICK + 4 * EPSILON * max(abs(t), abs(self.t0))

    def _arrive(self) -> None:
        """See whether the end of a step is a tick; show that sample, held outputs otherwise."""
        tick = self.t0 + self.sample * float(self.v[self._period_index])
        self.due = tick <= self.t + self._slack(self.t)
        if self.due:
            self._evaluate()
        self._stale = self.due

    # ---- state ---------------------------------------------------------------------------------------------

    def save(self) -> dict[str, Any]:
        """Return the whole state as plain data."""
        return {
            "v": self.v.tolist(),
            "m": self.m.tolist(),
            "t": [self.t0, self.t, self.stop],
            "derivatives": [self._u1.tolist(), self._u2.tolist(), self._u3.tolist(), self._derivatives_new],
            "internal_step": self._automatic,
            "samples": [self.sample, self.due, self._x_next.tolist()],
            "given": None if self.given is None else self.given.tolist(),
            "flags": [self.mode, self._stale, self._parameters_stale],
            "of": self._identity,
        }

    def restore(self, state: Any) -> None:
        """Take back a state that save returned, of this or another instance of the same FMU (fmi2SetFMUstate)."""
        if not isinstance(state, dict) or state.get("of") != self._identity:
            raise RuntimeFailure(f"fmi2SetFMUstate: the state was saved by another FMU than {self.name}.")
        if self.component is None:
            raise RuntimeFailure("fmi2SetFMUstate: a python FMU cannot come back from fmi2Terminate.")
        self.v[:] = state["v"]
        self.m[:] = state["m"]
        self.t0, self._t[0], self.stop = state["t"]
        self._u1[:], self._u2[:], self._u3[:], self._derivatives_new = state["derivatives"]
        self._derivatives_left = True
        self._automatic = state["internal_step"]
        self.given = None if state["given"] is None else np.array(state["given"])
        self.sample, self.due, self._x_next[:] = state["samples"]
        self.mode, self._stale, self._parameters_stale = state["flags"]
