"""What a flight of a package has shown, as resource meta data of SSP Traceability 1.0 (.srmd) within the package.

A `Classification` is a list of keywords with texts: one of the flight, one of its metrics, one for each claim that it
decides, with the verdict and what it was judged by. Simulation task meta data (.stmd) tell of a whole process of
orders, phases and responsible persons, of which a system knows nothing.
"""

from collections.abc import Mapping, Sequence

from cosim.ssp.xml import SSC, Element

FILE = "extra/org.ssp-standard.ssp-traceability.srmd/resourceMetaData.srmd"
"""Where the standard has the meta data of a package as a whole."""

TRACEABILITY = "http://ssp-standard.org/SSPTraceability1"
SRMD, STC = f"{TRACEABILITY}/SimulationResourceMetaData", f"{TRACEABILITY}/SSPTraceabilityCommon"
TYPE = "org.adcs-cosim"


def trace(
    name: str,
    flight: Mapping[str, str],
    metrics: Mapping[str, str],
    claims: Sequence[Mapping[str, str]],
    made: Mapping[str, str],
) -> bytes:
    """Return the meta data of a system `name`; `made`: attributes that say who made the file."""
    from lxml import etree

    attributes = {"version": "1.0", "name": name, **made}
    names = {"srmd": SRMD, "stc": STC, "ssc": SSC}
    root = etree.Element(f"{{{SRMD}}}SimulationResourceMetaData", attributes, nsmap=names)
    _classify(root, f"{TYPE}.flight", flight)
    _classify(root, f"{TYPE}.metrics", metrics)
    for number, claim in enumerate(claims, 1):
        _classify(root, f"{TYPE}.claim.{number}", claim)
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)


def _classify(root: Element, kind: str, entries: Mapping[str, str]) -> None:
    from lxml import etree

    if not entries:
        return
    parent = etree.SubElement(root, f"{{{STC}}}Classification", type=kind)
    for keyword, text in entries.items():
        etree.SubElement(parent, f"{{{STC}}}ClassificationEntry", keyword=keyword).text = text
