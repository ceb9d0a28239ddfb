"""The functions of a component that a native FMU computes with, cut as cut.py says."""

import casadi as ca

from components.framework import Component
from components.framework.integrator import rk4_from_first_rate
from fmus.errors import BuildError
from fmus.export.native.cut import cut


def native_functions(part: Component) -> list[ca.Function]:
    """Return the functions that the component has anything to compute with."""
    f = part.functions
    calculated = any(s.calculated and s.size for s in part.states)
    means = any(o.step_mean and o.size for o in part.outputs_declared)
    outputs = bool(part.size(part.outputs_declared))
    if means and not _moving(part):
        raise BuildError(
            f"{part.name}: a step mean is the rate of something that states make; there are no continuous states."
        )
    made = cut(flown(part))
    chosen = list(made.values())
    if _moving(part):
        chosen.append(rk4_from_first_rate(made["rates"], f.project))
    if means:
        chosen += [f.means, f.mean_rates]
    if part.size(part.calculated_parameters):
        chosen += [f.calculate, f.calculate_forward]
    if calculated:
        chosen.append(f.initial)
    if calculated or means:
        chosen.append(f.initial_forward)
    if f.normalise:
        chosen.append(f.normalise)
    if f.conditions:
        chosen.append(f.check)
    if outputs or _moving(part):
        chosen.append(f.forward)
    return chosen


def flown(part: Component) -> dict[str, ca.Function]:
    """Return by name the functions that are evaluated again and again in flight, whole."""
    f = part.functions
    chosen: list[ca.Function] = []
    if _moving(part):
        chosen.append(f.rates)
    if part.sampled and part.size(part.states):
        chosen.append(f.update)
    if part.size(part.outputs_declared):
        chosen += [f.outputs] if part.sampled else [f.outputs, f.slopes]
    return {function.name(): function for function in chosen}


def _moving(part: Component) -> bool:
    return bool(part.size(part.states)) and not part.sampled
