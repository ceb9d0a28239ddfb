"""Texts to --set, --params, --stop, --step, --every and --settled: each is taken, or refused by an error of ours.

python tests/benchmarks/fuzz_values.py [COUNT [FIRST SEED]]
"""

import random
from pathlib import Path

from cosim.cli import overrides
from cosim.errors import SimulationError
from cosim.system import Experiment, System
from cosim.system.expand import wire
from cosim.system.overrides import with_parameters
from cosim.time import Schedule
from fmus.description.description import ModelDescription, ScalarVariable
from fmus.description.units import BaseUnit, Conversion, Unit

RAD = Unit("rad", BaseUnit((0, 0, 0, 0, 0, 0, 0, 1), Conversion(1.0, 0.0)), {"deg": Conversion(57.29577951308232, 0.0)})
PARTS = [
    *"0123456789" * 3,
    *".,-+eE_/xX'\"[](){}=#;: \t\n\\*%\0",
    *(
        "nan",
        "inf",
        "true",
        "False",
        "None",
        "deg",
        "rad",
        "N.m",
        "ms",
        " s",
        "1/30",
        "off",
        "on",
        "1e",
        "[[",
        "]]",
        ", ",
    ),
    *("é", "漢", "\u0661", "\U0001f6f0", "\ud800", "\u2212", "e999", "e-99999999", "9" * 400, "9" * 5000, "[" * 900),
    *("1979-05-27", "0xff", "'''", '"""', "[b]", "{c=1}", "lambda", "__import__"),
]
NAMES = ["x", "v", "v[1]", "v[ 2 ]", "J", "J[1,1]", "n", "on", "mode", "label", "u", "y", "v[0]", "v[99999999999]", ""]


def description() -> ModelDescription:
    """An FMU with a parameter of every type and shape."""

    def parameter(name, number, kind="Real", start=1.0, **more):
        return ScalarVariable(name, number, kind, "parameter", "fixed", "exact", start=start, **more)

    variables = [
        parameter("x", 0, unit="rad"),
        *(parameter(f"v[{i}]", i, unit="rad") for i in (1, 2, 3)),
        *(parameter(f"J[{i},{j}]", 2 * i + j + 3) for i in (1, 2) for j in (1, 2)),
        parameter("n", 0, "Integer", 1),
        parameter("on", 0, "Boolean", True),
        parameter("mode", 1, "Enumeration", 1, items={"off": 1, "on": 2}),
        parameter("label", 0, "String", "word"),
        ScalarVariable("u", 20, causality="input", variability="continuous", start=0.0),
        ScalarVariable("y", 21, causality="output", variability="continuous", initial="calculated"),
    ]
    return ModelDescription("M", "{1}", {v.name: v for v in variables}, units={"rad": RAD}, model_identifier="M")


SYSTEM = System(name="s", components={"a": "M"}, held={"a.u": 0.0})
DESCRIPTIONS = {"a": description()}
EXPERIMENT = Experiment(stop_time=1.0, communication_step_size=0.1)


def written(chance: random.Random, depth: int = 0) -> str:
    """Return a number, a list, a word or a quantity that is nearly right."""
    if depth < 3 and chance.random() < 0.3:
        return "[" + ", ".join(written(chance, depth + 1) for _ in range(chance.choice([0, 1, 2, 2, 3, 3]))) + "]"
    number = f"{chance.uniform(-9, 9):.{chance.randint(0, 9)}{chance.choice('efg')}}"
    return chance.choice([number, str(chance.randint(-3, 3)), "true", "off", number]) + chance.choice(
        ["", "", "", " deg", " rad", " ms", "s", " N.m", "e5", ","]
    )


def check(values) -> None:
    wire(with_parameters(SYSTEM, values), DESCRIPTIONS)


def attempt(seed: int, folder: Path) -> str:
    """Return how one text ended, the name of the error or "taken"; anything else is raised."""
    chance = random.Random(seed)
    text = written(chance) if chance.random() < 0.5 else "".join(chance.choices(PARTS, k=chance.randint(0, 8)))
    name = f"{chance.choice(['a', 'a', '*', 'b', ''])}.{chance.choice(NAMES)}"
    try:
        match seed % 5:
            case 0:
                check(overrides.assignments([f"{name}={text}"]))
            case 1:
                file = folder / "p.toml"
                quoted = chance.choice([text, f'"{text}"', f"[{text}]", f"'{text}'"])
                file.write_bytes(f"[a]\n{name.partition('.')[2]} = {quoted}\n".encode("utf-8", "surrogatepass"))
                check(overrides.parameter_file(file))
            case 2 | 3:
                option = {chance.choice(["stop", "step"]): text}
                e = overrides.with_experiment(EXPERIMENT, **option)
                Schedule.of(e.start_time, e.stop_time, e.communication_step_size, e.every)
            case _ if chance.random() < 0.5:
                overrides.parse_degrees(text, "--settled")
            case _:
                every = int(chance.choice(["", "-"]) + "9" * chance.randint(1, 300)) // chance.randint(1, 10**6)
                Schedule.of(0.0, 1.0, 0.1, every)
    except SimulationError as error:
        str(error)
        return type(error).__name__
    return "taken"


if __name__ == "__main__":
    from fuzz import run

    run(attempt, 5000)
