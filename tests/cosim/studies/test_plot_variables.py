"""Figures of chosen variables, of clusters, of estimates, of the difference of two runs, and one over another."""

import numpy as np
import pyarrow as pa
import pytest
from scipy.spatial.transform import Rotation

from cosim.errors import UnknownName
from cosim.results.result import Result
from cosim.studies import plots
from cosim.studies.plots import estimates, overlay, pages, shown, variables

from ..figures import cut_off

T = np.linspace(0.0, 10.0, 101)


def field(name, unit):
    return pa.field(name, pa.float64(), metadata={"unit": unit})


def result(rows, units, time=T, info=None) -> Result:
    """A run from arrays by name, with their units."""
    columns, fields = [np.asarray(time, float)], [field("time", "s")]
    for name, values in rows.items():
        values = np.asarray(values, float)
        flat = values.reshape(len(values), -1)
        indices = [f"[{','.join(str(k + 1) for k in i)}]" for i in np.ndindex(values.shape[1:])]
        for i, column in enumerate(flat.T):
            columns.append(column)
            fields.append(field(name + (indices[i] if values.ndim > 1 else ""), units.get(name, "1")))
    return Result(pa.table(columns, schema=pa.schema(fields)), info or {})


def turned(degrees, axis=(0, 0, 1)):
    vectors = np.outer(np.broadcast_to(degrees, T.shape), axis)
    return Rotation.from_rotvec(vectors, degrees=True).as_quat(scalar_first=True)


def flight(rate=1.0, time=T) -> Result:
    n = len(time)
    rows = {
        "plant.q_BN": np.tile([1.0, 0, 0, 0], (n, 1)),
        "plant.omega_BN_B": np.radians(np.outer(np.full(n, rate), [1.0, 2.0, 3.0])),
        "plant.energy": rate * time,
        "actuators.wheel_speed": np.full((n, 4), rate * np.pi / 30),
    }
    return result(rows, {"plant.omega_BN_B": "rad/s", "actuators.wheel_speed": "rad/s", "plant.energy": "J"}, time)


def legend_of(figure):
    return [text.get_text() for text in figure.legends[0].texts]


class TestVariables:
    def test_a_pattern_chooses_and_every_variable_has_its_panel_with_name_and_unit(self):
        drawn = plots.draw_variables({"a": flight()}, ["plant.omega_*", "plant.energy"])
        assert list(drawn) == ["variables"]
        labels = [ax.get_ylabel() for ax in drawn["variables"].axes]
        assert labels == ["plant.omega_BN_B (deg/s)", "plant.energy (J)"]
        assert legend_of(drawn["variables"]) == ["x", "y", "z"]

    def test_rates_are_in_degrees_a_second_and_wheels_in_rpm(self):
        axes = plots.draw_variables({"a": flight(2.0)}, ["plant.omega_BN_B", "*.wheel_speed"])["variables"].axes
        assert [line.get_ydata()[0] for line in axes[0].lines[:3]] == pytest.approx([2.0, 4.0, 6.0])
        assert axes[1].get_ylabel() == "actuators.wheel_speed (rpm)"
        assert [line.get_ydata()[0] for line in axes[1].lines] == pytest.approx([2.0] * 4)

    def test_an_element_is_named_as_fmi_names_it(self):
        (ax,) = plots.draw_variables({"a": flight()}, ["plant.omega_BN_B[2]"])["variables"].axes
        assert ax.get_ylabel() == "plant.omega_BN_B[2] (deg/s)"
        assert ax.lines[0].get_ydata()[0] == pytest.approx(2.0)

    def test_runs_differ_in_line_style_and_components_in_colour(self):
        figure = plots.draw_variables({"a": flight(1.0), "b": flight(2.0)}, ["plant.omega_BN_B"])["variables"]
        assert legend_of(figure) == ["x", "y", "z", "a", "b"]
        first, second = figure.axes[0].lines[:3], figure.axes[0].lines[3:6]
        assert [p.get_color() for p in first] == [p.get_color() for p in second]
        assert len({p.get_color() for p in first}) == 3
        assert first[0].get_linestyle() != second[0].get_linestyle()

    def test_a_run_that_lacks_a_variable_is_left_out_of_its_panel(self):
        other = result({"pump.pressure": T}, {"pump.pressure": "Pa"})
        figure = plots.draw_variables({"a": flight(), "b": other}, ["pump.*", "plant.energy"])["variables"]
        assert [ax.get_ylabel() for ax in figure.axes] == ["plant.energy (J)", "pump.pressure (Pa)"]
        assert [sum(len(line.get_xdata()) > 0 for line in ax.lines) for ax in figure.axes] == [1, 1]

    def test_many_variables_go_onto_several_pages(self):
        many = result({f"u.x{i}": T for i in range(pages.A_PAGE + 1)}, {})
        drawn = plots.draw_variables({"a": many}, ["*"])
        assert [len(figure.axes) for figure in drawn.values()] == [pages.A_PAGE, 1]
        assert list(drawn) == ["variables", "variables_2"]
        assert drawn["variables_2"].get_suptitle().endswith("(2 of 2)")

    def test_a_name_that_no_run_has_is_answered_with_the_nearest(self):
        with pytest.raises(UnknownName, match=r'"plant.omega_NB_\*".*Did you mean "plant.omega_BN_B"'):
            plots.draw_variables({"a": flight()}, ["plant.omega_NB_*"])

    @pytest.mark.parametrize(
        ("name", "unit", "shown_in", "factor"),
        [
            ("plant.angle", "rad", "deg", 180 / np.pi),
            ("gyro.bias", "rad/s", "deg/h", 3600 * 180 / np.pi),
            ("wheels.wheel_speed", "rad/s", "rpm", 30 / np.pi),
            ("wheels.h_B", "N.m.s", "N.m.s", 1.0),
            ("box.count", None, "1", 1.0),
        ],
    )
    def test_units(self, name, unit, shown_in, factor):
        assert shown.unit_of(name, unit) == (shown_in, pytest.approx(factor))

    @pytest.mark.parametrize(
        ("name", "shape", "components"),
        [
            ("plant.q_BN", (4,), ["w", "x", "y", "z"]),
            ("wheels.speed", (4,), ["1", "2", "3", "4"]),
            ("plant.H_N", (3,), ["x", "y", "z"]),
            ("filter.P", (2, 2), ["1,1", "1,2", "2,1", "2,2"]),
            ("plant.energy", (), [""]),
        ],
    )
    def test_components(self, name, shape, components):
        assert shown.components_of(name, shape) == components


class TestDifference:
    def test_second_less_first_in_the_shown_unit(self):
        drawn, words = plots.draw_difference({"a": flight(1.0), "b": flight(3.5)}, ["plant.omega_BN_B"])
        lines = drawn["difference"].axes[0].lines[:3]
        assert [line.get_ydata()[-1] for line in lines] == pytest.approx([2.5, 5.0, 7.5])
        assert drawn["difference"].axes[0].get_ylabel() == "plant.omega_BN_B (deg/s)"
        assert words == "b less a at 101 common times, of 101 and 101 rows"

    def test_rows_of_one_time_are_compared_and_nothing_is_interpolated(self):
        """Rows every 0.1 s and every 0.25 s meet every 0.5 s."""
        coarse = flight(3.0, np.linspace(0.0, 10.0, 41))
        drawn, words = plots.draw_difference({"a": flight(1.0), "b": coarse}, ["plant.energy"])
        line = drawn["difference"].axes[0].lines[0]
        assert line.get_xdata() == pytest.approx(np.arange(21) / 2)
        assert line.get_ydata() == pytest.approx(np.arange(21.0))  # (3 - 1) t
        assert words == "b less a at 21 common times, of 101 and 41 rows"

    def test_times_that_are_equal_but_for_rounding_are_one(self):
        other = flight(1.0, np.cumsum(np.full(101, 0.1)) - 0.1)
        assert not np.array_equal(other.time, T)
        assert len(variables.common_times(flight(), other)[0]) == 101

    def test_of_attitudes_it_is_the_rotation_from_the_first_to_the_second(self):
        """Both turned about x; the second also by 2 deg about its own z, and as -q."""
        base = Rotation.from_rotvec([30.0, 0, 0], degrees=True)
        second = (base * Rotation.from_rotvec([0, 0, 2.0], degrees=True)).as_quat(scalar_first=True)
        runs = {
            name: result({"plant.q_BN": np.tile(q, (len(T), 1))}, {})
            for name, q in (("a", base.as_quat(scalar_first=True)), ("b", -second))
        }
        drawn, _ = plots.draw_difference(runs)
        lines = drawn["difference"].axes[0].lines[:3]
        assert [line.get_ydata()[0] for line in lines] == pytest.approx([0.0, 0.0, 2.0], abs=1e-12)
        assert "(deg)" in drawn["difference"].axes[0].get_ylabel()

    def test_runs_without_a_common_time_say_what_each_has(self):
        late = flight(1.0, T + 0.05)
        with pytest.raises(plots.NothingInCommon) as caught:
            plots.draw_difference({"a": flight(), "b": late})
        assert str(caught.value) == (
            "the runs have no time in common: a has 101 rows, 0 to 10 s 0.1 s apart; b has 101 rows, 0.05 to 10.05 s "
            "0.1 s apart. Fly both with one --step and --every."
        )

    def test_runs_without_a_common_variable_say_what_each_has(self):
        other = result({"pump.pressure": T}, {})
        with pytest.raises(plots.NothingInCommon, match=r"no variable in common: a has plant.q_BN.*; b has pump.press"):
            plots.draw_difference({"a": flight(), "b": other})

    def test_a_variable_that_only_one_of_them_has_is_unknown(self):
        more = result({"plant.energy": T, "pump.pressure": T}, {})
        with pytest.raises(UnknownName, match=r"pump\.pressure"):
            plots.draw_difference({"a": flight(), "b": more}, ["pump.pressure"])


def wired(rows, units, roles, sources) -> Result:
    """A run whose run.json says what its instances are, their inputs and the connections."""
    info = {
        "components": {name: {"role": role, "inputs": [], "outputs": []} for name, role in roles.items()},
        "connections": {target: {"source": source, "timing": "at_point"} for target, source in sources.items()},
    }
    return result(rows, units, T, info)


def sensed(**more) -> Result:
    """A plant that turns about z, a gyro with a bias, a filter that is off by 0.3 deg about its x and by 1 deg/h."""
    body = turned(2 * T)
    off = Rotation.from_quat(body, scalar_first=True) * Rotation.from_rotvec([0.3, 0, 0], degrees=True)
    rows = {
        "plant.q_BN": body,
        "plant.omega_BN_B": np.tile([0.0, 0.0, 0.1], (len(T), 1)),
        "gyro.omega_BN_B": np.tile([0.0, 0.0, 0.1 + np.radians(0.5)], (len(T), 1)),
        "gyro.bias": np.tile([1e-5, 0.0, 0.0], (len(T), 1)),
        "filter.q_BN": off.as_quat(scalar_first=True),
        "filter.bias": np.tile([1e-5 + np.radians(1.0) / 3600, 0.0, 0.0], (len(T), 1)),
        **more,
    }
    units = {f"{owner}.omega_BN_B": "rad/s" for owner in ("plant", "gyro")}
    units |= {"gyro.bias": "rad/s", "filter.bias": "rad/s", "filter.sigma_q_BN": "rad", "filter.sigma_bias": "rad/s"}
    return wired(
        rows,
        units,
        {"plant": "plant", "gyro": "sensor", "filter": "estimator"},
        {"gyro.omega_BN_B_true": "plant.omega_BN_B", "filter.omega_BN_B": "gyro.omega_BN_B"},
    )


def with_unit(schema, name, unit):
    return pa.schema([field(f.name, unit) if f.name.startswith(name) else f for f in schema])


class TestEstimates:
    def test_what_is_estimated_less_the_truth_in_its_unit(self):
        drawn = estimates.draw_estimates({"run": sensed()})
        assert list(drawn) == ["estimate_gyro", "estimate_filter"]
        labels = {name: [ax.get_ylabel() for ax in figure.axes] for name, figure in drawn.items()}
        assert labels == {"estimate_gyro": ["omega_BN_B (deg/s)"], "estimate_filter": ["q_BN (deg)", "bias (deg/h)"]}
        rate = drawn["estimate_gyro"].axes[0].lines
        assert [line.get_ydata()[5] for line in rate[:3]] == pytest.approx([0, 0, 0.5], abs=1e-12)
        attitude, bias = (ax.lines[:3] for ax in drawn["estimate_filter"].axes)
        assert [line.get_ydata()[5] for line in attitude] == pytest.approx([0.3, 0, 0], abs=1e-12)
        assert [line.get_ydata()[5] for line in bias] == pytest.approx([1.0, 0, 0], abs=1e-9)

    def test_deviations_are_drawn_three_times_to_either_side(self):
        """In the error's unit and colour, and the panel is no higher for them: they may start far off."""
        sigma = np.radians(np.tile([0.1, 0.2, 50.0], (len(T), 1)))
        run = sensed(**{"filter.sigma_q_BN": sigma, "filter.sigma_bias": sigma / 3600})
        axes = estimates.draw_estimates({"run": run})["estimate_filter"].axes
        assert [ax.get_ylabel() for ax in axes] == ["q_BN (deg)", "bias (deg/h)"]
        for ax in axes:
            dotted = [line for line in ax.lines if line.get_linestyle() == ":"]
            assert [line.get_ydata()[5] for line in dotted] == pytest.approx([-0.3, 0.3, -0.6, 0.6, -150, 150])
            assert dotted[0].get_color() == dotted[1].get_color() == ax.lines[0].get_color() != dotted[2].get_color()
            assert max(np.abs(ax.get_ylim())) < 2

    def test_an_observer_that_no_plant_feeds_is_left_out(self):
        run = sensed()
        run.info["connections"] = {}
        assert estimates.draw_estimates({"run": run}) == {}

    def test_they_are_among_the_figures_of_a_run(self):
        assert {"estimate_gyro", "estimate_filter"} <= set(plots.draw({"run": sensed()}))


class TestClusters:
    def cluster(self, wheels=4) -> Result:
        n = len(T)
        rows = {
            "plant.q_BN": turned(0 * T),
            "set.wheel_speed": np.outer(T, np.arange(1, wheels + 1)),
            "set.wheel_momentum": np.outer(T, np.ones(wheels)),
            "set.h_B": np.zeros((n, 3)),
            "set.tau_B": np.ones((n, 3)),
        }
        units = {"set.wheel_speed": "rad/s", "set.wheel_momentum": "N.m.s", "set.h_B": "N.m.s", "set.tau_B": "N.m"}
        return wired(rows, units, {"plant": "plant", "set": "actuators"}, {"plant.h_B": "set.h_B"})

    def test_speed_momentum_and_torque_of_wheels(self):
        figure = plots.draw({"run": self.cluster()})["cluster"]
        labels = [ax.get_ylabel() for ax in figure.axes]
        assert labels == ["wheel_speed (rpm)", "wheel_momentum (N m s)", "h_B (N m s)", "tau_B (N m)"]
        assert [line.get_ydata()[-1] for line in figure.axes[0].lines[:4]] == pytest.approx(
            10 * np.array([1, 2, 3, 4]) * 30 / np.pi
        )
        assert legend_of(figure) == ["1 or x", "2 or y", "3 or z", "4"]

    def test_clusters_of_two_runs_are_overlaid_also_where_one_has_a_wheel_more(self):
        figure = plots.draw({"a": self.cluster(3), "b": self.cluster(4)})["cluster"]
        assert sum(len(line.get_xdata()) > 0 for line in figure.axes[0].lines) == 7
        assert legend_of(figure)[-2:] == ["a", "b"]

    def test_a_run_without_rotors_has_no_such_figure(self):
        assert "cluster" not in plots.draw({"run": sensed()})


class TestOverlay:
    def figure(self, values, exponent=0, limit=1.0):
        figure, ((ax,),) = plots.panels(1, 1, "title")
        ax.plot(T, values / 10.0**exponent, label="run", color="#0072B2")
        ax.plot(T, T / 10.0**exponent, label="reference", color="#D55E00")
        ax.axhline(limit, label="limit")
        ax.set_ylabel(plots.label("x", "N.m", exponent))
        plots.legend(figure)
        return figure

    def test_what_differs_goes_behind_pale_and_named_and_what_is_equal_stays_single(self):
        figure = self.figure(np.sin(T))
        overlay.overlay(figure, self.figure(np.cos(T), limit=2.0), "published")
        assert legend_of(figure) == ["run", "reference", "limit", "run, published"]
        behind = figure.axes[0].lines[-1]
        assert behind.get_ydata() == pytest.approx(np.cos(T))
        assert behind.get_zorder() < figure.axes[0].lines[0].get_zorder()
        assert behind.get_linewidth() > figure.axes[0].lines[0].get_linewidth()

    def test_another_power_of_ten_is_that_of_the_figure(self):
        figure = self.figure(1e-3 * np.sin(T), exponent=-3)
        overlay.overlay(figure, self.figure(2e-2 * np.sin(T), exponent=-2), "other")
        assert figure.axes[0].lines[-1].get_ydata() == pytest.approx(20 * np.sin(T))

    @pytest.mark.parametrize("exponent", [0, -4, 12])
    def test_the_power_of_ten_is_read_from_the_label(self, exponent):
        assert overlay.exponent_of(plots.label("$\\eta_{12}$", "kg^(1/2).m", exponent)) == exponent


class TestFiles:
    def test_formats_and_size(self, tmp_path):
        from matplotlib.image import imread

        drawn = plots.draw_variables({"a": flight()}, ["plant.energy"])
        files = plots.save(drawn, tmp_path, ("png", "pdf", "svg"), (6.0, 4.0), 100)
        assert [file.name for file in files] == ["variables.png", "variables.pdf", "variables.svg"]
        assert imread(files[0]).shape[:2] == (400, 600)
        assert files[1].read_bytes().startswith(b"%PDF") and b"<svg" in files[2].read_bytes()

    def test_equal_figures_are_equal_files(self, tmp_path):
        twice = [
            plots.save(plots.draw_variables({"a": flight()}, ["*"]), tmp_path / name, plots.KINDS) for name in "ab"
        ]
        for one, other in zip(*twice, strict=True):
            assert one.read_bytes() == other.read_bytes(), one.name

    def test_an_unknown_format_is_refused_before_anything_is_written(self, tmp_path):
        with pytest.raises(UnknownName, match=r'unknown format "jpg" in figures.*png, pdf, svg'):
            plots.save(plots.draw_variables({"a": flight()}, ["*"]), tmp_path / "new", ("png", "jpg"))
        assert not (tmp_path / "new").exists()

    @pytest.mark.parametrize("size", [(4.0, 3.0), (6.0, 4.0), (12.0, 3.0)])
    def test_at_any_size_title_legend_and_labels_lie_inside(self, size):
        runs = {"a run with a rather long name": flight(1.0), "another run with a long name": flight(2.0)}
        (figure,) = plots.draw_variables(runs, ["*"]).values()
        figure.suptitle("A title that has a good many words, more than there is room for on a small page of a paper")
        plots.style.resize(figure, *size)
        assert cut_off(figure) == []
