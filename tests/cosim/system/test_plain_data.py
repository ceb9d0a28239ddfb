"""Time, names, units, values, descriptions: the parts that everything else stands on."""

import math
from fractions import Fraction

import numpy as np
import pytest

from cosim.errors import TimeError, UnknownName
from cosim.quantity import split_quantity
from cosim.system import Connection, Experiment, System, Value
from cosim.time import Schedule, exact_seconds, parse_seconds
from fmus.description.names import group, nearest, split_port
from fmus.description.units import BaseUnit, Conversion, Unit, conversion, resolve

from ..fakes import UNITS, Vehicle


class TestTime:
    @pytest.mark.parametrize(
        ("seconds", "exact"),
        [
            (0.001, Fraction(1, 1000)),
            (1, Fraction(1)),
            (1e-9, Fraction(1, 10**9)),
            (200.0, Fraction(200)),
            (1 / 8, Fraction(1, 8)),
            (1 / 3, Fraction(1, 3)),
            (1 / 30, Fraction(1, 30)),
            (1 / 1024, Fraction(1, 1024)),
            (Fraction(1, 44_100), Fraction(1, 44_100)),
            (Fraction(1, 10**9), Fraction(1, 10**9)),
        ],
    )
    def test_the_fraction_that_is_meant(self, seconds, exact):
        assert exact_seconds(seconds, "step") == exact

    @pytest.mark.parametrize("seconds", [0.5e-9, 1.5e-9, 0.1 + 1e-12, math.pi, math.nan, math.inf, True])
    def test_refused(self, seconds):
        with pytest.raises(
            TimeError, match=r"^step is .*Times are whole nanoseconds or fractions: 0.001, Fraction\(1, 30\)"
        ):
            exact_seconds(seconds, "step")

    def test_messages(self):
        with pytest.raises(
            TimeError, match=r"step is 1.5e-09 s: it is no whole number of nanoseconds, and no fraction"
        ):
            exact_seconds(1.5e-9, "step")
        with pytest.raises(TimeError, match="start is inf: it must be a finite number"):
            exact_seconds(math.inf, "start")
        with pytest.raises(TimeError, match="step is 1/1000000001 s: its denominator is above 1000000000"):
            exact_seconds(Fraction(1, 10**9 + 1), "step")
        with pytest.raises(TimeError, match=r"stop_time is 1.0 s: it must be later than start_time, 2.0 s"):
            Schedule.of(2.0, 1.0, 0.1, 1)
        with pytest.raises(TimeError, match=r"communication_step_size is -0.1 s: it must be positive"):
            Schedule.of(0.0, 1.0, -0.1, 1)

    def test_the_point_at_or_after_a_time(self):
        schedule = Schedule.of(1.0, 2.25, 0.5, 1, [1.2])
        points = [1.0, 1.2, 1.5, 2.0, 2.25]
        for t in np.linspace(0.9, 2.3, 141):
            after = [k for k, point in enumerate(points) if point >= round(t, 2)]
            assert schedule.reached(Fraction(round(100 * t), 100)) == (after[0] if after else len(points))

    @pytest.mark.parametrize("every", [0, -1, 1.5, True, 2**62 + 1, 10**30])
    def test_every_that_cannot_be_counted(self, every):
        message = f"every is .*: it must be a whole number of steps, 1 to {2**62}"
        with pytest.raises(TimeError, match=message):
            Schedule.of(0.0, 1.0, 0.1, every)

    @pytest.mark.parametrize(("stop", "step"), [(1e300, 0.1), (1e9, 1e-9), (1.0, Fraction(1, 999_999_937))])
    def test_counts_that_are_no_doubles_are_refused(self, stop, step):
        """2^53 is the last whole number from which a double is never the neighbour."""
        with pytest.raises(TimeError, match=r"it is beyond what can be counted in units of 1/\d+ s"):
            Schedule.of(0.0, stop if stop != 1.0 else Fraction(10**8 + 1, 999_999_929), step, 1)

    def test_a_step_that_doubles_do_not_tell_apart_is_refused(self):
        """From 2^23 s on two neighbouring doubles are 1.9 ns apart: two communication points would have one time."""
        with pytest.raises(TimeError, match=r"a double at 8500000.001 s tells apart no steps below 1.86e-09 s"):
            Schedule.of(8.5e6, 8.5e6 + 1e-3, 1e-9, 1)

    @pytest.mark.parametrize(
        ("text", "seconds"),
        [
            ("1ms", 0.001),
            ("0.5 s", 0.5),
            ("200", 200.0),
            ("2.5us", 2.5e-6),
            ("1e-3", 0.001),
            ("3 ns", 3e-9),
            ("2 min", 120.0),
            ("1/30", Fraction(1, 30)),
            ("1/8 s", 0.125),
            ("1/3 ms", Fraction(1, 3000)),
        ],
    )
    def test_text(self, text, seconds):
        assert parse_seconds(text, "step") == seconds

    @pytest.mark.parametrize("text", ["", "ms", "1 day", "1.2.3", "1 ms 2", "1/0", "1/2/3"])
    def test_text_refused(self, text):
        with pytest.raises(TimeError, match="step is"):
            parse_seconds(text, "step")

    def test_points(self):
        schedule = Schedule.of(0.0, 1.05, 0.1, 4)
        assert schedule.steps == 11
        assert [schedule.time(k) for k in (0, 1, 3, 10, 11)] == [0.0, 0.1, 0.3, 1.0, 1.05]
        assert [k for k in range(12) if schedule.recorded(k)] == [0, 4, 8, 11]

    @pytest.mark.parametrize("step", [0.001, 0.01, 0.1, Fraction(1, 30), Fraction(1, 7), Fraction(1, 44_100)])
    def test_points_are_rounded_once_and_a_step_ends_on_the_next(self, step):
        schedule = Schedule.of(0.0, 1000.0, step, 1)
        ks = [*range(2000), *range(schedule.steps - 2000, schedule.steps)]
        for k in ks:
            t, after = schedule.time(k), schedule.time(k + 1)
            exact = Fraction(schedule.step, schedule.denominator) * k
            assert t == exact.numerator / exact.denominator
            assert t + (after - t) == after


class TestNames:
    def test_arrays(self):
        groups = group(["J[1,1]", "J[1,2]", "J[2,1]", "J[2,2]", "x", "v[1]", "v[2]"])
        assert {base: g.shape for base, g in groups.items()} == {"J": (2, 2), "x": (), "v": (2,)}
        assert groups["J"].elements == ("J[1,1]", "J[1,2]", "J[2,1]", "J[2,2]")

    def test_out_of_order_is_sorted(self):
        assert group(["v[10]", *(f"v[{i}]" for i in range(1, 10))])["v"].elements[-1] == "v[10]"

    @pytest.mark.parametrize("names", [["v[1]", "v[3]"], ["v[0]", "v[1]"], ["v", "v[1]"], ["v[1]", "v[1,1]"]])
    def test_no_array(self, names):
        assert [g.elements for g in group(names).values()] == [(n,) for n in names]

    def test_ports(self):
        assert split_port("plant.J[1, 2]") == ("plant", "J[1,2]")
        assert split_port("plant.a.b[1]") == ("plant", "a.b[1]")

    def test_nearest(self):
        assert nearest("omega_BN", ["omega_BN_B", "q_BN", "tau"])[0] == "omega_BN_B"
        assert nearest("zzz", ["a"]) == []

    def test_unknown_name_lists_what_is_there(self):
        text = str(UnknownName("variable", "q_B", "here", ["q_BN", "tau"]))
        assert text == 'unknown variable "q_B" in here. Did you mean "q_BN"? There: q_BN, tau.'
        assert str(UnknownName("variable", "q", "here", [])) == 'unknown variable "q" in here. There: nothing.'


class TestUnits:
    def test_equal_names_and_no_units_pass(self):
        assert conversion("x", "x", {}, {}) == Conversion()
        assert conversion(None, "m", {}, {}) == Conversion()

    def test_convertible(self):
        assert conversion("mN.m", "N.m", UNITS, UNITS) == Conversion(1e-3)
        assert conversion("N.m", "mN.m", UNITS, UNITS)(2.0) == 2000.0

    def test_offset(self):
        kelvin = BaseUnit((0, 0, 0, 0, 1, 0, 0, 0))
        celsius = Unit("degC", BaseUnit(kelvin.exponents, Conversion(1.0, 273.15)))
        fahrenheit = Unit("degF", BaseUnit(kelvin.exponents, Conversion(5 / 9, 273.15 - 32 * 5 / 9)))
        found = conversion("degF", "degC", {"degF": fahrenheit}, {"degC": celsius})
        assert math.isclose(found(212.0), 100.0)

    def test_different_dimensions(self):
        assert conversion("m", "rad", UNITS, UNITS) is None
        assert conversion("kg^(1/2).m", "m", UNITS, UNITS) is None

    def test_the_spelling_of_older_fmus_and_files(self):
        for old, new in (("kg(1/2).m/s", "kg^(1/2).m/s"), ("rad/s/Hz(1/2)", "rad/s/Hz^(1/2)")):
            assert conversion(old, new, {old: Unit(old)}, {new: Unit(new)}) == Conversion()
            assert resolve(old, new, [{new: Unit(new)}]) == Conversion()
        shown = {"rad/s/Hz^(1/2)": Unit("rad/s/Hz^(1/2)", display={"deg/h^(1/2)": Conversion(3600.0)})}
        assert resolve("deg/h(1/2)", "rad/s/Hz^(1/2)", [shown]) == Conversion(1 / 3600.0)
        assert conversion("1/(kg.m2)", "1/(kg.m)", {}, {}) is None

    def test_unit_of_another_fmu(self):
        """mN.m is defined by another FMU; mdeg is a display unit of another FMU's unit mrad."""
        own = {"N.m": UNITS["N.m"]}
        assert resolve("mN.m", "N.m", [own, UNITS])(3.0) == 0.003
        other = {"mrad": Unit("mrad", BaseUnit((0,) * 7 + (1,), Conversion(1e-3)), {"mdeg": Conversion(180 / math.pi)})}
        assert math.isclose(resolve("mdeg", "rad", [UNITS, other])(1.0), math.radians(1e-3))

    def test_unknown(self):
        assert resolve("m", "rad", [UNITS]) is None
        assert resolve("m", None, [UNITS]) is None


class TestValues:
    @pytest.mark.parametrize(
        ("text", "value", "unit"),
        [
            ("0.005 deg", 0.005, "deg"), ("5", 5, None), ("-1e3", -1000.0, None), (".5N.m", 0.5, "N.m"),
            ("[[1, 2], [3, 4]] kg.m2", [[1, 2], [3, 4]], "kg.m2"), ("[1,2]", [1, 2], None), ("true", True, None),
            ("abc", "abc", None), ("[1, x]", "[1, x]", None), ("0.2 kg^(1/2).m", 0.2, "kg^(1/2).m"),
        ],
    )  # fmt: skip
    def test_text(self, text, value, unit):
        assert (Value(text).value, Value(text).unit) == (value, unit)
        assert type(Value(text).value) is type(value)

    def test_explicit_unit(self):
        assert Value(5, "deg") == Value("5 deg")
        assert Value("a label", "none").value == "a label"

    def test_arrays_become_lists(self):
        assert Value(np.eye(2)) == Value([[1.0, 0.0], [0.0, 1.0]])
        a = System(
            name="s", components={"p": "P"}, parameters={"p.J": np.eye(2)}, connections=[Connection("a.b", "c.d")]
        )
        b = System(
            name="s",
            components={"p": "P"},
            parameters={"p.J": [[1.0, 0.0], [0.0, 1.0]]},
            connections=(Connection("a.b", "c.d"),),
        )
        assert a == b


class TestInterface:
    def test_groups_and_lookup(self):
        description = Vehicle().description
        assert description.groups["J"].shape == (2, 2)
        assert description.find("J[1, 2]", "parameter", "plant").elements == ("J[1,2]",)
        assert description.base_names("output") == ["q_BN", "power", "eta", "omega"]

    def test_parameter_like(self):
        description = Vehicle().description
        like = {v.name for v in description.variables.values() if v.is_parameter}
        assert {"J[1,1]", "rho", "omega[1]"} <= like
        assert not {"angle", "power"} & like


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("1ms", ("1", "ms")),
        ("-3e4 N.m", ("-3e4", "N.m")),
        ("5 1/s", ("5", "1/s")),
        ("0 b", ("0", "b")),
        *(
            (text, None)
            for text in ("2,5", "2,5 deg", "0x10", "0b1", "1_000", "1 000", "1.2.3", "1'000", "deg", "1e-1234567890")
        ),
    ],
)
def test_number_and_unit(text, parts):
    assert split_quantity(text) == parts


def test_one_pattern_is_no_row_of_letters():
    assert Experiment(stop_time=1, communication_step_size=1, record="a.y").record == ("a.y",)
    assert Experiment(stop_time=1, communication_step_size=1, record=["a.y", "b"]).record == ("a.y", "b")
