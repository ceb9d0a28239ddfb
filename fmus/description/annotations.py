"""What our FMUs tell our master beyond FMI 2.0: VendorAnnotations, parameters and words with a meaning of their own.

    <VendorAnnotations><Tool name="adcs-cosim"><Slave refresh="true" sampled="false" role="actuators"
            inputDerivatives="3">
        <StepMean variable="tau_B[1]" of="h_B[1]"/><RateActs variable="h_B[1]"/><Shared variable="spin_axes_B[1,1]"/>

refresh: outputs may be read again after a set, without a step. sampled: the FMU has samples instead of a continuous
state. inputDerivatives: up to which order fmi2SetRealInputDerivatives takes them. role: what it is in a loop, as in
"plant" or "controller". StepMean: an output that is a mean over the last communication step; `of`: the output whose
rate, up to its sign, is meant. RateActs: an input whose rate acts on the FMU too, so that its step mean must not come
in beside it. Shared: a parameter of the whole vehicle, which has one value wherever it is known.

Any other FMU lacks them. Read and written here only; the element classes are those of the caller.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

TOOL = "adcs-cosim"
"""Our name in VendorAnnotations, and the generation tool of our FMUs."""

SOLVER_STEP = "solver.step"
"""Parameter of FMUs with continuous states: the largest internal step, s; 0: the FMU chooses it."""
STEP_TAKEN = "solver.step_taken"
"""Variable of FMUs with continuous states: the internal step of the last communication step, s; before it 0."""
SAMPLE_TIME = "sample_time"
"""Parameter of sampled FMUs: the time between two samples, s."""
COMMIT_SHOWN = "solver.commit_shown"
"""Parameter of sampled FMUs: 1 where the inputs set before a step are those of its end, not of a sample due now."""

FILTER = "filter"
"""Role of FMUs that are made for the width and the unit of what goes through them."""

INPUTS_REFUSED = "its inputs are refused: fmi2DoStep needs others, till then their start values stand for them"
"""What an FMU says in initialization mode at last, after a word on each input that a condition refuses."""

GROWS = "which RK4 lets grow"
"""In the warning of an FMU whose internal step is so long that RK4 makes grow what decays (as in fmi2.c)."""


@dataclass(frozen=True)
class Annotations:
    """The marks of one FMU, with names of variables as they stand in the file; `step_means`: mean -> what it is of."""

    refresh: bool = False
    sampled: bool = False
    input_derivatives: int = 0
    role: str = ""
    step_means: Mapping[str, str] = field(default_factory=dict)
    rates_act: tuple[str, ...] = ()
    shared: tuple[str, ...] = ()


def read_annotations(root: Any) -> Annotations:
    """Return the marks under an fmiModelDescription element; none of them where it is not ours."""
    slave = root.find(f"VendorAnnotations/Tool[@name='{TOOL}']/Slave")
    if slave is None:
        return Annotations()
    return Annotations(
        refresh=slave.get("refresh") == "true",
        sampled=slave.get("sampled") == "true",
        input_derivatives=_whole(slave.get("inputDerivatives", "")),
        role=slave.get("role", ""),
        step_means={e.get("variable", ""): e.get("of", "") for e in slave.findall("StepMean")},
        rates_act=tuple(e.get("variable", "") for e in slave.findall("RateActs")),
        shared=tuple(e.get("variable", "") for e in slave.findall("Shared")),
    )


def _whole(text: str) -> int:
    return int(text) if text.isdecimal() else 0


def write_annotations(root: Any, marked: Annotations) -> None:
    """Append VendorAnnotations to an fmiModelDescription element, where there is anything to mark."""
    if marked == Annotations():
        return
    marks = {"refresh": str(marked.refresh).lower(), "sampled": str(marked.sampled).lower()}
    if marked.input_derivatives:
        marks["inputDerivatives"] = str(marked.input_derivatives)
    if marked.role:
        marks["role"] = marked.role
    parent = root
    for tag, attributes in (("VendorAnnotations", {}), ("Tool", {"name": TOOL}), ("Slave", marks)):
        child = parent.makeelement(tag, attributes)
        parent.append(child)
        parent = child
    for name, of in marked.step_means.items():
        parent.append(parent.makeelement("StepMean", {"variable": name, **({"of": of} if of else {})}))
    for tag, names in (("RateActs", marked.rates_act), ("Shared", marked.shared)):
        for name in names:
            parent.append(parent.makeelement(tag, {"variable": name}))
