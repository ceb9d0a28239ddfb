"""Archives and descriptions that someone broke or built to do harm: each is refused by our own error, with its name."""

import os
import stat
import zipfile

import pytest

from fmus.description import archive
from fmus.description.errors import FmuError
from fmus.description.names import group, split_element
from fmus.description.read import read_description

HEAD = '<fmiModelDescription fmiVersion="2.0" modelName="M" guid="1">'
XML = f"""{HEAD}<CoSimulation modelIdentifier="{{identifier}}"/>
<ModelVariables>{{variables}}</ModelVariables><ModelStructure/></fmiModelDescription>"""
REAL = '<ScalarVariable name="{name}" valueReference="{number}" causality="input"><Real start="0"/></ScalarVariable>'


def xml(*names, identifier="M") -> str:
    said = "".join(REAL.format(name=name, number=i) for i, name in enumerate(names))
    return XML.format(identifier=identifier, variables=said)


def packed(folder, text="", change=lambda entry: None, name="more.txt"):
    """Write an FMU with one more file, whose entry in the archive's directory is changed."""
    path = folder / "a.fmu"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as made:
        made.writestr("modelDescription.xml", text or xml("u"))
        made.writestr(zipfile.ZipInfo(name), b"more " * 100, zipfile.ZIP_DEFLATED)
        change(made.filelist[1])
    return path


def refused(path) -> str:
    with pytest.raises(FmuError) as caught:
        read_description(path)
    assert caught.value.path == path
    return caught.value.problem


def test_it_would_be_read(tmp_path):
    path = packed(tmp_path)
    assert list(read_description(path).variables) == ["u"]
    assert (archive.extract(path, tmp_path / "out") / "more.txt").read_bytes() == b"more " * 100


@pytest.mark.parametrize("name", ["/etc/more", "../more", "binaries/../../more", "a\\b", "C:more"])
def test_names_that_lead_out(tmp_path, name):
    path = packed(tmp_path, name=name)
    assert refused(path) == f"its file {name!r} has a name that leads out of the archive, or is none on every platform"
    with pytest.raises(FmuError, match="leads out of the archive"):
        archive.extract(path, tmp_path / "in" / "out")
    assert [p.name for p in tmp_path.rglob("*")] == ["a.fmu"]


def linked(entry):
    entry.create_system, entry.external_attr = 3, (stat.S_IFLNK | 0o777) << 16


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (linked, "is a symbolic link: an FMU has files"),
        (lambda entry: setattr(entry, "flag_bits", 1), "is encrypted"),
        (lambda entry: setattr(entry, "compress_type", 99), "compressed by a method that is not known here, number 99"),
    ],
    ids=["link", "encrypted", "method"],
)
def test_entries_of_other_kinds(tmp_path, change, words):
    problem = refused(packed(tmp_path, change=change))
    assert problem.startswith("its file 'more.txt' ") and words in problem


@pytest.mark.parametrize("size", [2**31, 2**40])
def test_more_than_fits(tmp_path, size):
    problem = refused(packed(tmp_path, change=lambda entry: setattr(entry, "file_size", size)))
    assert problem == f"it has {size + len(xml('u'))} bytes unpacked, at most {2**31} are taken"


def cut_short(entry):
    entry.compress_size = 3


@pytest.mark.parametrize("broken", [b"\xff" * 8, b"\x00" * 8])
def test_data_that_does_not_unpack(tmp_path, broken):
    path = packed(tmp_path)
    whole = path.read_bytes()
    for name, call in (
        ("modelDescription.xml", lambda: read_description(path)),
        ("more.txt", lambda: archive.extract(path, tmp_path / "out")),
    ):
        begin = whole.index(name.encode()) + len(name)
        path.write_bytes(whole[:begin] + broken + whole[begin + len(broken) :])
        with pytest.raises(FmuError, match=r"no readable zip archive: .|it cannot be extracted: ."):
            call()


def test_data_that_ends_early(tmp_path):
    path = packed(tmp_path, change=cut_short)
    with pytest.raises(FmuError, match=r"it cannot be extracted: ."):
        archive.extract(path, tmp_path / "out")


def test_what_is_no_file(tmp_path):
    (tmp_path / "folder.fmu").mkdir()
    assert refused(tmp_path / "folder.fmu") == "it is not an FMU, for it is a folder"
    assert refused(tmp_path / "a\0b").startswith("it cannot be read: ")
    assert refused(tmp_path / ("x" * 300)).startswith(("it cannot be read: ", "there is no such file"))


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names here")
def test_a_pipe_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe.fmu")
    assert refused(tmp_path / "pipe.fmu") == "it is not an FMU, for it is no regular file"


@pytest.mark.parametrize("identifier", ["../../M", "/tmp/M", "C:M", "a\\M", "", "..", "."])
def test_a_model_identifier_that_is_none(tmp_path, identifier):
    problem = refused(packed(tmp_path, xml("u", identifier=identifier)))
    said = f"the modelIdentifier {identifier!r} cannot be the name of a library"
    assert problem == f"its modelDescription.xml is damaged: {said}"


@pytest.mark.parametrize("identifier", ["water-tank", "2M", "M.so", "M N", "é"])
def test_a_model_identifier_that_is_no_identifier_of_c(tmp_path, identifier):
    """FMI wants one; some tools write what their model is called."""
    assert read_description(packed(tmp_path, xml("u", identifier=identifier))).model_identifier == identifier


@pytest.mark.parametrize("place", ["text", "attribute", "nowhere"])
def test_an_external_entity(tmp_path, place):
    secret = tmp_path / "secret"
    secret.write_text("the secret")
    text = xml("u").replace("<fmiM", f'<!DOCTYPE x [<!ENTITY x SYSTEM "{secret.as_uri()}">]><fmiM', 1)
    if place != "nowhere":
        new = {"text": "&x;<ModelVariables>", "attribute": '<ModelVariables id="&x;">'}[place]
        text = text.replace("<ModelVariables>", new)
    problem = refused(packed(tmp_path, text))
    assert "the secret" not in problem
    assert (
        "it declares a document type (DOCTYPE): FMI has none" in problem
        or "Entity 'x'" in problem
        or "entity" in problem
    )


def test_entities_that_multiply(tmp_path):
    laughs = '<!ENTITY a0 "ha">' + "".join(f'<!ENTITY a{n} "{f"&a{n - 1};" * 10}">' for n in range(1, 12))
    text = xml("u").replace("<fmiM", f"<!DOCTYPE x [{laughs}]><fmiM", 1).replace('modelName="', 'modelName="&a11;')
    assert "its modelDescription.xml is damaged" in refused(packed(tmp_path, text))


@pytest.mark.parametrize(("a", "b"), [("x[1,2]", "x[1, 2]"), ("x[1]", "x[ 1 ]"), ("x[1]", "x[01]")])
def test_two_names_that_are_one(tmp_path, a, b):
    assert f"two variables have one name, {a!r} and {b!r}" in refused(packed(tmp_path, xml(a, b)))


@pytest.mark.parametrize(
    "name", ["x[9999999999]", "x[99999,99999]", "x[" + "9" * 5000 + "]", "x[1" + ",1" * 5000 + "]"]
)
def test_an_index_without_end_costs_nothing(tmp_path, name):
    description = read_description(packed(tmp_path, xml("x[1]", name)))
    assert list(description.groups)[1] == name


def test_names_that_could_be_of_two_arrays():
    assert list(group(["a[1]", "a[3]", "a[1][1]"])) == ["a[1]", "a[3]", "a[1][1]"]
    assert {b: g.elements for b, g in group(["a[1]", "a[1][1]"]).items()} == {"a": ("a[1]",), "a[1][1]": ("a[1][1]",)}
    assert group(["s"])["s"].elements == ("s",)
    assert split_element("x[1]\n") == ("x[1]\n", ())
