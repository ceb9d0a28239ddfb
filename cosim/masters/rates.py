"""Components at different rates: who waits for whom, and which connections make no sense across rates."""

from collections.abc import Iterator
from contextlib import suppress
from fractions import Fraction

from cosim.errors import TimeError, WiringError
from cosim.system.graph import stepping_order
from cosim.system.wiring import Link, Port, Wiring
from cosim.time import Schedule, exact_seconds
from fmus.description.annotations import SAMPLE_TIME


def waiting(wiring: Wiring) -> frozenset[str]:
    """Return the components with a period of several steps that must step at its end, after faster sources."""
    result: set[str] = set()
    for component in stepping_order(wiring):
        links = [link for link in wiring.into(component) if not link.from_start]
        period = wiring.period(component)
        if period > 1 and any(
            wiring.period(link.source.component) < period or link.source.component in result for link in links
        ):
            result.add(component)
    return frozenset(result)


def mistakes(wiring: Wiring, schedule: Schedule) -> list[WiringError]:
    """Return what is wrong with the rates of a wiring whose stepping order exists."""
    late = waiting(wiring)
    found = {str(m): m for link in wiring.links if (m := _mistake(wiring, link, late)) is not None}
    return [*found.values(), *of_one_rate(wiring, schedule)]


def of_one_rate(wiring: Wiring, schedule: Schedule) -> list[WiringError]:
    """Return what is wrong with single components: a last step that is shorter, samples between steps."""
    return [*_shortened(wiring, schedule), *_missampled(wiring, schedule)]


def sample_times(wiring: Wiring) -> dict[str, Fraction]:
    """Return the sample times of the sampled components of ours, s, by their names."""
    found: dict[str, Fraction] = {}
    for component, description in wiring.descriptions.items():
        if not description.sampled or SAMPLE_TIME not in description.variables:
            continue
        given = wiring.settings.get(Port(component, SAMPLE_TIME), description.variables[SAMPLE_TIME].start)
        if not isinstance(given, float) or not given > 0:
            continue  # the FMU refuses it with its own words
        with suppress(TimeError):  # a hair off any step: the FMU takes each sample at the step that is nearest
            found[component] = exact_seconds(given, f"{component}.{SAMPLE_TIME}")
    return found


def _missampled(wiring: Wiring, schedule: Schedule) -> Iterator[WiringError]:
    """Find sampled components of ours whose samples would not come at equal distances: at whole numbers of steps."""
    for component, sample in sample_times(wiring).items():
        step = schedule.step_size * wiring.period(component)
        if (sample / step).denominator != 1 and (step / sample).denominator != 1:
            fits = ", ".join(f"{float(sample / n):.6g}" for n in (1, 2, 5, 10))
            problem = f"{component} samples every {float(sample):g} s, but steps of {float(step):g} s do not meet that"
            yield WiringError(problem, f"Choose a communication step of {fits} s, or a multiple of the sample time.")


def _shortened(wiring: Wiring, schedule: Schedule) -> Iterator[WiringError]:
    """Find FMUs that need a constant step where the last one would be shorter."""
    for component, description in wiring.descriptions.items():
        step = schedule.step * wiring.period(component)
        rest = (schedule.stop - schedule.start) % step
        if rest and not description.can_handle_variable_step:
            whole, last = (f"{count / schedule.denominator:.12g} s" for count in (step, rest))
            problem = f"{component} needs a constant communication step, {whole}, but the last would be {last}"
            yield WiringError(problem, "Choose a stop_time that is a multiple of the step.")


def _mistake(wiring: Wiring, link: Link, late: frozenset[str]) -> WiringError | None:
    a, b = link.source.component, link.target.component
    n, m = wiring.period(a), wiring.period(b)
    rates = f"{a} takes a step in {_steps(n)}, {b} in {_steps(m)}"
    ports = (str(link.source), str(link.target))
    if link.from_start:
        return None
    if link.step_mean and n < m:
        problem = f"{link}: the source is the mean over its last step, but {rates}"
        return WiringError(problem, f"Let {a} step at the rate of {b}, or slower.", ports)
    if n % m and m % n:
        return WiringError(f"{link}: {rates}", 'One must be a multiple of the other, or timing="at_point".', ports)
    if n > m and a in late and (link.step_mean or link.timing != "after_step"):
        problem = f"{link}: {rates}, and {a} waits for faster components, so that its values come too late"
        return WiringError(problem, f'Give the inputs of {a} from faster components timing="at_point".', ports)
    return None


def _steps(n: int) -> str:
    return "every communication step" if n == 1 else f"{n} communication steps"
