"""Signals in a package: for other tools an FMU beside each component that they feed, for this one the samples.

Such an FMU, `plant_signals` of `plant`, has outputs of the names and units of the inputs that it feeds. The samples lie
beside it as CSV, and the annotation says which signal they are:

    <adcs:Signals>{"plant_signals": {"guid": ..., "inputs": {"plant.tau_dist_B": {"file": ..., "sha256": ...,
        "columns": [...], "interpolation": "linear"}}}}

Read again they are signals where FMU, samples and connections are those that were written; else the FMU flies.
"""

import csv
import hashlib
import io
import logging
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from cosim.errors import SignalError, UnknownName
from cosim.ssp.archive import file_name
from cosim.ssp.errors import SspError
from cosim.ssp.flatten import Flat
from cosim.ssp.package import Package
from cosim.system import Connection, Signal, System
from cosim.system.wiring import Port, Wiring
from fmus.description.description import ModelDescription
from fmus.description.names import split_port
from fmus.description.read import read_description
from fmus.description.units import IDENTITY

Told = dict[str, Any]

_log = logging.getLogger(__name__)


def instance_names(wiring: Wiring) -> dict[str, str]:
    """Return what the signals of a wiring are called as instances in a package, by the names of their feeds."""
    found: dict[str, str] = {}
    for name, feed in wiring.feeds.items():
        called = f"{feed.component}_signals"
        while called in wiring.descriptions or called in found.values():
            called += "_"
        found[name] = called
    return found


def with_tables(wiring: Wiring, tables: Mapping[str, Path]) -> tuple[Wiring, dict[str, Path]]:
    """Return a wiring whose signals are instances of FMUs, and these by instance; `tables`: feed -> its FMU."""
    names = instance_names(wiring)
    descriptions = {
        names.get(n, n): read_description(tables[n]) if n in names else d for n, d in wiring.descriptions.items()
    }
    links = [
        replace(link, source=Port(names[link.source.component], link.target.variable), conversion=IDENTITY)
        if link.fed
        else link
        for link in wiring.links
    ]
    changed = replace(wiring, descriptions=descriptions, links=tuple(links), feeds={})
    return changed, {names[name]: path for name, path in tables.items()}


def written(system: System, wiring: Wiring, tables: Mapping[str, Path]) -> tuple[Told, dict[str, bytes]]:
    """Return what the annotation says of signals, and the files of their samples, by name in the archive."""
    told: Told = {}
    files: dict[str, bytes] = {}
    for feed, called in instance_names(wiring).items():
        inputs: Told = {}
        for key, signal in system.inputs.items():
            instance, variable = split_port(key)
            if instance != wiring.feeds[feed].component:
                continue
            columns = list(wiring.descriptions[instance].find(variable, "input", instance).elements)
            name = f"resources/{file_name(called)}-{len(inputs) + 1}.csv"
            files[name] = _csv(signal, columns)
            digest = hashlib.sha256(files[name]).hexdigest()
            about = {"file": name, "sha256": digest, "columns": columns, "interpolation": signal.interpolation}
            inputs[key] = about
        told[called] = {"guid": read_description(tables[feed]).guid, "inputs": inputs}
    return told, files


def _csv(signal: Signal, columns: Iterable[str]) -> bytes:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    unit = f" ({signal.unit})" if signal.unit is not None else ""
    writer.writerow(["time (s)", *(f"{column}{unit}" for column in columns)])
    for t, row in zip(signal.time.tolist(), signal.values.tolist(), strict=True):
        writer.writerow([repr(t), *map(repr, row)])
    return text.getvalue().encode()


def recognised(flat: Flat, told: Told, package: Package) -> tuple[Flat, dict[str, Signal]]:
    """Return a flat system without the FMUs that are signals of ours, and these by input; raises `SspError`."""
    inputs: dict[str, Signal] = {}
    for instance, about in told.items():
        found, guid, parts = flat.descriptions.get(instance), about["guid"], about["inputs"].items()
        if found is None or found.guid != guid or not _as_connected(flat, instance, [key for key, _ in parts]):
            continue
        changed = [c for _, said in parts if (c := _changed(package, said["file"], said["sha256"]))]
        if changed:
            _log.warning("%s: %s flies as the FMU that it is: %s", package.label, instance, changed[0])
            continue
        inputs |= {key: _signal(package, said) for key, said in parts}
        flat = replace(
            flat,
            components={n: c for n, c in flat.components.items() if n != instance},
            descriptions={n: d for n, d in flat.descriptions.items() if n != instance},
            links=[link for link in flat.links if split_port(link.source)[0] != instance],
        )
    return flat, inputs


def _as_connected(flat: Flat, instance: str, keys: Iterable[str]) -> bool:
    """Whether an instance feeds, each unchanged, all elements of these inputs and nothing else."""
    here = [c for c in flat.links if split_port(c.source)[0] == instance]
    wanted: set[Connection] = set()
    for key in keys:
        component, variable = split_port(key)
        try:
            elements = flat.descriptions[component].find(variable, "input", component).elements
        except (KeyError, UnknownName):
            return False
        wanted |= {Connection(f"{instance}.{e}", f"{component}.{e}") for e in elements}
    return len(here) == len(wanted) and set(here) == wanted


def _changed(package: Package, name: str, digest: str) -> str:
    """Return in which way samples are not those that were written, "" where they are."""
    if name not in package.names:
        return f"{name} is not there"
    same = hashlib.sha256(package.file(name).read_bytes()).hexdigest() == digest
    return "" if same else f"{name} is not what was written"


def _signal(package: Package, said: Told) -> Signal:
    label = f"{package.label}#{said['file']}"
    try:
        found = Signal(package.file(said["file"]), said["columns"], interpolation=said["interpolation"])
    except SignalError as error:
        raise SspError(label, [error.problem]) from error
    return found.named(label)


def fed(inputs: Mapping[str, Signal], descriptions: Mapping[str, ModelDescription]) -> set[Port]:
    """Return the variables that signals feed."""
    found: set[Port] = set()
    for key in inputs:
        component, variable = split_port(key)
        elements = descriptions[component].find(variable, "input", component).elements
        found |= {Port(component, element) for element in elements}
    return found
