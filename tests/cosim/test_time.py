"""Time is a count of a rational step: exact for 1/30 s as for 1 ms, the same in both loops, the FMUs' too."""

import math
import re
from fractions import Fraction

import numpy as np
import pytest

from cosim.errors import TimeError
from cosim.results.result import Result
from cosim.time import LARGEST_INTEGER, Schedule, exact_seconds, in_words, parse_seconds, written

from . import both
from .c_fmu import build, integer, real

THIRTIETH = Fraction(1, 30)


@pytest.fixture(scope="module")
def witness(tmp_path_factory):
    """Tells the t and h of its steps, and where t + h was not the next t."""
    outputs = "t_in = m->state[0]; h_in = m->state[1]; gaps = (int)m->whole[0];"
    step = "if (m->whole[1]++ && m->state[0] + m->state[1] != t) m->whole[0]++; m->state[0] = t; m->state[1] = h;"
    variables = [real("t_in"), real("h_in"), integer("gaps")]
    return build(tmp_path_factory.mktemp("witness"), "Witness", variables, outputs=outputs, step=step)


@pytest.fixture(scope="module")
def fixed_step(tmp_path_factory):
    """Three ways in which an FMU with a fixed step dt inside counts its own steps; in lockstep they agree."""
    variables = [real("dt", "parameter", start=0.001), integer("rounded"), integer("up_to"), real("summed")]
    outputs = "rounded = (int)m->whole[0]; up_to = (int)m->whole[1]; summed = m->state[0];"
    step = r"""
        m->whole[0] += llround(h / dt);
        while ((double)(m->whole[1] + 1) * dt <= t + h + 1e-9 * dt) m->whole[1]++;
        m->state[0] += h;
    """
    return build(tmp_path_factory.mktemp("fixed"), "FixedStep", variables, outputs=outputs, step=step)


STEPS = [(THIRTIETH, Fraction(10)), (0.001, 2.0), (1 / 30, 10.0), (Fraction(1, 7), Fraction(100, 7)), (0.01, 3.0)]


@pytest.mark.parametrize(("step", "stop"), STEPS, ids=str)
def test_points_are_rounded_once(witness, step, stop):
    exact = exact_seconds(step, "step")
    result = both.fly(both.of({"w": witness}, []), stop=stop, step=step)
    count = exact_seconds(stop, "stop") / exact
    assert result.time.tolist() == [float(k * exact) for k in range(int(count) + 1)]


@pytest.mark.parametrize("every", [1, 4])
@pytest.mark.parametrize(("step", "stop"), STEPS, ids=str)
def test_h_is_the_difference_and_t_plus_h_is_the_next_t(witness, step, stop, every):
    for steps in ({}, {"w": 3}):
        result = both.fly(both.of({"w": witness, "other": witness}, [], steps=steps), stop=stop, step=step, every=every)
        assert result["w.gaps"][-1] == result["other.gaps"][-1] == 0
    if every == 1:
        assert (result["other.t_in"] + result["other.h_in"] == result.time)[1:].all()
        assert result["other.h_in"][1:].tolist() == np.diff(result.time).tolist()


def test_nine_hundredths_and_one_are_a_tenth(witness):
    """0.09 + 0.01 is 0.09999999999999999: with h = 0.01 the FMU would end short of the point 0.1 s."""
    assert 0.09 + 0.01 != 0.1
    result = both.fly(both.of({"w": witness}, []), stop=0.1, step=0.01)
    assert result.time[-1] == 0.1
    assert result["w.t_in"][-1] == 0.09 and result["w.h_in"][-1] == 0.1 - 0.09 != 0.01
    assert result["w.t_in"][-1] + result["w.h_in"][-1] == 0.1


@pytest.mark.parametrize(
    ("step", "stop", "dt", "inside"),
    [
        (0.001, 100.0, 0.001, 1),
        (0.01, 100.0, 0.001, 10),
        (THIRTIETH, Fraction(100), 1 / 300, 10),
        (0.1, 1000.0, 0.05, 2),
    ],
)
def test_an_fmu_that_counts_steps_of_its_own_loses_none(fixed_step, step, stop, dt, inside):
    system = both.of({"f": fixed_step}, [], parameters={"f.dt": dt})
    result = both.fly(system, stop=stop, step=step, every=50)
    steps = np.round(result.time / float(step)).astype(int)
    assert result["f.rounded"].tolist() == (inside * steps).tolist()
    assert result["f.up_to"].tolist() == (inside * steps).tolist()
    np.testing.assert_allclose(result["f.summed"], result.time, rtol=1e-12)


def test_a_clock_that_adds_h_to_h_stays_within_a_rounding_a_step(witness, fixed_step):
    """The sum of the differences is as good as any sum of doubles: t_n itself but for n roundings."""
    result = both.fly(both.of({"f": fixed_step}, []), stop=Fraction(1000), step=THIRTIETH, every=100)
    steps = np.arange(len(result)) * 100
    assert (np.abs(result["f.summed"] - result.time) <= (steps + 1) * np.spacing(result.time)).all()


def test_at_the_start_time_and_the_last_short_step(witness):
    setup = both.experiment(stop=Fraction(41, 30) + Fraction(1, 100), step=THIRTIETH, start_time=Fraction(1, 3))
    result = both.fly(both.of({"w": witness}, []), setup)
    assert result.time[0] == 1 / 3
    assert result.time[1] == float(Fraction(11, 30))
    assert result.time[-2:].tolist() == [float(Fraction(41, 30)), float(Fraction(413, 300))]
    assert result["w.gaps"][-1] == 0 and result["w.t_in"][-1] + result["w.h_in"][-1] == result.time[-1]
    assert result.info["communication_step"] == "1/30 s"
    assert result.info["last_step"] == pytest.approx(0.01)


FILE = """
from fractions import Fraction

from cosim.system import Experiment, System


def system():
    return System(name="alone", components={{"w": {path!r}}}), Experiment(stop_time=1.0, communication_step_size=0.1)


def thirtieths():
    return system()[0], Experiment(stop_time=Fraction(7, 3), communication_step_size=1 / 30)
"""


class TestCommandLine:
    @pytest.fixture
    def run(self, witness, adcs, folder):
        (folder / "alone.py").write_text(FILE.format(path=str(witness)))
        return lambda *arguments: adcs("run", "alone.py", "--out", "out", *arguments)

    @pytest.mark.parametrize("step", ["1/30", "1/30 s", "1/30s", "100/3 ms", "100/3ms"])
    def test_a_fraction_as_a_step(self, run, step):
        done = run("--step", step, "--stop", "7/3")
        assert done.status == 0, done.err
        result = Result.read("out")
        assert result.time.tolist() == [k / 30 for k in range(71)]
        assert result.info["communication_step"] == "1/30 s"
        assert result["w.gaps"][-1] == 0

    def test_fractions_are_shown(self, run, adcs):
        done = adcs("show", "alone.py:thirtieths")
        assert done.out.startswith("alone: 7/3 s in steps of 1/30 s, master Explicit()"), done.err

    @pytest.mark.parametrize("step", ["1/0", "1/3/3", "1//30", "0/30", "-1/30", "1/30 parsec", "1/30000000000"])
    def test_what_is_no_step(self, run, step):
        done = run("--step", step)
        assert (done.status, "TimeError: " in done.err) == (2, True)

    def test_a_step_that_was_computed(self, run):
        done = run("--step", "33.333333333333336 ms", "--stop", "0.30000000000000004")
        assert done.status == 0, done.err
        assert Result.read("out").time.tolist() == [k / 30 for k in range(10)]

    def test_a_step_that_means_nothing_gets_the_nearest_that_would_do(self, run):
        done = run("--step", "0.0333333333333")
        assert (done.status, "The nearest that would do is 1/30 s" in done.err) == (2, True)

    @pytest.mark.parametrize("every", ["0", "-1", "99999999999999999999"])
    def test_every_is_a_whole_number_that_can_be_counted(self, run, every):
        done = run("--every", every)
        assert done.status == 2
        assert f"every is {every}: it must be a whole number of steps, 1 to {LARGEST_INTEGER}" in done.err


class TestExactSeconds:
    @pytest.mark.parametrize(
        ("given", "meant"),
        [
            (0.1, Fraction(1, 10)),
            (1 / 3, Fraction(1, 3)),
            (1 / 30, THIRTIETH),
            (2.5e-7, Fraction(1, 4_000_000)),
            (1e-9, Fraction(1, 10**9)),
            (123456789.123456789, Fraction("123456789.12345679")),
            (7 / 99_991, Fraction(7, 99_991)),
            (0.1 + 0.2, Fraction(3, 10)),
            (1.1 * 3, Fraction(33, 10)),
            (sum([0.1] * 6), Fraction(6, 10)),
            (THIRTIETH, THIRTIETH),
            (3, Fraction(3)),
            (-0.1 - 0.2, Fraction(-3, 10)),
            (np.float64(0.1), Fraction(1, 10)),
            (np.float64(1 / 30), THIRTIETH),
            (7 * (1 / 30), Fraction(7, 30)),
            (1 / 3 - 1 / 4, Fraction(1, 12)),
            (1e8 / 3, Fraction(10**8, 3)),
            (np.float32(0.1), Fraction(1, 10)),
            (np.float32(0.001) * 7, Fraction(7, 1000)),
            (np.float32(1 / 30), THIRTIETH),
            (np.float32(100) / 3, Fraction(100, 3)),
            (np.float32(0.12345), Fraction("0.12345")),
            (np.float32(12345.678), Fraction("12345.678")),
            (np.float16(0.1), Fraction(1, 10)),
            (np.longdouble(0.1), Fraction(1, 10)),
            (0.0, Fraction(0)),
        ],
        ids=str,
    )
    def test_what_is_meant(self, given, meant):
        assert exact_seconds(given, "t") == meant

    @pytest.mark.parametrize(
        "given", [math.pi, 1e-10, math.inf, math.nan, True, Fraction(1, 10**9 + 1), 2**-40, "50 s", [1], None]
    )
    def test_what_means_nothing(self, given):
        with pytest.raises(TimeError, match=r"^t is .*\. Times are whole nanoseconds or fractions: 0\.001, Fraction"):
            exact_seconds(given, "t")

    @pytest.mark.parametrize(
        ("given", "nearest"),
        [
            (math.pi, "3.141592654 s"),
            (0.0333333333333, "1/30 s"),
            (sum([0.1] * 1000), "100 s"),
            (1e-10, "0.000000001 s"),
            (-1e-10, "-0.000000001 s"),
            (Fraction(1, 10**9 + 1), "0.000000001 s"),
        ],
        ids=str,
    )
    def test_what_would_do_instead_is_offered(self, given, nearest):
        with pytest.raises(TimeError, match=f"The nearest that would do is {re.escape(nearest)}\\. Times are"):
            exact_seconds(given, "t")
        assert written(exact_seconds(parse_seconds(nearest, "t"), "t")) == nearest

    def test_what_is_not_finite_has_no_nearest(self):
        with pytest.raises(TimeError) as raised:
            exact_seconds(math.nan, "t")
        assert "nearest" not in str(raised.value)

    @pytest.mark.parametrize("precision", [np.float32, np.float64])
    def test_decimals_are_not_taken_for_a_fraction_by_chance(self, precision):
        """Of 2000 numbers with seven digits at random, each is the one that is written."""
        numbers = np.random.default_rng(1).integers(10**6, 10**7, 2000)
        for number in numbers:
            given = precision(f"{number}e-6")
            meant = exact_seconds(given, "t")
            assert precision(float(meant)) == given
            assert meant == Fraction(int(number), 10**6) or precision is np.float32  # 24 bits have not all of them

    def test_texts(self):
        assert parse_seconds("1/30", "t") == THIRTIETH
        assert parse_seconds("1/4", "t") == 0.25 and isinstance(parse_seconds("1/4", "t"), float)
        assert parse_seconds("2 min", "t") == 120.0
        assert parse_seconds("1/30 min", "t") == 2.0

    @pytest.mark.parametrize(
        ("text", "meant"),
        [
            ("0.30000000000000004", Fraction(3, 10)),
            ("16.666666666666668 ms", Fraction(1, 60)),
            ("0.033333333333333333333", THIRTIETH),
            ("33.333333 ms", Fraction(33_333_333, 10**9)),
        ],
    )
    def test_texts_of_computed_numbers(self, text, meant):
        assert exact_seconds(parse_seconds(text, "t"), "t") == meant


class TestSchedule:
    @pytest.mark.parametrize("every", [2**62 + 1, 10**20, 0, -3, 1.5, True])
    def test_every(self, every):
        with pytest.raises(TimeError, match=r"^every is "):
            Schedule.of(0, 1, 0.1, every)

    @pytest.mark.parametrize("every", [1, 2, 3, 7, 100])
    @pytest.mark.parametrize("events", [(), (0.25,), (0.0, 0.3, 0.35, 0.36, 0.99)])
    def test_the_next_recorded_point_is_the_first_that_is_recorded(self, every, events):
        schedule = Schedule.of(0, 1.05, 0.1, every, events)
        for k in range(schedule.steps):
            found = next(n for n in range(k + 1, schedule.steps + 1) if schedule.recorded(n))
            assert schedule.next_recorded(k) == found

    @pytest.mark.parametrize("times", [(0, 2.0**60, 1e-9), (-(2.0**60), 1, 1e-9), (0, 1e16, 0.1)])
    def test_counts_stay_doubles(self, times):
        with pytest.raises(TimeError, match="beyond what can be counted in units of 1/"):
            Schedule.of(*times, 1)

    def test_the_largest_counts_fly(self, witness):
        """Two steps up to 2^53 units of 1 ns, where the kernel must not overflow."""
        start, step = Fraction(2**53 - 2000, 10**9), Fraction(1000, 10**9)
        setup = both.experiment(stop=start + 2 * step, step=step, start_time=start, every=LARGEST_INTEGER)
        result = both.fly(both.of({"w": witness}, []), setup)
        assert result.time.tolist() == [float(start), float(start + 2 * step)]
        assert result["w.gaps"][-1] == 0


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        ("0.002", "2 ms"),
        ("0.0005", "0.5 ms"),
        ("0.000012", "12 us"),
        ("3", "3 s"),
        ("1.5", "1.5 s"),
        ("1/30", "1/30 s"),
    ],
)
def test_in_words(seconds, words):
    assert in_words(Fraction(seconds)) == words
    assert Fraction(parse_seconds(words, "step")).limit_denominator(10**9) == Fraction(seconds)
