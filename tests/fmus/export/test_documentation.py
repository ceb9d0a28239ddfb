"""Pages of components: what a docstring says as data, the notation of equations as HTML, nothing lost or made up."""

import re
import sys
import unicodedata
from collections import Counter
from html import unescape

import pytest
from lxml import etree

from components.catalog import CATALOG
from components.framework import Component, Input, Output, Parameter, PythonComponent
from fmus.export.documentation import css, html_body, html_document, page_of
from fmus.export.documentation.notation import has_crosses, typeset
from fmus.export.documentation.page import Equation, Preformatted, read_docstring


def plain(html: str) -> str:
    """HTML as text, indices in braces."""
    for tag, sign in (("sub", "_"), ("sup", "^")):
        html = re.sub(rf"<{tag}>(.*?)</{tag}>", rf"{sign}{{\1}}", html)
    return unescape(re.sub(r"<[^>]*>", "", html.replace("&emsp;", " ")))


@pytest.mark.parametrize(
    ("typed", "shown"),
    [
        ("J w' + delta^T eta'' + w x h = tau_B", "J ẇ + δ^{T} η̈ + w × h = τ_{B}"),
        ("q' = 1/2 q (x) (0, w)", "q̇ = ½ q ⊗ (0, w)"),
        ("omega_BN_B, omega_dot_RN_R, omega_RN_R'", "ω_{BN}^{B}, ω̇_{RN}^{R}, ω̇_{RN}^{R}"),
        ("omega_RN_R,i' = a_i", "ω̇_{RN, i}^{R} = a_{i}"),
        ("omega_BN_B^2", "ω_{BN, B}^{2}"),  # a frame above would be taken for part of the exponent
        ("eta_dot = psi - delta w", "η̇ = ψ − δ w"),
        ("mu_hat' = tau_mu (|s| - gamma mu_hat)", "μ̂̇ = τ_{μ} (|s| − γ μ̂)"),
        ("|W_f~|^2, r^ . s^, v_N = q (x) v_B (x) q*", "|W̃_{f}|^{2}, r̂ · ŝ, v_{N} = q ⊗ v_{B} ⊗ q^{*}"),
        ("J*^-1, W*^T h, A_w^+ u, r^(n + 1)", "J^{*}^{−1}, W^{*}^{T} h, A_{w}^{+} u, r^{(n + 1)}"),
        ("h'_xy, c'_j, D_eta_dot eta''_0", "ḣ_{xy}, ċ_{j}, D_{η̇} η̈_{0}"),
        ("z1^2 / T, x11, rho_inf, s_i0", "z_{1}^{2} / T, x_{11}, ρ_{∞}, s_{i0}"),
        (
            "sqrt(2 pi a) <= 1, a >= b, y <- y, a -> b, a != b, +-90 deg",
            "√(2 π a) ≤ 1, a ≥ b, y ← y, a → b, a ≠ b, ±90 deg",
        ),
        ("sum_i<j (A_i x A_j)^2 + sum_k h_k", "∑_{i<j} (A_{i} × A_{j})^{2} + ∑_{k} h_{k}"),
        ("sigma_u T^1/2 n, r^2/2, A_1/2 b_2/2", "σ_{u} T^{1/2} n, r^{2}/2, A_{1/2} b_{2}/2"),
        ("Y.-C. Ho, +- i w", "Y.-C. Ho, ± i w"),
        ("(G x)_i - rho'^2, (a + b)' z", "(G x)_{i} − ρ̇^{2}, (a + b)′ z"),
        ("z = x x y, r x v, 3 mu/r^5 r x J r", "z = x × y, r × v, 3 μ/r^{5} r × J r"),
        ("dcm_BN (-sin a, 0, cos a), min_i f_i", "dcm_{BN} (−sin a, 0, cos a), min_{i} f_{i}"),
        ("3-2-1, 1e-3, 1/20, gyroscopic/elastic, kg m^2", "3-2-1, 1e-3, 1/20, gyroscopic/elastic, kg m^{2}"),
        # not known, so as it is typed
        ("motor_work + dead zone(x)", "motor_work + dead zone(x)"),
        ("R: x along the velocity, y to nadir", "R: x along the velocity, y to nadir"),
        ("a*b, 2*x, max_rate, e^{2}, a < b & c", "a*b, 2*x, max_rate, e^{2}, a < b & c"),
    ],
)
def test_notation(typed, shown):
    assert plain(typeset(typed)) == shown


@pytest.mark.parametrize(
    ("typed", "shown"),
    [
        ("the controller's torque, a mode of the gyros' J' w", "the controller's torque, a mode of the gyros' J̇ w"),
        ("e.g. 1 kg m^2, 5 N m, 2 rad/s2, J. Harbin, (1c)", "e.g. 1 kg m^{2}, 5 N m, 2 rad/s2, J. Harbin, (1c)"),
        ("see mathematics/euler.py and `place_gains`", "see mathematics/euler.py and place_gains"),
        ("w omega_BN_B; its rate omega_BN_B'", "w omega_BN_B; its rate ω̇_{BN}^{B}"),
    ],
)
def test_prose_keeps_words_units_and_the_names_of_variables(typed, shown):
    assert plain(typeset(typed, known=["omega_BN_B"], prose=True)) == shown


def test_an_x_that_is_a_variable_is_no_cross():
    assert not has_crosses(["x' = A x + B u", "w x h"])
    assert not has_crosses(["sigma = D x - I"])
    assert not has_crosses(["xi = [w; G x]"])
    assert has_crosses(["L' = tau - w x L", "x_R = y_R x z_R", "R: x along v", "z = x x y"])
    assert plain(typeset("K x e", crosses=False)) == "K x e"


BACK = {"½": "1/2", "√": "sqrt", "⊗": "x", "×": "x", "·": ".", "−": "-", "′": "", "∞": "inf", "∑": "sum", "±": "+-"}
BACK |= {"≤": "<=", "≥": ">=", "≠": "!=", "→": "->", "←": "<-"}


def letters(text: str) -> Counter[str]:
    """How often each character is there, spelt out: Greek in words, without marks over letters and between indices."""
    spelt = ""
    for c in unicodedata.normalize("NFD", text):
        name = unicodedata.name(c, "")
        if name.startswith("GREEK"):
            word = {"LAMDA": "lambda"}.get(name.split()[-1], name.split()[-1].lower())
            spelt += word.capitalize() if "CAPITAL" in name else word
        elif not unicodedata.combining(c):
            spelt += BACK.get(c, c)
    return Counter(re.sub(r"[\s_'~^,`]", "", re.sub(r"_d?dot\b|_hat\b|_dot(?=_)|\bOm(?=\b|_)|Omega", "", spelt)))


@pytest.mark.parametrize("name", CATALOG)
def test_nothing_of_an_equation_is_lost(name):
    page = page_of(CATALOG[name])
    blocks = [*page.body, *(b for section in page.sections.values() for b in section)]
    equations = [line for block in blocks if isinstance(block, tuple) for line in block]
    assert equations
    for line in equations:
        html = typeset(line.text, known=page.names)
        html = html.replace("\u0307</i></sub>", "</i></sub>")  # D_eta_dot
        assert letters(unescape(re.sub("<[^>]*>", "", html))) == letters(line.text.replace("(x)", "x")), line.text


@pytest.mark.parametrize("name", CATALOG)
def test_page_of_every_component(name):
    """The page has each number of an equation, each section and each variable with its unit, and is well-formed."""
    part = CATALOG[name]()
    page = page_of(part)
    html = html_body(page)
    tree = etree.fromstring(html.replace("&emsp;", " "))
    shown = [cell.text for cell in tree.iter("td") if cell.get("class") == "number" and cell.text]
    text = part.__doc__ or sys.modules[type(part).__module__].__doc__ or ""
    assert shown == re.findall(r"^ +\S.* (\(\d+[a-z]?\))$", text, re.MULTILINE)
    assert [h.text for h in tree.iter("h2")][: len(page.sections)] == list(page.sections)
    assert {"Source", "Limits"} <= page.sections.keys()
    rows = {
        row[0][0].get("id"): row
        for row in tree.iter("tr")
        if row[0].tag == "td" and len(row[0]) and row[0][0].get("id")
    }
    groups = (part.parameters, part.calculated_parameters, part.inputs, part.states, part.outputs_declared)
    declared = {v.name: v for group in groups for v in group}
    assert rows.keys() == declared.keys()
    assert {n: row[1].text for n, row in rows.items()} == {n: v.unit for n, v in declared.items()}
    assert "<script" not in html and "http" not in html


def test_document_stands_alone():
    page = page_of(CATALOG["FlexibleSpacecraft"])
    html = html_document(page)
    assert html.startswith("<!DOCTYPE html>") and '<meta charset="utf-8">' in html
    assert css() in html and html_body(page) in html
    assert not re.search(r"<script|<link|src=|url\(|@import", html)


def test_page_has_structure_values_and_shapes():
    page = page_of(CATALOG["FlexibleSpacecraft"](modes=3))
    variables = {v.name: v for v in page.variables}
    assert page.structure == {"modes": 3}
    assert variables["delta"].sized == "delta[3,3]"
    assert variables["J"].start == "[[300, 0, 0], [0, 200, 0], [0, 0, 250]]"
    assert variables["tau_B"].kind == "input" and variables["eta"].kind == "output"
    assert variables["solver.step"].kind == "tunable parameter" and variables["solver.step"].start == "0"
    assert page.facts == "role in a loop: plant; structure: modes = 3"


class Mine(Component):
    """Gain of <mine> & others.

    It has prose,
    over two lines.

        adcs run --set a.k=3 *.py

    Then y = k u:
        y = k u      (1)
          + 0
    Symbols: y y. Limits: none."""

    u = Input(unit="1", doc="what <comes> in")
    y = Output(unit="1", doc="what goes out")
    k = Parameter(unit="1", start=1.5, doc="gain")


class MinePlain(PythonComponent):
    """Says one line."""

    sample_time = 0.5
    y = Output(unit="1", doc="out")


def test_docstring_of_a_users_class():
    page = page_of(Mine)
    assert page.title == "Gain of <mine> & others."
    assert page.body == (
        "It has prose, over two lines.",
        Preformatted("adcs run --set a.k=3 *.py"),
        "Then y = k u:",
        (Equation("y = k u", "1"), Equation("+ 0", "", 2)),
    )
    assert page.sections == {"Symbols": ("y y.",), "Limits": ("none.",)}
    html = html_body(page)
    assert "Gain of &lt;mine&gt; &amp; others." in html and "<pre>adcs run --set a.k=3 *.py</pre>" in html
    assert "what &lt;comes&gt; in" in html
    etree.fromstring(html.replace("&emsp;", " "))


def test_page_of_a_component_that_says_little():
    page = page_of(MinePlain())
    assert (page.title, page.body, page.sections) == ("Says one line.", (), {})
    assert page.facts == "sampled, every 0.5 s; in plain Python: python back end only"
    assert read_docstring("") == ("", (), {})
