"""FMI 2.0's rules for ModelStructure (section 2.2.8), of which fmpy lets some breaches pass."""

import zipfile
from pathlib import Path

from lxml import etree


def fmi_rule_breaches(fmu: Path) -> list[str]:
    """Return what is wrong with the ModelStructure of an FMU, in words; nothing where all is right."""
    with zipfile.ZipFile(fmu) as archive:
        return breaches_in(archive.read("modelDescription.xml"))


def breaches_in(description: bytes) -> list[str]:
    """The same for the text of modelDescription.xml."""
    return _Description(etree.fromstring(description)).breaches()


class _Description:
    def __init__(self, root: etree._Element):
        self.variables = root.findall("ModelVariables/ScalarVariable")
        self.names = [v.get("name") for v in self.variables]
        self.sections = {
            tag: root.findall(f"ModelStructure/{tag}/Unknown") for tag in ("Outputs", "Derivatives", "InitialUnknowns")
        }

    def breaches(self) -> list[str]:
        """All breaches, by section."""
        found = [*self._starts(), *self._rates()]
        for tag, unknowns in self.sections.items():
            indices = [int(u.get("index")) for u in unknowns]
            valid = [i for i in indices if 1 <= i <= len(self.variables)]
            found += [f"{tag}: index {i} does not exist" for i in indices if i not in valid]
            found += [
                f"{tag}: {self.names[i - 1]} is listed twice" for i in sorted({i for i in valid if valid.count(i) > 1})
            ]
            if indices != sorted(indices):
                found.append(f"{tag}: not in the order of the variables")
            wanted = {"Outputs": self._outputs, "Derivatives": self._derivatives, "InitialUnknowns": self._initial}[
                tag
            ]()
            found += [f"{tag}: {self.names[i]} is missing" for i in sorted(wanted - {i - 1 for i in valid})]
            found += [f"{tag}: {self.names[i - 1]} does not belong here" for i in valid if i - 1 not in wanted]
            for unknown in unknowns:
                found += self._dependencies(tag, unknown)
        return found

    def _indices(self, choose) -> set[int]:
        return {i for i, v in enumerate(self.variables) if choose(v)}

    def _outputs(self) -> set[int]:
        return self._indices(lambda v: v.get("causality") == "output")

    def _derivatives(self) -> set[int]:
        return self._indices(lambda v: v.find("Real") is not None and v.find("Real").get("derivative"))

    def _states(self) -> set[int]:
        chosen = (self.variables[i].find("Real").get("derivative") for i in self._derivatives())
        return {int(i) - 1 for i in chosen if 1 <= int(i) <= len(self.variables)}

    def _initial(self) -> set[int]:
        computed = self._indices(lambda v: v.get("initial") in ("approx", "calculated"))
        parameters = self._indices(lambda v: v.get("causality") == "calculatedParameter")
        return computed & (self._outputs() | self._states() | self._derivatives()) | parameters

    def _knowns(self, tag: str) -> set[int]:
        known = self._indices(lambda v: v.get("causality") in ("input", "independent"))
        if tag == "InitialUnknowns":
            return known | self._indices(lambda v: v.get("initial") == "exact")
        return known | self._states()

    def _rates(self) -> list[str]:
        found = []
        for i in sorted(self._derivatives()):
            at = int(self.variables[i].find("Real").get("derivative"))
            if not 1 <= at <= len(self.variables):
                found.append(f"{self.names[i]}: derivative of variable {at}, which does not exist")
            elif self.variables[at - 1].get("variability") != "continuous":
                found.append(f"{self.names[i]}: derivative of {self.names[at - 1]}, which is not continuous")
        return found

    def _starts(self) -> list[str]:
        """A start value belongs to inputs and to initial = exact or approx, and to nothing else."""
        found = []
        for name, v in zip(self.names, self.variables, strict=True):
            needs = v.get("causality") == "input" or v.get("initial") in ("exact", "approx")
            if needs != (v[0].get("start") is not None):
                found.append(f"{name}: start value {'missing' if needs else 'not allowed'}")
        return found

    def _dependencies(self, tag: str, unknown: etree._Element) -> list[str]:
        text, kinds = unknown.get("dependencies"), unknown.get("dependenciesKind")
        index = int(unknown.get("index"))
        name = self.names[index - 1] if 1 <= index <= len(self.names) else str(index)
        if text is None:
            return [f"{tag}: {name} has kinds without dependencies"] if kinds is not None else []
        listed = [int(i) for i in text.split()]
        found = []
        if kinds is not None and len(kinds.split()) != len(listed):
            found.append(f"{tag}: {name} has another number of kinds than of dependencies")
        if listed != sorted(set(listed)):
            found.append(f"{tag}: dependencies of {name} are not ordered or not unique")
        known = self._knowns(tag)
        for i in listed:
            if not 1 <= i <= len(self.variables):
                found.append(f"{tag}: {name} depends on variable {i}, which does not exist")
            elif i - 1 not in known:
                found.append(f"{tag}: {name} depends on {self.names[i - 1]}, which is no known")
        return found
