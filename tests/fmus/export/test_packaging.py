"""What an FMU carries beside what it computes: its names, who made it and when, documentation, a picture."""

import io
import re
import xml.etree.ElementTree as ElementTree
import zipfile

import pytest
from fmpy import simulate_fmu
from fmpy.validation import validate_fmu
from PIL import Image

from components.catalog import CATALOG
from fmus.description.description import DefaultExperiment
from fmus.description.read import read_description
from fmus.errors import BuildError
from fmus.export.build import build, build_reference
from fmus.export.documentation.icon import MOST, icon
from fmus.export.origin import origin_of

from .parts import every

PARTS = every()
BACKENDS = pytest.mark.parametrize("backend", ["native", "python"])


def contents(fmu) -> dict[str, bytes]:
    """The files of an FMU, modelDescription.xml without its date."""
    with zipfile.ZipFile(fmu) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    xml, changes = re.subn(rb'generationDateAndTime="[^"]*"', b"", files["modelDescription.xml"])
    assert changes == 1
    return files | {"modelDescription.xml": xml}


@BACKENDS
def test_a_name_that_is_no_identifier_of_c(tmp_path, backend):
    fmu = build(CATALOG["Sum"](), tmp_path / "2nd my-system_a.fmu", backend)
    said = read_description(fmu)
    assert (said.model_name, said.model_identifier) == ("2nd my-system_a", "_2nd_my_system_a")
    assert validate_fmu(str(fmu)) == []
    assert simulate_fmu(str(fmu), stop_time=0.01, output=["tau_dist_B[1]"])["tau_dist_B[1]"][-1] == 0


@BACKENDS
def test_who_made_it_when_and_for_which_experiment(tmp_path, monkeypatch, backend):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    proposed = DefaultExperiment(start=1.0, stop=2.5, tolerance=1e-7, step_size=0.25)
    fmu = build(CATALOG["HarmonicTorque"](), tmp_path / "a_b.fmu", backend, experiment=proposed)
    said = read_description(fmu)
    assert said.generation_date == "1970-01-02T00:00:00Z"
    assert (said.license, said.generation_tool) == ("MIT", "adcs-cosim")
    assert said.copyright.startswith("Copyright (c) 20") and re.match(r"\d+\.\d+", said.version)
    assert said.default_experiment == proposed
    assert validate_fmu(str(fmu)) == []


@BACKENDS
def test_two_builds_differ_by_their_date_alone(tmp_path, monkeypatch, backend):
    made = []
    for seconds in ("1000000000", "1700000000"):
        monkeypatch.setenv("SOURCE_DATE_EPOCH", seconds)
        made.append(build(CATALOG["Sum"](), tmp_path / seconds / "Sum.fmu", backend))
    first, second = map(read_description, made)
    assert (first.generation_date, second.generation_date) == ("2001-09-09T01:46:40Z", "2023-11-14T22:13:20Z")
    assert first.guid == second.guid
    assert contents(made[0]) == contents(made[1])


def test_the_date_makes_nothing_that_is_kept_out_of_date(tmp_path, monkeypatch):
    monkeypatch.setenv("ADCS_BUILD", str(tmp_path))
    told: list[str] = []
    for seconds in ("1000000000", "1700000000"):
        monkeypatch.setenv("SOURCE_DATE_EPOCH", seconds)
        fmu = build_reference("Sum", "python", announce=told.append)
    assert told == ["building Sum (python)"]
    assert read_description(fmu).generation_date == "2001-09-09T01:46:40Z"


def test_without_a_fixed_date_it_is_now(tmp_path, monkeypatch):
    monkeypatch.delenv("SOURCE_DATE_EPOCH")
    monkeypatch.setattr("fmus.export.origin.time.time", lambda: 1.6e9 + 0.9)
    fmu = build(CATALOG["Sum"](), tmp_path / "Sum.fmu", "python")
    assert read_description(fmu).generation_date == "2020-09-13T12:26:40Z"


@pytest.mark.parametrize("epoch", ["yesterday", "", "1e9", "9" * 30])
def test_a_date_that_is_none(tmp_path, monkeypatch, epoch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", epoch)
    with pytest.raises(BuildError, match=f"SOURCE_DATE_EPOCH is '{epoch}', which is no number of seconds since 1970"):
        build(CATALOG["Sum"](), tmp_path / "Sum.fmu", "python")


def test_origin_of_a_users_module(tmp_path, monkeypatch):
    (tmp_path / "law.py").write_text(
        "from components.framework import Component, Output\n"
        "__author__, __version__, __license__ = 'A. Person, Org', '2.1', 'proprietary'\n"
        "class Law(Component):\n"
        "    '''A constant.'''\n"
        "    y = Output(unit='1', doc='it')\n"
        "    def outputs(self, t, x, u, p):\n"
        "        return {'y': 1.0}\n"
    )
    fmu = build_reference(f"{tmp_path / 'law.py'}:Law", folder=tmp_path)
    said = read_description(fmu)
    assert (said.author, said.version, said.license, said.copyright) == ("A. Person, Org", "2.1", "proprietary", "")
    assert validate_fmu(str(fmu)) == []


def test_origin_is_what_the_distribution_says():
    assert origin_of(CATALOG["Sum"]())["license"] == "MIT"
    assert "license" not in origin_of(PARTS["Gain"])  # a class of this test, which says nothing


@BACKENDS
def test_documentation_and_picture(tmp_path, backend):
    component = CATALOG["FlexibleSpacecraft"](modes=2, zeta=0.0625)
    fmu = build(component, tmp_path / "mine_plant.fmu", backend)
    files = contents(fmu)
    html = files["documentation/index.html"].decode()
    assert "<title>FlexibleSpacecraft</title>" in html
    assert "mine_plant: FMI 2.0 for co-simulation, by adcs-cosim" in html
    assert '<code id="zeta">zeta[2]</code></td><td class="unit">1</td><td>0.0625</td>' in html
    body = html[html.index("<body>") :].replace("&emsp;", " ").replace("<hr>", "")
    ElementTree.fromstring(body.removesuffix("</html>\n"))  # well-formed
    picture = Image.open(io.BytesIO(files["model.png"]))
    assert picture.format == "PNG" and picture.width == 480


def test_a_picture_shows_each_port_in_a_row_and_counts_what_it_has_no_room_for():
    def height(ports):
        return Image.open(io.BytesIO(icon("Block", ports, []))).height

    many = [f"u_{i}" for i in range(MOST + 5)]
    assert height(many[:4]) - height(many[:3]) == height(many[:3]) - height(many[:2]) > 0
    assert height(many) == height(many[:MOST])
    assert icon("Block", many, []) == icon("Block", many, [])
    assert icon("Block", many, []) != icon("Block", many[:-1], [])  # 6 more, 5 more
    assert icon("Block", ["a"], ["b"]) != icon("Block", ["b"], ["a"])


def test_a_long_name_stays_within_the_block():
    name = "an_input_with_a_name_that_is_far_too_long_for_half_a_block[3]"
    picture = Image.open(io.BytesIO(icon("Block", [name], []))).convert("L")
    row = [picture.getpixel((x, y)) for x in range(picture.width // 2, 440) for y in range(58, 82)]
    assert min(row) > 250  # the right half is white
