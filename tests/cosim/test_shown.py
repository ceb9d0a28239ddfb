"""What a notebook shows of a system, a result and an FMU: short, with units, escaped, no dump of numbers."""

from html.parser import HTMLParser

import pytest

from components.environment.sum import Sum
from cosim import Connection, Experiment, System, Value, load, simulate
from fmus.description.read import read_description
from fmus.export.build import build_reference


class Reader(HTMLParser):
    """Reads rows of cells, and refuses tags that are not closed."""

    def __init__(self):
        super().__init__()
        self.open, self.rows, self.text = [], [], ""

    def handle_starttag(self, tag, attrs):
        self.open += [tag] if tag != "br" else []
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data
        if self.open[-1] in ("td", "th"):
            self.rows[-1][-1] += data


def read(thing):
    html = thing._repr_html_()
    reader = Reader()
    reader.feed(html)
    assert reader.open == []
    return reader


@pytest.fixture(scope="module")
def result():
    system, experiment = load("zhang2018-ppatc")
    return simulate(system, Experiment(stop_time=0.05, communication_step_size=0.01, master=experiment.master))


def test_a_system():
    system, _ = load("zhang2018-ppatc")
    text = repr(system)
    assert text.startswith("<System zhang2018-ppatc: guidance EulerSinusoid, environment HarmonicTorque, controller ")
    assert "connections" in text and len(text) < 300
    shown = read(system)
    assert ["plant", "FlexibleSpacecraft", "1"] in shown.rows
    assert ["plant.q_BN", "controller.q_BN", "smooth"] in shown.rows
    assert ["vehicle", "J", "3 x 3 kg.m2"] in shown.rows


def test_values_have_their_units_and_texts_are_escaped():
    system = System(
        name="<script>alert(1)</script>",
        components={"a": Sum, "b": "<b>"},
        connections=[Connection("a.y", "b.u")],
        parameters={"a.k": Value(0.005, "deg"), "a.m": [[1.0, 2.0]] * 50, "a.name": "<i>", "a.n": 3},
        steps={"a": 10},
    )
    html = system._repr_html_()
    assert "<script>" not in html and "<b></td>" not in html and "<i>" not in html
    shown = read(system)
    assert ["parameter", "a.k", "0.005 deg"] in shown.rows
    assert ["parameter", "a.m", "50 x 2"] in shown.rows
    assert ["parameter", "a.name", "<i>"] in shown.rows and ["parameter", "a.n", "3"] in shown.rows
    assert ["a", "components.environment.sum.Sum", "10"] in shown.rows and ["b", "<b>", "1"] in shown.rows
    assert ["a.y", "b.u", "default"] in shown.rows
    assert "1 connection, 4 parameters, 0 vehicle parameters, 0 held inputs" in repr(system)


def test_a_result(result):
    assert (
        repr(result) == f"<Result of zhang2018-ppatc: finished, 6 rows of {len(result.names)} variables, 0 to 0.05 s>"
    )
    shown = read(result)
    assert ["plant.omega_BN_B", "Real", "3", "rad/s"] in shown.rows
    assert "metrics" not in result.info  # to look at a result costs nothing
    assert result.metrics
    shown = read(result)
    assert ["metric", "value"] in shown.rows
    cells = [cell for row in shown.rows for cell in row]
    assert max(map(len, cells)) < 100 and len(cells) < 500


def test_a_result_that_ended_early_says_why(result):
    failed = type(result)(result.table.slice(0, 0), result.info | {"status": "failed", "why": "<x> is not finite"})
    assert repr(failed).startswith("<Result of zhang2018-ppatc: failed, 0 rows of ")
    assert "<x> is not finite" in read(failed).text


def test_an_fmu():
    fmu = read_description(build_reference("FlexibleSpacecraft"))
    text = repr(fmu)
    assert text.startswith(f"<FMU FlexibleSpacecraft {fmu.guid}: 3 inputs, ") and len(text) < 150
    shown = read(fmu)
    rows = {row[0]: row[1:4] for row in shown.rows}
    assert rows["omega_BN_B[3]"] == ["output", "continuous", "rad/s"]
    assert rows["J[3,3]"] == ["parameter", "fixed", "kg.m2"]
    assert not any(name.startswith("der(") for name in rows)
    assert fmu.generation_tool in shown.text and fmu.description in shown.text
