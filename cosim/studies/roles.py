"""Which instances of a run are its plants, controllers, clusters and guidance: by what they are, not by their names.

An FMU of ours says what it is (annotations.py); any other is known by its standard variables:
    plant       shows q_BN and omega_BN_B and takes tau_B; a drag-free one shows q_SN and r_rel
    guidance    shows q_RN and does not take it
    controller  takes q_RN, with q_BN or q_SN
    actuators   show tau_B and h_B
A result without a description of its components (run.json) is read by its usual names and its columns.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from cosim.results.result import Result
from fmus.description.description import ModelDescription
from fmus.description.names import split_port

ROLES = ("plant", "guidance", "controller", "actuators")


@dataclass(frozen=True)
class Loop:
    """A plant and what is wired to it, by instance names; "" and (): the run has none."""

    plant: str = ""
    guidance: str = ""
    controllers: tuple[str, ...] = ()
    actuators: tuple[str, ...] = ()

    @property
    def controller(self) -> str:
        """The first controller."""
        return self.controllers[0] if self.controllers else ""


def loops(run: Result) -> list[Loop]:
    """Return a loop for every plant of a run, in the order of declaration; one without a plant where there is none."""
    roles = find(run)
    sources = _sources(run)
    of = {role: [name for name, found in roles.items() if found == role] for role in ROLES}
    return [_loop(plant, of, roles, sources) for plant in of["plant"]] or [
        Loop("", _sole(of["guidance"]), tuple(of["controller"]), tuple(of["actuators"]))
    ]


def find(run: Result) -> dict[str, str]:
    """Return the role of every instance that has one, in the order of declaration."""
    components: Mapping[str, Any] = run.info.get("components") or {}
    if not components:
        return {name: role for name, shown in _columns(run).items() if (role := _by_columns(name, shown))}
    return {
        name: role
        for name, component in components.items()
        if (role := component.get("role") or _by_variables(component.get("inputs", ()), component.get("outputs", ())))
    }


def upstream(run: Result, instance: str) -> set[str]:
    """Return what is connected to an instance of a run, also through instances without one of the four roles."""
    return _upstream(instance, find(run), _sources(run))


def of_descriptions(descriptions: Mapping[str, ModelDescription]) -> dict[str, str]:
    """Return the role of every instance that has one, of a system that has not flown."""
    return {
        name: role
        for name, d in descriptions.items()
        if (role := d.role or _by_variables(d.base_names("input"), d.base_names("output")))
    }


def _by_variables(takes: Iterable[str], shows: Iterable[str]) -> str:
    """Return the role of an instance with these inputs and outputs, "" if it has none."""
    inputs, outputs = set(takes), set(shows)
    if ({"q_BN", "omega_BN_B"} <= outputs and "tau_B" in inputs) or {"q_SN", "r_rel"} <= outputs:
        return "plant"
    if "q_RN" in inputs:
        return "controller" if inputs & {"q_BN", "q_SN"} else ""
    if "q_RN" in outputs:
        return "guidance"
    return "actuators" if {"tau_B", "h_B"} <= outputs else ""


def _by_columns(name: str, shown: set[str]) -> str:
    """Return the role of an instance of which these variables were recorded: by a usual name, else by them."""
    if name in ROLES:
        return name
    if "q_RN" in shown:
        return "controller" if shown & {"q_BN", "q_SN", "tau_command_B", "attitude_error"} else "guidance"
    if shown & {"h_B", "wheel_speed"} and not shown & {"q_BN", "tau_dist_B", "H_N"}:
        return "actuators"
    if shown & {"q_BN", "q_SN", "H_N", "eta", "cage_contact", "tau_B", "tau_dist_B", "f_command_S"}:
        return "plant"
    if shown & {"tau_command_B", "gimbal_lock", "full_turn", "barrier_time"}:
        return "controller"
    return "actuators" if shown & {"h_B", "wheel_speed", "wheel_momentum", "gimbal_rate"} else ""


def _columns(run: Result) -> dict[str, set[str]]:
    found: dict[str, set[str]] = {}
    for name in run.names:
        instance, variable = split_port(name)
        found.setdefault(instance, set()).add(variable)
    return found


def _sources(run: Result) -> dict[str, set[str]]:
    """Return instance -> the instances that are connected to its inputs."""
    found: dict[str, set[str]] = {}
    for target, link in (run.info.get("connections") or {}).items():
        found.setdefault(split_port(target)[0], set()).add(split_port(link["source"])[0])
    return found


def _loop(plant: str, of: Mapping[str, list[str]], roles: Mapping[str, str], sources: Mapping[str, set[str]]) -> Loop:
    controllers = [name for name in of["controller"] if plant in _upstream(name, roles, sources)]
    if not controllers and len(of["plant"]) == 1:
        controllers = of["controller"]
    seen = {name for controller in controllers for name in _upstream(controller, roles, sources)}
    actuators = [name for name in of["actuators"] if name in _upstream(plant, roles, sources)]
    if not actuators and len(of["plant"]) == 1:
        actuators = of["actuators"]
    guidance = next((name for name in of["guidance"] if name in seen), "") or _sole(of["guidance"])
    return Loop(plant, guidance, tuple(controllers), tuple(actuators))


def _upstream(name: str, roles: Mapping[str, str], sources: Mapping[str, set[str]]) -> set[str]:
    """Return what is connected to an instance, also through instances without one of the four roles (sensors, sums)."""
    found: set[str] = set()
    ahead = list(sources.get(name, ()))
    while ahead:
        other = ahead.pop()
        if other not in found:
            found.add(other)
            if roles.get(other) not in ROLES:
                ahead += sources.get(other, ())
    return found


def _sole(names: list[str]) -> str:
    return names[0] if len(names) == 1 else ""
