"""What an FMU logs reaches the user: in run.json and on the terminal, and does nothing to that."""

from cosim import flights
from cosim.cli import console

from .. import both, c_fmu
from ..c_fmu import real

LOG = """
    if (t < 0.25) say(m, "the tank is \\033[31mhalf\\033[0m empty");
    if (t > 0.45) say(m, "the tank is empty");
"""
SAY = r"""
static void say(Memory *m, const char *text)
{
    const Instance *c = (const Instance *)m;
    c->f->logger(c->f->componentEnvironment, "a", fmi2Warning, "logStatusWarning", "%s", text);
}
static void start(Memory *m);
"""


def test_messages_are_counted_told_and_harmless(tmp_path, capsys):
    template = c_fmu.C.replace("static void start(Memory *m);", SAY, 1)
    path = c_fmu.build(tmp_path, "Tank", [real("y")], outputs="y = 1;", step=LOG, template=template)
    for loop in both.LOOPS:
        result = flights.simulate(both.of({"a": path}, []), both.experiment(loop=loop))
        assert result.info["messages"] == {
            "a": {"the tank is ?[31mhalf?[0m empty": 3, "the tank is empty": 5},
        }
        assert result.info["status"] == "finished"
    console.write_summary(result)
    assert "a says: the tank is ?[31mhalf?[0m empty (3 times); 1 more in run.json" in capsys.readouterr().out


def test_a_run_that_records_nothing_says_so(tmp_path, capsys):
    path = c_fmu.build(tmp_path, "Mute", [real("k", "parameter", start=1.0)])
    result = flights.simulate(both.of({"a": path}, []), both.experiment())
    console.write_summary(result)
    assert "only the time was recorded: no FMU has an input or output" in capsys.readouterr().out
    named = flights.simulate(both.of({"a": path}, []), both.experiment(record=["a.k"]))
    assert named.names == ["a.k"]
