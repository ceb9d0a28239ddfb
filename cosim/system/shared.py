"""Parameters of the whole vehicle that instances hold different values of although nobody set them.

An FMU of ours marks such parameters (`shared` in annotations.py); a foreign FMU that has one of the same name and unit
is meant too.
"""

from cosim.system.wiring import Port, Wiring
from fmus.description.description import ModelDescription, Scalar
from fmus.description.names import Group, nested


def disagreements(wiring: Wiring) -> list[str]:
    """Return a line for each vehicle parameter whose start values differ between instances that nothing set it in."""
    lines: list[str] = []
    for name, unit in sorted(_marked(wiring)):
        held = _start_values(wiring, name, unit)
        distinct = list(dict.fromkeys(map(str, held.values())))
        sizes = {_shape(value) for value in held.values()}
        if len(distinct) > 1 and len(sizes) == 1:
            values = "; ".join(
                f"{value} in {', '.join(i for i in held if str(held[i]) == value)}" for value in distinct
            )
            lines.append(
                f"nothing sets {name}, and its start values differ: {values}. "
                f'Set it for all: System(vehicle={{"{name}": ...}}), --set "*.{name}=..."'
            )
    return lines


def _marked(wiring: Wiring) -> set[tuple[str, str]]:
    """Return name and unit of every parameter that an FMU marks."""
    found: set[tuple[str, str]] = set()
    for fmu in wiring.descriptions.values():
        shared = [(base, g.elements[0]) for base, g in fmu.groups.items() if g.elements[0] in fmu.shared]
        found |= {(base, fmu.variables[first].unit or "") for base, first in shared}
    return found


def _start_values(wiring: Wiring, name: str, unit: str) -> dict[str, object]:
    """Return instance -> the start value of a parameter, where no element of it was set."""
    found: dict[str, object] = {}
    for instance, fmu in wiring.descriptions.items():
        group = fmu.groups.get(name)
        if group is None or not fmu.variables[group.elements[0]].is_parameter:
            continue
        if (fmu.variables[group.elements[0]].unit or "") != unit:
            continue
        if not any(Port(instance, e) in wiring.settings for e in group.elements):
            found[instance] = nested(_starts(fmu, group), group.shape)
    return found


def _starts(fmu: ModelDescription, group: Group) -> list[Scalar | None]:
    return [fmu.variables[e].start for e in group.elements]


def _shape(value: object) -> tuple[int, ...]:
    """Return the shape of nested lists."""
    return (len(value), *_shape(value[0])) if isinstance(value, list) and value else ()
