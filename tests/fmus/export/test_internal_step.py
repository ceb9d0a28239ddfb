"""A unit whose own step is too long for its own dynamics says so, with the step that would do; both back ends."""

import ctypes
import subprocess

import casadi as ca
import numpy as np
import pytest
from numpy.testing import assert_allclose

from components.framework.integrator import rk4
from components.plants.flexible_spacecraft import FlexibleSpacecraft
from cosim import Experiment, System, simulate
from cosim.flights import find
from fmus.description.annotations import GROWS
from fmus.export.build import build
from fmus.export.native.native_fmu import INCLUDED, describe_native, native_sources
from fmus.export.python.internal_step import judged
from fmus.toolchain import FLAGS, find_compiler

from .compiling import complaints
from .linear import Chain, Linear
from .slaves import Slave, unpack


@pytest.fixture(scope="module", params=["native", "python"])
def linear(request, tmp_path_factory):
    """What the messages of x' = A x are after some steps of a size, flown from x = 1."""
    folder = tmp_path_factory.mktemp("linear")
    built = {}

    def fly(A, step=1e-3, stop=None, solver=None):
        A = np.array(A, dtype=float)
        if len(A) not in built:
            built[len(A)] = build(Linear(n=len(A)), folder / f"L{len(A)}{request.param}.fmu", request.param)
        parameters = {"unit.A": A} | ({} if solver is None else {"unit.solver.step": solver})
        system = System(name="alone", components={"unit": built[len(A)]}, parameters=parameters)
        stop = 2 * step if stop is None else stop
        result = simulate(system, Experiment(stop_time=stop, communication_step_size=step), locate=find)
        return list(result.info["messages"].get("unit", {}))

    return fly


def swing(omega, damping=0.0):
    return [[0, omega], [-omega, -2 * damping * omega]]


def head(h):
    return f"an internal step of {h:.3g} s is too long for its dynamics: at the start "


def test_what_decays_too_fast(linear):
    (told,) = linear(np.diag([-1e4, -1.0]))
    assert told.endswith(f"{head(1e-3)}a rate of 1e+04 1/s decays, {GROWS}. solver.step = 0.0001 s would do.")
    assert linear(np.diag([-1e4, -1.0]), solver=1e-4) == []
    assert linear(np.diag([-1e4, -1.0]), step=1e-4) == []  # the communication step is the internal one


def test_what_turns_too_fast(linear):
    (told,) = linear(swing(500.0))
    words = "it turns or swings at a rate of 500 1/s, of which RK4 loses more than 0.001 in 100 revolutions"
    assert told.endswith(f"{head(1e-3)}{words}. solver.step = 0.0003 s would do.")
    assert linear(swing(500.0), solver=3e-4) == []


@pytest.mark.parametrize(
    "A",
    [
        np.zeros((2, 2)),
        [[0, 1], [0, 0]],
        np.diag([-2700.0, -1.0]),
        np.diag([3000.0, -1.0]),
        swing(180.0),
        swing(300.0, damping=0.8),
        [[0, 1e6], [-1e-6, 0]],
        np.diag([-1e-15, -1e-3]),
        swing(1e-9),
    ],
    ids=[
        "at rest",
        "integrators",
        "decays, and RK4 too",
        "grows itself",
        "slow",
        "damped",
        "badly scaled",
        "hardly decays",
        "hardly turns",
    ],
)
def test_what_rk4_follows_is_not_warned_of(linear, A):
    assert linear(A) == []


def test_the_worst_is_told(linear):
    A = np.zeros((5, 5))
    A[:2, :2], A[2:4, 2:4], A[4, 4] = swing(600.0), swing(900.0), -3000.0
    assert "a rate of 3e+03 1/s decays" in linear(A)[0]
    A[4, 4] = -1000.0
    assert "at a rate of 900 1/s" in linear(A)[0]


@pytest.mark.parametrize(("omega", "warned"), [(180.0, False), (195.0, True)])
def test_the_bound_is_what_rk4_does_lose(linear, omega, warned):
    """A thousandth of the amplitude in a hundred revolutions, by RK4 itself."""
    x = ca.SX.sym("x", 2)
    none = ca.SX.sym("u", 0)
    t = ca.SX.sym("t")
    rate = ca.vertcat(omega * x[1], -omega * x[0])
    arguments = [t, x, none, none, none]
    f = ca.Function("rates", arguments, [rate], ["t", "x", "u", "p", "c"], ["dx"])
    step, value = rk4(f, None), ca.DM([1.0, 0.0])
    for _ in range(round(100 * 2 * np.pi / omega / 1e-3)):
        value = step(0, value, [], [], [], [], [], [], 0, 1e-3)
    assert (1 - float(ca.norm_2(value)) > 1e-3) == warned
    assert bool(linear(swing(omega))) == warned


def test_it_is_told_once_a_run_as_a_warning(tmp_path):
    slave = Slave(unpack(build(Linear(A=swing(500.0)), tmp_path / "Fast.fmu")))
    for _ in range(2):
        slave.start()
        assert slave.messages == []
        for k in range(3):
            slave.doStep(k * 1e-3, 1e-3)
        (told,) = slave.messages
        assert told.startswith("Fast: an internal step of 0.001 s is too long")
        slave.messages.clear()
        slave.reset()
    slave.freeInstance()


@pytest.mark.parametrize("backend", ["native", "python"])
def test_a_fast_rigid_body(tmp_path, backend):
    """600 rad/s and more about each axis, of which 1 s at 1 ms loses 7e-4 of the energy."""
    fmu = build(FlexibleSpacecraft(modes=0, omega_BN_B=[600.0, 500.0, 620.0]), tmp_path / "Fast.fmu", backend)
    parameters = {"plant.solver.step": 1e-3}
    system = System(name="s", components={"plant": fmu}, parameters=parameters, hold_unconnected=True)
    result = simulate(system, Experiment(stop_time=0.01, communication_step_size=0.001), locate=find)
    (told,) = result.info["messages"]["plant"]
    assert "it turns or swings at a rate of 499 1/s" in told and "solver.step = 0.0003 s would do" in told


@pytest.mark.parametrize("backend", ["native", "python"])
def test_of_a_big_component_instability_is_found(tmp_path, backend):
    fmu = build(Chain(), tmp_path / "Chain.fmu", backend)
    for k, warned in ((2500.0, True), (500.0, False)):
        system = System(name="s", components={"unit": fmu}, parameters={"unit.k": k})
        result = simulate(system, Experiment(stop_time=0.002, communication_step_size=0.001), locate=find)
        told = list(result.info["messages"].get("unit", {}))
        assert bool(told) == warned
    rate = judged(lambda v: -2500 * (2 * v - np.roll(v, 1) - np.roll(v, -1)), 150, 1e-3).rate
    assert rate == pytest.approx(1e4, rel=0.03)


def test_what_cannot_be_judged_is_left_alone():
    assert judged(lambda v: np.full_like(v, np.nan), 3, 1e-3) is None
    assert judged(lambda v: 0 * v, 150, 1e-3) is None
    assert judged(lambda v: -v, 3, 0.0) is None


PROBE = """
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include "internal_step.c"
int probe(const double *a, int n, double *re, double *im)
{
    Complex *h = (Complex *)calloc((size_t)(n * n + 3 * n), sizeof *h), *values = h + n * n + 2 * n;
    int i, done;
    for (i = 0; i < n * n; i++) h[i].re = a[i];
    done = eigenvalues(h, n, values, h + n * n);
    for (i = 0; i < n; i++) re[i] = values[i].re, im[i] = values[i].im;
    free(h);
    (void)judged;
    return done;
}
"""


@pytest.fixture(scope="module")
def in_c(tmp_path_factory):
    """Eigenvalues by internal_step.c."""
    folder = tmp_path_factory.mktemp("probe")
    (folder / "probe.c").write_text(PROBE)
    for file in INCLUDED:
        (folder / file.name).write_bytes(file.read_bytes())
    flags = [flag for flag in FLAGS if flag not in ("-fvisibility=hidden", "-s")]
    command = [*find_compiler(), *flags, "-DNX=100", "probe.c", "-o", "probe.so", "-lm"]
    subprocess.run(command, cwd=folder, check=True)
    library = ctypes.CDLL(str(folder / "probe.so"))

    def eigenvalues(a):
        a = np.ascontiguousarray(a, dtype=float)
        n = len(a)
        re, im = np.zeros(n), np.zeros(n)
        pointers = [ctypes.c_void_p(v.ctypes.data) for v in (a, re, im)]
        assert library.probe(pointers[0], n, pointers[1], pointers[2]) == 1
        return re + 1j * im

    return eigenvalues


def test_eigenvalues_in_c_are_those_of_lapack(in_c):
    random = np.random.default_rng(3)
    cycle = np.roll(np.eye(7), 1, axis=0)
    cases = [random.standard_normal((n, n)) for n in (1, 2, 3, 5, 22, 60, 100)]
    cases += [cycle, np.diag([1.0, -2.0, 1e-9]), np.array(swing(500.0)), np.zeros((4, 4)), np.eye(5)]
    cases += [np.kron(np.diag([1.0, 10.0, 1e3]), swing(2.0)), random.standard_normal((9, 9)) * 10.0 ** np.arange(-4, 5)]
    cases += [np.triu(random.standard_normal((8, 8))), np.kron(np.eye(4), cycle)]
    for a in cases:
        values, expected = list(in_c(a)), np.linalg.eigvals(a)
        for value in expected:  # nearest to nearest, for conjugates sort either way
            best = min(values, key=lambda other: abs(other - value))
            values.remove(best)
            assert abs(best - value) <= 1e-7 * max(1e-3, np.abs(expected).max())


def test_a_defective_matrix_has_its_eigenvalue_as_well_as_it_can(in_c):
    a = np.diag(np.full(4, -3.0)) + np.diag(np.ones(3), 1)
    assert_allclose(in_c(a), -3.0, atol=1e-3)


@pytest.mark.parametrize("component", [Linear(), Chain()], ids=["small", "big"])
def test_the_sources_compile_without_a_warning(tmp_path, component):
    for name, data in native_sources(component, describe_native(component, component.name)).items():
        (tmp_path / name).write_bytes(data)
    assert complaints(tmp_path, "-o", "unit.so", "-lm") == ""
