"""What our FMUs tell our master beyond FMI 2.0: VendorAnnotations, and parameters with a meaning of their own.

    <VendorAnnotations><Tool name="adcs-cosim"><Slave refresh="true" sampled="false"><StepMean variable="tau_B[1]"/>

refresh: outputs may be read again after a set, without a step. sampled: the FMU has samples instead of a continuous
state. StepMean: an output that is the mean over the last communication step.

Any other FMU lacks them. Read and written here only; the element classes are those of the caller.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

TOOL = "adcs-cosim"
"""Our name in VendorAnnotations, and the generation tool of our FMUs."""

SOLVER_STEP = "solver.step"
"""Parameter of FMUs with continuous states: the largest internal step, s."""
SAMPLE_TIME = "sample_time"
"""Parameter of sampled FMUs: the time between two samples, s."""
COMMIT_SHOWN = "solver.commit_shown"
"""Parameter of sampled FMUs: 1 where the inputs set before a step are those of its end, not of a sample due now."""


@dataclass(frozen=True)
class Annotations:
    """The marks of one FMU; `step_means`: names of variables as they stand in the file."""

    refresh: bool = False
    sampled: bool = False
    step_means: tuple[str, ...] = ()


def read_annotations(root: Any) -> Annotations:
    """Return the marks under an fmiModelDescription element; none of them where it is not ours."""
    slave = root.find(f"VendorAnnotations/Tool[@name='{TOOL}']/Slave")
    if slave is None:
        return Annotations()
    means = tuple(e.get("variable", "") for e in slave.findall("StepMean"))
    return Annotations(slave.get("refresh") == "true", slave.get("sampled") == "true", means)


def write_annotations(root: Any, refresh: bool, sampled: bool, step_means: Iterable[str]) -> None:
    """Append VendorAnnotations to an fmiModelDescription element, where there is anything to mark."""
    means = tuple(step_means)
    if not (refresh or sampled or means):
        return
    marks = {"refresh": str(refresh).lower(), "sampled": str(sampled).lower()}
    parent = root
    for tag, attributes in (("VendorAnnotations", {}), ("Tool", {"name": TOOL}), ("Slave", marks)):
        child = parent.makeelement(tag, attributes)
        parent.append(child)
        parent = child
    for name in means:
        parent.append(parent.makeelement("StepMean", {"variable": name}))
