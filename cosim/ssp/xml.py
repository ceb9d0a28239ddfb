"""The XML of SSP 1.0 and 2.0: parsed without entities and without the network, and held against the schemas.

Both versions have one set of namespaces; a file says which it is of. pyssp-standard brings the schemas; it is not
imported, its files are read.
"""

from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from cosim.ssp.errors import SspError

Element = Any  # lxml gives its element class no public name

SSP = "http://ssp-standard.org/SSP1/SystemStructure"
SSD, SSV, SSM, SSC = f"{SSP}Description", f"{SSP}ParameterValues", f"{SSP}ParameterMapping", f"{SSP}Common"
SCHEMAS = {
    f"{{{SSD}}}SystemStructureDescription": "SystemStructureDescription.xsd",
    f"{{{SSV}}}ParameterSet": "SystemStructureParameterValues.xsd",
    f"{{{SSM}}}ParameterMapping": "SystemStructureParameterMapping.xsd",
}
"""The root element of each kind of file, and its schema."""

FOLDERS = {"1": "", "2": "ssp2"}
"""The version before its dot, and the folder of its schemas."""


def parse(text: bytes, root: str, file: str) -> Element:
    """Return the root element of a file, which must be `root` and keep to its schema; raises `SspError`."""
    from lxml import etree

    parser = etree.XMLParser(
        resolve_entities=False, no_network=True, load_dtd=False, huge_tree=False, remove_comments=True, remove_pis=True
    )
    try:
        element = etree.fromstring(text, parser)
    except (etree.XMLSyntaxError, ValueError, LookupError) as error:
        raise SspError(file, [f"it is no XML: {error}"]) from error
    if element.getroottree().docinfo.internalDTD is not None:
        raise SspError(file, ["it declares a document type (DOCTYPE): SSP has none, and entities are not read"])
    check(element, root, file)
    return element


def check(element: Element, root: str, file: str) -> None:
    """Hold an element, a file's root or one within another file, against its schema; raises `SspError`."""
    if element.tag != root:
        raise SspError(file, [f"its element is {_plain(element.tag)}, needed is {_plain(root)}"])
    version = element.get("version", "")
    folder = FOLDERS.get(version.partition(".")[0])
    if folder is None:
        raise SspError(file, [f"it is of SSP version {version or 'none'}, read are 1.0 and 2.0"])
    schema = _schema(folder, SCHEMAS[root])
    if not schema.validate(element):
        found = [f"line {e.line}: {_readable(e.message)}" for e in schema.error_log]
        more = [f"and {len(found) - 3} more"] if len(found) > 3 else []
        raise SspError(file, [f"it breaks the schema of SSP {version}, {'; '.join(found[:3] + more)}"])


@cache
def _schema(folder: str, name: str) -> Any:
    from lxml import etree

    return etree.XMLSchema(file=str(schemas() / folder / name))


def schemas() -> Path:
    """Return the folder of the schemas; raises `SspError` where they are not installed."""
    spec = find_spec("pyssp_standard")
    places = [] if spec is None else list(spec.submodule_search_locations or ())
    folder = Path(places[0]) / "resources" if places else None
    if folder is None or not (folder / SCHEMAS[f"{{{SSD}}}SystemStructureDescription"]).is_file():
        raise SspError("SSP", ["its schemas are not installed: pip install 'pyssp-standard>=0.9,<0.10'"])
    return folder


def _readable(message: str) -> str:
    """Return a message of the validator without the namespaces."""
    for namespace in (SSD, SSV, SSM, SSC):
        message = message.replace(f"{{{namespace}}}", "")
    return message


def _plain(tag: object) -> str:
    return str(tag).rpartition("}")[2]
