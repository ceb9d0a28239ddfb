"""Every FMU keeps FMI 2.0's rules for ModelStructure; the check itself finds what is wrong."""

import pytest
from lxml import etree

from fmus.description.write import write
from fmus.export.describe import describe

from .fmi_rules import breaches_in
from .parts import Sum, Swing, Wheel, every


def description(component, derivatives=True) -> bytes:
    return write(describe(component, component.name, derivatives=derivatives))


@pytest.mark.parametrize("derivatives", [True, False], ids=["native", "python"])
@pytest.mark.parametrize("component", every().values(), ids=every().keys())
def test_no_breach(component, derivatives):
    assert breaches_in(description(component, derivatives)) == []


def changed(xml: bytes, path: str, **attributes: str | None) -> bytes:
    """The text with attributes of the first element at a path replaced, or removed where None."""
    root = etree.fromstring(xml)
    element = root.find(path)
    for name, value in attributes.items():
        element.attrib.pop(name, None)
        if value is not None:
            element.set(name, value)
    return etree.tostring(root)


def without(xml: bytes, path: str) -> bytes:
    root = etree.fromstring(xml)
    element = root.find(path)
    element.getparent().remove(element)
    return etree.tostring(root)


def repeated(xml: bytes, path: str) -> bytes:
    root = etree.fromstring(xml)
    element = root.find(path)
    element.addnext(etree.fromstring(etree.tostring(element)))
    return etree.tostring(root)


SWING, WHEEL = description(Swing()), description(Wheel())
NAMES = [v.get("name") for v in etree.fromstring(SWING).findall("ModelVariables/ScalarVariable")]
INDEX = {name: str(i + 1) for i, name in enumerate(NAMES)}
FIRST = "ModelStructure/{}/Unknown"


@pytest.mark.parametrize(
    ("xml", "breach"),
    [
        (without(SWING, FIRST.format("Outputs")), "Outputs: omega[1] is missing"),
        (repeated(SWING, FIRST.format("Outputs")), "Outputs: omega[1] is listed twice"),
        (changed(SWING, FIRST.format("Outputs"), index="999"), "Outputs: index 999 does not exist"),
        (changed(SWING, FIRST.format("Outputs"), index=INDEX["energy"]), "Outputs: not in the order of the variables"),
        (changed(SWING, FIRST.format("Outputs"), index=INDEX["phase"]), "Outputs: phase does not belong here"),
        (
            changed(SWING, FIRST.format("Outputs"), dependencies=f"{INDEX['phase']} {INDEX['omega[1]']}"),
            "Outputs: dependencies of omega[1] are not ordered or not unique",
        ),
        (
            changed(SWING, FIRST.format("Outputs"), dependencies=INDEX["stiffness"]),
            "Outputs: omega[1] depends on stiffness, which is no known",
        ),
        (
            changed(SWING, FIRST.format("Outputs"), dependencies="0"),
            "Outputs: omega[1] depends on variable 0, which does not exist",
        ),
        (
            changed(SWING, FIRST.format("Outputs"), dependenciesKind="dependent dependent dependent"),
            "Outputs: omega[1] has another number of kinds than of dependencies",
        ),
        (
            changed(SWING, FIRST.format("Outputs"), dependencies=None, dependenciesKind="dependent"),
            "Outputs: omega[1] has kinds without dependencies",
        ),
        (without(SWING, FIRST.format("Derivatives")), "Derivatives: der(omega[1]) is missing"),
        (
            changed(SWING, f"ModelVariables/ScalarVariable[{INDEX['der(phase)']}]/Real", derivative=INDEX["stiffness"]),
            "der(phase): derivative of stiffness, which is not continuous",
        ),
        (
            changed(SWING, f"ModelVariables/ScalarVariable[{INDEX['der(phase)']}]/Real", derivative="999"),
            "der(phase): derivative of variable 999, which does not exist",
        ),
        (without(SWING, FIRST.format("InitialUnknowns")), "InitialUnknowns: J_inverse[1,1] is missing"),
        (without(WHEEL, FIRST.format("InitialUnknowns") + "[2]"), "InitialUnknowns: speed is missing"),
        (
            changed(SWING, FIRST.format("InitialUnknowns"), index=INDEX["phase"]),
            "InitialUnknowns: phase does not belong here",
        ),
        (
            changed(SWING, FIRST.format("InitialUnknowns"), dependencies=INDEX["soft"]),
            "InitialUnknowns: J_inverse[1,1] depends on soft, which is no known",
        ),
        (
            changed(SWING, f"ModelVariables/ScalarVariable[{INDEX['phase']}]/Real", start=None),
            "phase: start value missing",
        ),
        (
            changed(SWING, f"ModelVariables/ScalarVariable[{INDEX['energy']}]/Real", start="1"),
            "energy: start value not allowed",
        ),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_breach_is_found(xml, breach):
    assert breach in breaches_in(xml)


def test_sampled_outputs_list_no_discrete_states():
    """Only continuous states are knowns between communication points."""
    root = etree.fromstring(description(Sum()))
    names = [v.get("name") for v in root.findall("ModelVariables/ScalarVariable")]
    listed = {u.get("index"): u.get("dependencies") for u in root.findall("ModelStructure/Outputs/Unknown")}
    assert listed[str(names.index("total") + 1)] == ""
    assert listed[str(names.index("shown") + 1)] == str(names.index("u") + 1)
