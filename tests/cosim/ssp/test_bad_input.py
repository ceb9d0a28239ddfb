"""What cannot be read is refused before a step, by a sentence that names the file, the thing and what there is."""

import io
import stat
import zipfile

import pytest

from cosim import load
from cosim.ssp.errors import SspError
from cosim.ssp.package import LARGEST_TEXT, Package, extracted
from fmus.description.archive import LARGEST

from .packages import (
    CONNECTORS,
    HEAD,
    bindings,
    component,
    connection,
    inline,
    package,
    parameter,
    parameter_set,
    refused,
    structure,
    system,
)

GOOD = structure(system("s", component("a") + component("b"), connection("a.y", "b.u")))


class TestArchives:
    def written(self, tmp_path, *entries):
        path = tmp_path / "a.ssp"
        with zipfile.ZipFile(path, "w") as archive:
            for entry, content in entries:
                archive.writestr(entry, content)
        return path

    @pytest.mark.parametrize("name", ["../../outside.fmu", "/etc/outside.fmu", "a\\..\\b.fmu", "C:outside.fmu"])
    def test_a_file_that_leaves_it(self, tmp_path, name):
        said = refused(self.written(tmp_path, ("SystemStructure.ssd", GOOD), (name, "x")))
        assert f"its file {name!r} has a name that leads out of the archive" in said

    def test_a_symbolic_link(self, tmp_path):
        link = zipfile.ZipInfo("resources/a.ssv")
        link.create_system, link.external_attr = 3, (stat.S_IFLNK | 0o777) << 16
        said = refused(self.written(tmp_path, ("SystemStructure.ssd", GOOD), (link, "/etc/passwd")))
        assert "is a symbolic link: a system structure package has files" in said

    def test_more_than_can_be_meant(self, tmp_path, monkeypatch):
        """A zip bomb says how large it is, and is not unpacked; here the limits are small, so that a test can be."""
        path = self.written(tmp_path, ("SystemStructure.ssd", GOOD), ("resources/zeros", bytes(2**20)))
        assert LARGEST == 2**31 and LARGEST_TEXT == 2**26
        monkeypatch.setattr("fmus.description.archive.LARGEST", 2**19)
        assert "bytes unpacked, at most 524288 are taken" in refused(path)
        monkeypatch.setattr("fmus.description.archive.LARGEST", LARGEST)
        monkeypatch.setattr("cosim.ssp.package.LARGEST_TEXT", 100)
        assert "its file 'SystemStructure.ssd' has" in refused(path) and "at most 100 are read" in refused(path)

    def test_a_size_that_is_not_true(self, tmp_path):
        """A directory that says 10 bytes of a megabyte: no more than it says is read, and the sum is wrong."""
        ssd = GOOD + "<!--" + " " * 2**20 + "-->"
        path = tmp_path / "a.ssp"
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("SystemStructure.ssd", ssd)
        size = len(ssd.encode()).to_bytes(4, "little")
        path.write_bytes(path.read_bytes().replace(size, (10).to_bytes(4, "little")))
        assert "CRC" in refused(path)

    def test_one_that_is_cut(self, fmus, tmp_path):
        path = package(tmp_path / "a.ssp", GOOD, fmus)
        whole = path.read_bytes()
        path.write_bytes(whole[:300])
        assert "it is no readable zip archive" in refused(path)
        path.write_bytes(whole[:-200])  # the last FMU is at the end now, an archive too
        assert "It has the files of an FMU: it is one, or it was cut" in refused(path)

    def test_one_that_is_damaged_within(self, fmus, tmp_path):
        path = package(tmp_path / "a.ssp", GOOD, fmus)
        data = bytearray(path.read_bytes())
        at = data.index(b"<ssd:Elements>")
        data[at + 5] ^= 1
        path.write_bytes(data)
        assert "it is no readable zip archive: Bad CRC-32 for file 'SystemStructure.ssd'" in refused(path)

    def test_no_structure(self, tmp_path):
        said = refused(self.written(tmp_path, ("other.ssd", GOOD), ("sub/SystemStructure.ssd", GOOD)))
        assert "there is no SystemStructure.ssd at its top, which a system needs" in said
        assert "Descriptions: other.ssd, sub/SystemStructure.ssd" in said

    @pytest.mark.filterwarnings("ignore:Duplicate name")
    def test_two_files_of_one_name(self, tmp_path):
        said = refused(self.written(tmp_path, ("SystemStructure.ssd", GOOD), ("SystemStructure.ssd", GOOD)))
        assert "it holds two files of one name, 'SystemStructure.ssd'" in said

    def test_no_archive_no_file_a_folder(self, tmp_path):
        (tmp_path / "text.ssp").write_text("no zip")
        (tmp_path / "folder.ssp").mkdir()
        assert "it is no readable zip archive" in refused(tmp_path / "text.ssp")
        assert "it is not a system structure package, for it is a folder" in refused(tmp_path / "folder.ssp")
        assert "there is no such file" in refused(tmp_path / "missing.ssp")

    def test_a_reference_into_one(self, fmus, tmp_path):
        path = package(tmp_path / "a.ssp", GOOD, fmus)
        with pytest.raises(SspError, match=r"there is no file 'resources/No.fmu' inside"):
            extracted(f"{path}#resources/No.fmu")
        with pytest.raises(SspError, match="lies outside of it: only its own files are read"):
            Package.of(path).resolve("../a.fmu", "SystemStructure.ssd")


class TestXml:
    def refused(self, fmus, tmp_path, ssd, files=None):
        return refused(package(tmp_path / "a.ssp", ssd, fmus, files))

    def test_an_external_entity(self, fmus, tmp_path):
        secret = tmp_path / "secret"
        secret.write_text("the secret")
        doctype = f'<!DOCTYPE x [<!ENTITY x SYSTEM "{secret.as_uri()}">]>'
        ssd = GOOD.replace(HEAD, HEAD + doctype).replace('name="made"', 'name="made" description="&x;"')
        said = self.refused(fmus, tmp_path, ssd)
        assert "secret" not in said.replace(str(secret), "") and ("DOCTYPE" in said or "entity" in said.lower())
        in_text = GOOD.replace(HEAD, HEAD + doctype).replace("<ssd:Elements>", "&x;<ssd:Elements>")
        assert "it declares a document type (DOCTYPE)" in self.refused(fmus, tmp_path, in_text)

    def test_entities_that_multiply(self, fmus, tmp_path):
        laughs = '<!ENTITY a0 "ha">' + "".join(f'<!ENTITY a{n} "{f"&a{n - 1};" * 10}">' for n in range(1, 12))
        ssd = GOOD.replace(HEAD, f"{HEAD}<!DOCTYPE x [{laughs}]>").replace('"made"', '"&a11;"')
        said = self.refused(fmus, tmp_path, ssd)
        assert "it is no XML" in said or "DOCTYPE" in said

    def test_no_xml(self, fmus, tmp_path):
        assert "a.ssp#SystemStructure.ssd: it is no XML: " in self.refused(fmus, tmp_path, GOOD[:200])

    @pytest.mark.parametrize(
        ("old", "new", "said"),
        [
            ('kind="input"', 'kind="in"', "line 2: Element 'Connector', attribute 'kind'"),
            ("<ssd:Elements>", "<ssd:Elements><ssd:Component/>", "The attribute 'name' is required but missing"),
            ('stopTime="1"', 'stopTime="soon"', "'soon' is not a valid value of the atomic type 'xs:double'"),
            ('version="1.0" name', 'version="3.0" name', "it is of SSP version 3.0, read are 1.0 and 2.0"),
            ("SystemStructureDescription version", "SystemStructure version", "it is no XML"),
        ],
    )
    def test_what_breaks_the_schema(self, fmus, tmp_path, old, new, said):
        assert said in self.refused(fmus, tmp_path, GOOD.replace(old, new, 1))

    def test_another_kind_of_file(self, fmus, tmp_path):
        ssv = HEAD + parameter_set(namespaces='xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues"')
        said = self.refused(fmus, tmp_path, ssv)
        assert "its element is ParameterSet, needed is SystemStructureDescription" in said

    def test_a_parameter_set_that_breaks_its_schema(self, fmus, tmp_path):
        part = component("a", inside=bindings(inline(parameter_set(parameter("c", "much")))))
        assert "'much' is not a valid value" in self.refused(fmus, tmp_path, structure(system("s", part)))

    def test_schemas_that_are_not_there(self, fmus, tmp_path, monkeypatch):
        from cosim.ssp import xml

        xml._schema.cache_clear()
        monkeypatch.setattr("cosim.ssp.xml.find_spec", lambda _name: None)
        assert "its schemas are not installed: pip install 'pyssp-standard" in self.refused(fmus, tmp_path, GOOD)
        xml._schema.cache_clear()


def top(elements="", connections="", version="1.0", **more):
    return structure(system("s", elements or component("a") + component("b"), connections, **more), version=version)


OUT = '<ssd:Connector name="out" kind="output"/>'
OTHER = '<ssd:Component name="x" {}/>'
TABLE = "<ssc:{0}MappingTransformation><ssc:MapEntry source='{1}' target='{2}'/></ssc:{0}MappingTransformation>"
SIGNALS = '<ssd:SignalDictionaries><ssd:SignalDictionary name="d"/></ssd:SignalDictionaries></ssd:System>'


def connector(text):
    return component("a", connectors=text)


@pytest.mark.parametrize(
    ("ssd", "said"),
    [
        (top(connections=connection("a.y", "c.u")), "an end on 'c', which is no element. Elements: a, b"),
        (top(connections=connection("a.z", "b.u")), "'a' has no connector 'z'. Connectors: u, y"),
        (top(connections=connection("in", "b.u")), "'s' has no connector 'in'. Connectors: none"),
        (top(connections=connection("a.u", "b.u")), "a.u -> b.u has no direction: input and input both take"),
        (top(connections=connection("a.y", "b.y")), "has no direction: output and output both give"),
        (
            top(connections=connection("a.y", "out") + connection("b.y", "out"), connectors=OUT),
            "out has two sources, a.y, b.y",
        ),
        (top(connections=connection("a.y", "b.u") + connection("b.y", "b.u")), "b.u has two sources, a.y, b.y"),
        (top(component("a") + component("a")), "two elements of the system 's' have one name, 'a'"),
        (top(connector(CONNECTORS + CONNECTORS)), "two connectors of 'a' have one name, 'u'"),
        (top(component("a.b") + component("a_b")), "a_b and a.b would have one name here, a_b: rename one"),
        (top(connector('<ssd:Connector name="q" kind="input"/>')), 'unknown variable "q" in the FMU of a'),
        (
            top(connector('<ssd:Connector name="u" kind="output"/>')),
            "the connector a.u is of kind output, but its variable of causality input",
        ),
        (
            top(connector('<ssd:Connector name="u" kind="input"><ssc:Boolean/></ssd:Connector>')),
            "the connector a.u is Boolean, but its variable Real",
        ),
        (top(component("a", "None")), "there is no file 'resources/None.fmu' inside, which the component 'a' is"),
        (top(OTHER.format('source="../../a.fmu"')), "its source '../../a.fmu' lies outside of it"),
        (top(OTHER.format('source="/etc/a.fmu"')), "its source '/etc/a.fmu' lies outside of it"),
        (
            top(OTHER.format('source="https://example.org/a.fmu"')),
            "its source 'https://example.org/a.fmu' lies outside of it",
        ),
        (top(OTHER.format('source="a.exe"')), "the source of the component 'x', 'a.exe', is no .fmu file"),
        (
            top(OTHER.format('source="a.fmu" type="application/x-thing"')),
            "is of type 'application/x-thing', flown are FMUs",
        ),
        (
            top(component("a", more='implementation="ModelExchange"')),
            "'a' is to be flown as ModelExchange, which is not implemented here",
        ),
        (top(OTHER.format('type="application/x-ssp-definition" source="#y"')), "the system with the id 'y': none has"),
        (top(OTHER.format('type="application/x-ssp-definition" source="y.ssd"')), "there is no file 'y.ssd' inside"),
        (
            top('<ssd:SignalDictionaryReference name="d" dictionary="e"/>'),
            "'d' refers to a signal dictionary, which is not implemented here",
        ),
        (top().replace("</ssd:System>", SIGNALS), "'s' has signal dictionaries (.ssb), which is not implemented here"),
        (top(connector('<ssd:Connector name="u" kind="inout"/>')), "a.u is of kind inout, as of signal dictionaries"),
        (
            top(connector('<ssd:Connector name="u" kind="input"><ssc:Binary/></ssd:Connector>')),
            "a.u is Binary, which is not implemented",
        ),
        (
            top(connections=connection("a.y", "b.u", TABLE.format("Integer", 1, 2))),
            "a.y -> b.u has a IntegerMappingTransformation, which",
        ),
        (
            top(
                component("a", connectors='<ssd:Connector name="k" kind="parameter"/>')
                + component("b", connectors=CONNECTORS),
                connection("b.y", "a.k"),
            ),
            "b.y -> a.k is of parameters",
        ),
        (
            top(connections=connection("a.y", "b.u", more='startIndices="1"'), version="2.0"),
            "single elements of arrays (startIndices",
        ),
        (top('<ssd:Component name="x"/>', version="2.0"), "the component 'x' has no source: there is nothing to fly"),
    ],
)
def test_structures(fmus, tmp_path, ssd, said):
    assert said in refused(package(tmp_path / "a.ssp", ssd, fmus))


@pytest.mark.parametrize(
    ("binding", "said"),
    [
        ("<ssd:ParameterBinding/>", "a binding needs one parameter set, but it gives none"),
        (inline(parameter_set(), more='source="a.ssv"'), "but it gives two: a source and inline"),
        ('<ssd:ParameterBinding source="a.ssv"/>', "there is no file 'a.ssv' inside"),
        ('<ssd:ParameterBinding source="a.ssv" sourceBase="component"/>', "there is no a.ssv inside"),
        (
            '<ssd:ParameterBinding source="a.csv" type="text/csv"/>',
            "a ParameterBinding is of type 'text/csv', read are sets",
        ),
        (inline(parameter_set(parameter("c", 1), parameter("c", 2))), "it gives the parameter 'c' twice"),
        (inline(parameter_set(parameter("c", "00", "Binary"))), "the parameter 'c' is Binary, which FMI 2.0 has not"),
        (inline(parameter_set(), "<a/>"), "its element is a, needed is ParameterMapping"),
    ],
)
def test_bindings(fmus, tmp_path, binding, said):
    ssd = structure(system("s", component("a", inside=bindings(binding))))
    assert said in refused(package(tmp_path / "a.ssp", ssd, fmus))


def test_a_set_in_a_component_that_a_system_has_not(fmus, tmp_path):
    binding = bindings('<ssd:ParameterBinding source="a.ssv" sourceBase="component"/>')
    ssd = structure(system("s", component("a"), bindings=binding))
    said = refused(package(tmp_path / "a.ssp", ssd, fmus))
    assert "the parameter set 'a.ssv' is to lie in a component, but a system has no file" in said


def test_an_output_of_a_system_that_is_given_a_value(fmus, tmp_path):
    given = bindings(inline(parameter_set(parameter("out", 1))))
    ssd = structure(system("s", component("a"), connection("a.y", "out"), connectors=OUT, bindings=given))
    said = refused(package(tmp_path / "a.ssp", ssd, fmus))
    assert "the parameter out sets a connector of kind output of a system, which is not implemented here" in said


def test_all_mistakes_are_told_together(fmus, tmp_path):
    ssd = top(connections=connection("a.z", "b.u") + connection("a.y", "c.u"))
    said = refused(package(tmp_path / "a.ssp", ssd, fmus))
    assert said.startswith(f"{tmp_path / 'a.ssp'} has 2 mistakes:\n  ") and said.count("\n") == 2


def test_an_fmu_that_is_none(tmp_path):
    buffer = io.BytesIO()
    zipfile.ZipFile(buffer, "w").close()
    path = package(tmp_path / "a.ssp", top(component("a")), {}, {"resources/Line.fmu": buffer.getvalue()})
    assert "a.ssp#resources/Line.fmu: it is not an FMU, for there is no modelDescription.xml inside" in refused(path)


def test_from_the_command_line(adcs, fmus, tmp_path):
    path = package(tmp_path / "a.ssp", top(connections=connection("a.y", "c.u")), fmus)
    for command in ("run", "show", "verify"):
        done = adcs(command, path)
        assert done.status == 2 and done.err.startswith("SspError: ") and "which is no element" in done.err
    with pytest.raises(SspError):
        load(path)
