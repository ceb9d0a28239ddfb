import re

import numpy as np
import pyarrow as pa
import pytest
from matplotlib.image import imread

from cosim.results.result import Result
from cosim.studies import plots

T = np.linspace(0.0, 20.0, 201)
UNIT = re.compile(r"\((10\$\^\{-?\d+\}\$ ?)?(|s|deg|deg/s|N m|kg\$\^\{1/2\}\$ m|1)\)$")


def flight(decay=0.3, modes=2, info=None, saturates=False) -> Result:
    angle = np.radians(np.exp(-decay * T))
    tau = np.column_stack([np.exp(-T), 2e-4 * np.cos(T), 1e-20 * T])
    columns = {
        "time": T,
        **named("plant.q_BN", np.column_stack([np.cos(angle / 2), np.sin(angle / 2), 0 * T, 0 * T])),
        **named("guidance.q_RN", np.tile([1.0, 0, 0, 0], (len(T), 1))),
        **named("guidance.omega_RN_R", np.zeros((len(T), 3))),
        **named("plant.omega_BN_B", np.column_stack([-decay * angle, 0 * T, 1e-3 * np.sin(T)])),
        **named("plant.tau_B", tau),
        **named("controller.tau_command_B", 1e3 * tau if saturates else tau),
        **named(
            "plant.eta",
            1e-5 * np.column_stack([np.sin((i + 1) * T) for i in range(modes)]) if modes else T[:, None][:, :0],
        ),
    }
    return Result(pa.table(columns), info or {})


def named(name, rows):
    return {f"{name}[{i + 1}]": rows[:, i] for i in range(rows.shape[1])}


def check(figure):
    """Every visible axis has data and a y label with its unit, each column a time axis, and there is one legend."""
    axes = [ax for ax in figure.axes if ax.get_visible()]
    for ax in axes:
        assert any(line.get_xdata().size for line in ax.lines), ax.get_ylabel()
        assert np.isfinite([ax.get_xlim(), ax.get_ylim()]).all()
    assert figure.legends
    labels = [ax.get_ylabel() for ax in axes if ax.get_ylabel()]
    assert labels and all(UNIT.search(label) for label in labels), labels
    assert any(ax.get_xlabel() == "time (s)" for ax in axes)
    assert figure.get_suptitle()


@pytest.mark.parametrize("modes", [0, 1, 2, 5, 8])
def test_figures_of_a_run(modes):
    drawn = plots.draw({"run": flight(modes=modes)})
    assert set(drawn) == {"attitude_error", "rates", "torque"} | ({"modal_coordinates"} if modes else set())
    for figure in drawn.values():
        check(figure)
    if modes:
        visible = [ax for ax in drawn["modal_coordinates"].axes if ax.get_visible()]
        assert len(visible) == modes
        columns = {round(ax.get_position().x0, 6) for ax in visible}
        assert sum(ax.get_xlabel() == "time (s)" for ax in visible) == len(columns)


def test_runs_are_overlaid_under_their_names():
    drawn = plots.draw({"fast": flight(1.0), "slow": flight(0.1, modes=1)})
    for figure in drawn.values():
        check(figure)
        texts = {text.get_text() for text in figure.legends[0].texts}
        assert {"fast", "slow"} <= texts
        first, second = figure.axes[0].lines[:2]
        assert first.get_color() != second.get_color()
        assert first.get_linestyle() != second.get_linestyle()


def test_angles_are_in_degrees():
    line = plots.draw({"run": flight()})["attitude_error"].axes[0].lines[0]
    assert line.get_ydata()[0] == pytest.approx(1.0)


def test_small_numbers_carry_their_power_of_ten_in_the_label():
    ax = plots.draw({"run": flight()})["modal_coordinates"].axes[0]
    exponent = int(re.search(r"10\$\^\{(-\d+)\}", ax.get_ylabel())[1])
    assert ax.lines[0].get_ydata() * 10.0**exponent == pytest.approx(1e-5 * np.sin(T))


def test_rounding_does_not_fill_a_panel():
    """A component of 1e-19 N m beside one of 1 N m is drawn as zero."""
    ax = plots.draw({"run": flight()})["torque"].axes[2]
    assert ax.get_ylabel() == r"$\tau_z$ (N m)"
    assert ax.get_ylim() == (-1, 1)


@pytest.mark.parametrize(
    ("parameters", "found"),
    [
        ({"actuators.torque_limit": {"value": 0.5, "unit": "N.m"}}, [0.5]),
        ({f"actuators.torque_limit[{i}]": {"value": 0.1 * i, "unit": "N.m"} for i in (1, 2, 3)}, [0.1, 0.2, 0.3]),
        ({"plant.torque_limits": {"value": 0.5, "unit": "N.m"}}, []),
    ],
)
def test_torque_limit(parameters, found):
    result = flight(info={"parameters": parameters, "components": {n: {"role": n} for n in ("plant", "actuators")}})
    assert plots.limits(result) == pytest.approx(found)
    texts = {text.get_text() for text in plots.draw({"run": result})["torque"].legends[0].texts}
    assert ("limit" in texts) == bool(found)


def test_a_command_that_is_not_delivered_is_drawn_beside_the_torque_but_does_not_hide_it():
    figure = plots.draw({"run": flight(saturates=True)})["torque"]
    assert "run: command" in {text.get_text() for text in figure.legends[0].texts}
    assert figure.axes[0].get_ylim()[1] == pytest.approx(3.0)


def test_without_guidance_the_attitude_itself_is_drawn():
    table = flight().table
    kept = [name for name in table.column_names if not name.startswith("guidance")]
    drawn = plots.draw({"run": Result(table.select(kept), {})})
    assert "attitude" in drawn and "attitude_error" not in drawn
    check(drawn["attitude"])


def test_a_system_without_attitude_has_no_figures():
    assert plots.draw({"run": Result(pa.table({"time": T, "pump.pressure": T}), {})}) == {}


def test_saved_files_are_pictures(tmp_path):
    files = plots.save(plots.draw({"run": flight()}), tmp_path / "new")
    assert {file.name for file in files} == {"attitude_error.png", "rates.png", "torque.png", "modal_coordinates.png"}
    for file in files:
        height, width = imread(file).shape[:2]
        assert width == 8 * 150 and height > 400


def test_nothing_is_cut_off():
    """All text lies inside the figure."""
    for figure in plots.draw({"a run with a rather long name": flight(modes=8), "b": flight(0.5)}).values():
        figure.canvas.draw()
        outer = figure.bbox
        for ax in figure.axes:
            if ax.get_visible():
                box = ax.get_tightbbox()
                assert box.x0 >= outer.x0 - 1 and box.x1 <= outer.x1 + 1
                assert box.y0 >= outer.y0 - 1 and box.y1 <= outer.y1 + 1
        box = figure.legends[0].get_window_extent()
        assert box.x0 >= outer.x0 and box.x1 <= outer.x1


def test_a_command_beside_what_was_given_and_its_limits():
    _, ((ax,),) = plots.panels(1)
    t = np.linspace(0, 1, 5)
    plots.asked_and_given(ax, t, 10 * t, np.minimum(10 * t, 2), (-2, 2))
    asked, given, *limits = ax.lines
    assert [line.get_label() for line in ax.lines] == ["asked", "given", "limit", "limit"]
    assert asked.get_ydata().max() == 10 and given.get_ydata().max() == 2
    assert [line.get_ydata()[0] for line in limits] == [-2, 2]
    assert asked.get_zorder() <= given.get_zorder()


@pytest.mark.parametrize(("threshold", "largest"), [(0.2, 2914.0), (20.0, 2.1e3), (0.65, 0.5), (1e-3, 1e-3)])
def test_an_axis_that_is_linear_to_the_limit_and_logarithmic_beyond(threshold, largest):
    _, ((ax,),) = plots.panels(1)
    plots.beyond_linear(ax, threshold, largest)
    low, high = ax.get_ylim()
    assert high == -low >= largest
    marks = ax.get_yticks()
    assert {-threshold, threshold} <= set(marks) and (np.sort(marks) == np.sort(-marks)).all()
    assert [float(text.get_text()) for text in ax.get_yticklabels()] == pytest.approx(list(marks), rel=1e-5)


def test_the_raw_command_of_a_controller_that_limits_itself():
    """`controller.u` is the command before the limit; tau_command_B would hide it."""
    n = 11
    columns = {"time": np.linspace(0, 1, n)}
    for i in (1, 2, 3):
        columns[f"plant.tau_B[{i}]"] = np.full(n, 0.2)
        columns[f"controller.tau_command_B[{i}]"] = np.full(n, 0.2)
        columns[f"controller.u[{i}]"] = np.linspace(0.3, 0.4, n)
    drawn = plots.draw({"run": Result(pa.table(columns), {})})["torque"]
    raw = next(line for line in drawn.axes[0].lines if line.get_label() == "run: command")
    assert raw.get_ydata().max() == pytest.approx(0.4)
