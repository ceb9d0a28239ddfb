"""The notation of docstrings, `J w' + delta^T eta'' + w x h = tau_B`, as HTML: plain elements, no script, no style.

    delta, omega_BN_B, x_1, z1   Greek letters, indices; of omega_BN_B the frame B stands above, the pair BN below
    w', eta'', eta_dot           time derivatives: dots over the letter
    f_hat, W~, s^                hats and tildes over the letter
    J^-1, delta^T, r^(n + 1)     exponents; T^1/2 is a root, r^2/2 half a square
    q*, W*                       stars
    w x h, q (x) p, a . b        cross, quaternion product, dot; 1/2, sqrt(..), sum_i, <=, >=, !=, ->, <-, +-
What is not known stays as it is typed. An x that is a variable of the text is never taken for a cross.
"""

import re
import unicodedata
from collections.abc import Callable, Iterable
from html import escape

_SMALL = "alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi pi rho sigma tau upsilon phi chi psi"
_LETTERS = "αβγδεζηθικλμνξπρστυφχψ"
_GREEK = dict(zip(_SMALL.split(), _LETTERS, strict=True)) | {"omega": "ω"}
GREEK = _GREEK | {name.capitalize(): letter.upper() for name, letter in _GREEK.items()} | {"Om": "Ω"}
OVER = {"dot": "\u0307", "ddot": "\u0308", "hat": "\u0302", "bar": "\u0304", "tilde": "\u0303"}
DOTS = ("", "\u0307", "\u0308", "\u20db")
SIGNS = {
    "(x)": "⊗",
    "<=": "≤",
    ">=": "≥",
    "!=": "≠",
    "->": "→",
    "<-": "←",
    "+-": "±",
    "1/2": "½",
    "sqrt(": "√(",
    ".": "·",
    "x": "×",
    "-": "−",
    "'": "′",
}
INDEXED = {"dcm", "min", "max", "det"}  # words that take indices as symbols do
_PRIMES = r"'{1,3}(?![A-Za-z])"
_UNIT = r"(?:kg|rad|deg|Hz|N|m|s|J|W)"

_TOKEN = re.compile(
    rf"""
    (?P<code>`[^`]+` | [\w/]*\w\.(?:py|toml|csv|json|md)\b)
  | (?P<word>\b(?:e\.g|i\.e)\. | \b[A-Z]\.(?=\s|$) | \(\d+[a-z]+\) | [A-Za-z]+'(?:s|t)\b
      | (?<![\w.]){_UNIT}\d?(?:[./]{_UNIT}\d?)+(?!\w))
  | (?P<half>(?<![\w./)])(?<!\w\()1/2(?![\w./]))
  | (?P<number>(?<![\w.])\d+(?:\.\d+)?(?:e[+-]?\d+)?(?!\w))
  | (?P<sum>\bsum_(?P<over>\w+(?:<\w+)?)(?=\ ))
  | (?P<root>\bsqrt\()
  | (?P<symbol>(?P<name>[A-Za-z]\w*)(?P<primes>{_PRIMES})?(?P<late>(?<=')_\w+)?
      (?P<index>(?<=_\w),[a-z](?!\w))?(?P<last>(?<=,[a-z]){_PRIMES})?
      (?P<halved>(?<=_1)/2(?!\w))?(?P<tilde>~)?(?P<hat>\^(?=[\s),;\]]|$))?(?P<star>\*(?=[\s).,;:\]|^]|$))?)
  | (?P<power>(?<=[\w)\]|*'])\^
      (?P<exponent>\([^()]*\) | 1/\d(?!\w) | [+-]?\d+(?:\.\d+)? | [+-]?[A-Za-z]\w* | [+-](?!\w)))
  | (?P<part>(?<=[)\]|])_(?P<inner>\w+))
  | (?P<sign>(?<=\s)\(x\)(?=\s) | <= | >= | != | -> | <- | \+-(?=[\w\ ]) | (?<=\ )\.(?=\ ) | (?<=[)\]|])'(?![A-Za-z])
      | (?<=\ )-(?=\ ) | ^-(?=\ ) | (?<![\w)\]'.-])-(?=[\w(|\[]))
  | (?P<space>\s+)
  | (?P<other>.)
    """,
    re.VERBOSE | re.DOTALL,
)
_IS_X = re.compile(r"(?<![\w'])x(?:'|\(| =)|[\w)\]'] x *(?:[-+=/,;\])]|$)|(?<=[\w)\]] )x$")
"""An x that no cross can be: with a prime or an argument, or without an operand at its right."""


def typeset(text: str, *, known: Iterable[str] = (), prose: bool = False, crosses: bool = True) -> str:
    """Return a text as HTML.

    known: names of variables, which prose shows as they are written. prose: single letters without indices stay as
    they are, for they may be words. crosses: whether ` x ` between two operands is a product, see `has_crosses`.
    """
    names = frozenset(known)
    matches = list(_TOKEN.finditer(text))
    return "".join(_html(i, matches, names, prose, crosses) for i in range(len(matches)))


def has_crosses(equations: Iterable[str]) -> bool:
    """Whether x is free to be a cross in these equations: in none it is a variable."""
    return not any(_IS_X.search(text) for text in equations)


def _html(i: int, matches: list[re.Match[str]], known: frozenset[str], prose: bool, crosses: bool) -> str:
    """Return one token as HTML; what follows and goes before decides what an x is, and where a frame can stand."""
    match = matches[i]
    text = match[0]
    if match["symbol"] is not None:
        if text == "x" and crosses and _between_operands(i, matches):
            return SIGNS["x"]
        if prose and _is_unit(i, matches):
            return text
        powered = i + 1 < len(matches) and matches[i + 1]["power"] is not None
        return _symbol(match, known, prose, bare=not powered)
    plain: dict[str, Callable[[re.Match[str]], str]] = {
        "code": lambda m: f"<code>{escape(m[0].strip('`'))}</code>",
        "half": lambda _: SIGNS["1/2"],
        "sum": lambda m: f"∑<sub>{escape(m['over'])}</sub>",
        "root": lambda _: SIGNS["sqrt("],
        "power": lambda m: f"<sup>{_exponent(m['exponent'], known, crosses)}</sup>",
        "part": lambda m: f"<sub>{_indices(m['inner'].split('_'))}</sub>",
        "sign": lambda m: SIGNS[m[0]],
        "space": lambda m: " " if len(m[0]) == 1 else "&emsp;",
    }
    chosen = next((name for name in plain if match[name] is not None), None)
    return plain[chosen](match) if chosen else escape(text, quote=False)


def _exponent(text: str, known: frozenset[str], crosses: bool) -> str:
    if text.startswith("("):
        return typeset(text, known=known, crosses=crosses)
    sign, rest = (text[0], text[1:]) if text[0] in "+-" else ("", text)
    letters = rest if rest in ("", "T") or not rest[0].isalpha() else typeset(rest)
    return sign.replace("-", "−") + letters


# ---- symbols ---------------------------------------------------------------------------------------------------


def _symbol(match: re.Match[str], known: frozenset[str], prose: bool, bare: bool) -> str:
    """Return a name with its dots, hats, indices and star; bare: no exponent follows."""
    name, primes = match["name"], match["primes"] or match["last"] or ""
    decorated = bool(primes or match["star"] or match["tilde"] or match["hat"] or (not bare and len(name) == 1))
    base, *parts = name.split("_")
    letter, digits = _split(base)
    indexed = base in INDEXED and name not in known and all(re.fullmatch("[a-z]|[A-Z]+", part) for part in parts)
    if len(letter) > 1 and letter not in GREEK and not indexed:
        return _word(match[0], name, known, prose)
    if prose and not decorated and ((name in known and parts) or (len(name) == 1 and name in "aAI")):
        return f"<code>{name}</code>" if parts else name
    marks: list[str] = []
    while parts and parts[0] in OVER:
        marks.append(OVER[parts.pop(0)])
    if parts and parts[-1] in OVER and (len(parts) == 1 or re.fullmatch("[A-Z]+", parts[-2])):
        marks.append(OVER[parts.pop()])  # of omega_BN_B_dot the whole is meant
    marks += [OVER["tilde"]] * bool(match["tilde"]) + [OVER["hat"]] * bool(match["hat"])
    marks.append(DOTS[len(primes)])
    shown = unicodedata.normalize("NFC", GREEK.get(letter, letter) + "".join(marks))
    index = (match["index"] or "").lstrip(",")
    parts[-1:] = [part + (match["halved"] or "") for part in parts[-1:]]  # A_1/2
    below = [digits] * bool(digits) + parts + [p for p in (match["late"] or "").split("_") if p] + [index] * bool(index)
    above = "*" if match["star"] else ""
    if bare and not above and len(below) > 1 and re.fullmatch("[A-Z]{2}", below[0]) and re.fullmatch("[A-Z]", below[1]):
        above = below.pop(1)  # omega_BN_B: of B against N, in components of B
    letters = shown if indexed else f"<i>{shown}</i>"
    return letters + (f"<sub>{_indices(below)}</sub>" if below else "") + (f"<sup>{above}</sup>" if above else "")


def _split(base: str) -> tuple[str, str]:
    """Return a letter, or its Greek name, and the digits behind it; another word as it is."""
    found = re.fullmatch(r"([A-Za-z]+?)(\d*)", base)
    if found and (len(found[1]) == 1 or found[1] in GREEK):
        return found[1], found[2]
    return base, ""


def _word(text: str, name: str, known: frozenset[str], prose: bool) -> str:
    """Return a word of several letters as typed; a variable's name with an underscore as code, its index below."""
    whole, _, index = name.rpartition("_")
    rest = escape(text[len(name) :], quote=False)
    if re.fullmatch("[ijk]", index) and name not in known and (whole in known or "_" not in whole):
        marked = f"<code>{whole}</code>" if whole in known else whole
        return f"{marked}<sub><i>{index}</i></sub>{rest.replace(chr(39), SIGNS[chr(39)])}"
    if name in known or "_" in name:
        marked = f"<code>{name}</code>" if "_" in name or prose is False else name
        return marked + (rest.replace("'", SIGNS["'"]) if "_" in name else rest)
    return name + rest


def _indices(parts: list[str]) -> str:
    """Return indices, with commas between: Greek letters, `inf`, a dot over the letter before."""
    shown: list[str] = []
    for part in parts:
        letter, digits = _split(part)
        if part in OVER and shown:
            shown[-1] = re.sub("(?<=<i>.)", OVER[part], shown[-1]) if "<i>" in shown[-1] else f"{shown[-1]}, {part}"
        elif letter in GREEK or re.fullmatch("[a-z]", letter):
            shown.append(f"<i>{GREEK.get(letter, letter)}</i>{digits}")
        else:
            shown.append("∞" if part == "inf" else part)
    return ", ".join(shown)


# ---- neighbours ------------------------------------------------------------------------------------------------


def _between_operands(i: int, matches: list[re.Match[str]]) -> bool:
    """Whether blanks and operands, no words, stand on both sides."""
    if not (0 < i - 1 and i + 2 < len(matches) and matches[i - 1]["space"] and matches[i + 1]["space"]):
        return False
    left, right = matches[i - 2], matches[i + 2]
    return (_is_operand(left) or left[0] in ")]|" or left["power"] is not None) and (
        _is_operand(right) or right[0] in "([|"
    )


def _is_operand(match: re.Match[str]) -> bool:
    if match["number"] is not None or match["half"] is not None:
        return True
    if match["symbol"] is None:
        return False
    letter, _ = _split(match["name"].split("_")[0])
    return len(letter) == 1 or letter in GREEK or letter in INDEXED or "_" in match["name"]


def _is_unit(i: int, matches: list[re.Match[str]]) -> bool:
    """Whether a token is a unit behind a number, or behind another unit."""
    if not re.fullmatch(_UNIT, matches[i][0]) or i < 2 or matches[i - 1]["space"] is None:
        return False
    return matches[i - 2]["number"] is not None or _is_unit(i - 2, matches)
