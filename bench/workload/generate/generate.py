"""Writes src/filters/derived/code.rs: a filter whose code is derived from the equations by sympy.

The motion is differentiated symbolically, F P F' + Q and the update are multiplied out, and all common subexpressions are
computed once (sympy.cse, stage by stage), for the 21 different entries of the symmetric P. This is what symforce and similar tools generate.

    pip install sympy==1.14.0
    python bench/workload/generate/generate.py            # writes the file
    python bench/workload/generate/generate.py --check    # compares it
    python bench/workload/generate/generate.py --fusable  # sums of products, which a fused multiply-add would compute at once
"""

import pathlib
import re
import sys

import sympy as sp

TARGET = pathlib.Path(__file__).parent.parent / "src/filters/derived/code.rs"
N = 6

HEAD = """//! Code derived from the equations with all common subexpressions computed once. Written by `generate/generate.py`: do not edit.

use crate::model::{Range, Step, TRACK_WIDTH, Vector};

/// The entries of the upper triangle of P, row by row.
pub type Triangle = [f32; 21];
"""


def symmetric():
    entries = sp.symbols(f"p0:{N * (N + 1) // 2}")
    p, n = sp.zeros(N, N), 0
    for i in range(N):
        for j in range(i, N):
            p[i, j] = p[j, i] = entries[n]
            n += 1
    return p, entries


def triangle(matrix):
    return [matrix[i, j] for i in range(N) for j in range(i, N)]


def product(number):
    """A product as Rust, and whether it is subtracted."""
    coefficient, rest = number.as_coeff_Mul()
    is_negative = bool(coefficient < 0)
    return abs(coefficient) * rest if is_negative else number, is_negative


def rust(e):
    if e.is_Add:
        terms = sorted((product(t) for t in e.args), key=lambda t: (t[1], t[0].is_Mul, sp.default_sort_key(t[0])))
        first, is_negative = terms[0]
        text = ("-" if is_negative else "") + atom(first)
        for term, is_negative in terms[1:]:
            factors = term.args if term.is_Mul else None
            if factors and not any(f.is_Pow for f in factors):
                a, b = atom(factors[0]), atom(sp.Mul(*factors[1:], evaluate=False) if len(factors) > 2 else factors[1])
                text = f"({bare(text)} {'-' if is_negative else '+'} {a} * {b})"
            else:
                text = f"({text} {'-' if is_negative else '+'} {atom(term)})"
        return text
    if e.is_Mul:
        term, is_negative = product(e)
        if is_negative:
            return f"-{atom(term)}"
        above = [f for f in term.args if not (f.is_Pow and f.exp == -1)]
        below = [f.base for f in term.args if f.is_Pow and f.exp == -1]
        text = " * ".join(atom(f) for f in above) or "1.0"
        return text + "".join(f" / {atom(f)}" for f in below)
    return atom(e)


def atom(e):
    if e.is_Symbol:
        return e.name
    if e.is_Number:
        return f"{float(e)!r}"
    if e.is_Pow:
        power = " * ".join([atom(e.base)] * abs(int(e.exp)))
        below = power if abs(int(e.exp)) == 1 else f"({power})"
        return below if e.exp > 0 else f"(1.0 / {below})"
    text = rust(e)
    return text if bare(text) != text else f"({text})"


class Code:
    """Statements. Each stage computes its common subexpressions once, and names its results for the next."""

    def __init__(self):
        self.lines = []
        self.names = sp.numbered_symbols("c")

    def stage(self, expressions):
        """The expressions as symbols, numbers and symbols as they are."""
        common, reduced = sp.cse(expressions, symbols=self.names, order="canonical")
        for name, e in common:
            self.let(name, e)
        return [e if e.is_Atom else self.named(e) for e in reduced]

    def named(self, e):
        name = next(self.names)
        self.let(name, e)
        return name

    def let(self, name, e):
        self.lines.append(f"    let {name} = {bare(rust(e))};")

    def matrix(self, matrix):
        return sp.Matrix(*matrix.shape, self.stage(list(matrix)))

    def symmetric(self, matrix):
        entries = iter(self.stage(triangle(matrix)))
        result = sp.zeros(N, N)
        for i in range(N):
            for j in range(i, N):
                result[i, j] = result[j, i] = next(entries)
        return result

    def body(self, state, p):
        for name, values in (("state", self.stage(list(state))), ("p", self.stage(triangle(p)))):
            text = ", ".join(atom(e) for e in values)
            self.lines.append(f"    *{name} = [{text}];")
        return "\n".join(used(self.lines))


def used(lines):
    """The lines without those whose value no later line uses."""
    kept = []
    for line in reversed(lines):
        name = re.match(r"    let (\w+) =", line)
        if not name or any(re.search(rf"\b{name[1]}\b", later) for later in kept):
            kept.append(line)
    return kept[::-1]


def bare(text):
    """Without parentheses around everything."""
    depth = 0
    for at, letter in enumerate(text):
        depth += {"(": 1, ")": -1}.get(letter, 0)
        if depth == 0:
            return text[1:-1] if text[0] == "(" and at == len(text) - 1 else text
    return text


def predict():
    x, y, h, mean, difference, width = state = sp.symbols("x y heading mean difference width_error")
    right, left, sin, cos, track = sp.symbols("right left sin cos TRACK_WIDTH")
    advance, turn, width_inverse = sp.symbols("advance turn width_inverse")
    code = Code()
    # The motion by its two increments, and the increments by the parameters.
    common, spread = sp.symbols("common spread")
    code.let(common, right + left)
    code.let(spread, right - left)
    code.let(width_inverse, 1 / (track + width))
    code.let(advance, (common * (1 + mean) + spread * difference / 2) / 2)
    code.let(turn, (spread * (1 + mean) + common * difference / 2) * width_inverse)
    along, by = sp.symbols("along by", cls=sp.Function)
    parameters = (mean, difference, width)
    of_along = {mean: common / 2, difference: spread / 4, width: sp.Integer(0)}
    of_turn = {mean: spread * width_inverse, difference: common * width_inverse / 2, width: -turn * width_inverse}
    middle = h + by(*parameters) / 2
    s = along(*parameters)
    moved = sp.Matrix([x + s * sp.cos(middle), y + s * sp.sin(middle), h + by(*parameters), *parameters])
    known = {sp.diff(along(*parameters), v): of_along[v] for v in parameters}
    known |= {sp.diff(by(*parameters), v): of_turn[v] for v in parameters}
    f = moved.jacobian(state).subs(known)
    values = {sp.cos(middle): cos, sp.sin(middle): sin, along(*parameters): advance, by(*parameters): turn}
    f = code.matrix(f.subs(values))
    moved = moved.subs(values)
    p, _ = symmetric()
    fp = code.matrix(f * p)
    after = fp * f.T + sp.diag(*sp.symbols("q0:6"))
    return code.body(moved, after)


def update(is_stabilised):
    state = sp.symbols("x y heading mean difference width_error")
    a, b, offset, measured, variance, scale = sp.symbols("by_x by_y offset measured variance inverse")
    code = Code()
    p, _ = symmetric()
    jacobian = sp.Matrix([[a, b, 0, 0, 0, 0]])
    m = code.matrix(p * jacobian.T)
    code.let(scale, 1 / ((jacobian * m)[0] + variance))
    gain = code.matrix(m * scale)
    innovation = code.named(measured - (a * state[0] + b * state[1] + offset))
    moved = sp.Matrix(state) + gain * innovation
    if not is_stabilised:
        return code.body(moved, p - gain * m.T)
    # (I - K H) P, then its product with (I - K H)' and the noise, in which K' is a common factor.
    once = code.symmetric(p - gain * m.T)
    factor = code.matrix(gain * variance - once * jacobian.T)
    return code.body(moved, once + factor * gain.T)


def function(name, doc, argument, code):
    entries = ", ".join(f"p{n}" for n in range(21))
    lines = [
        "",
        f"/// {doc}",
        f"pub fn {name}(state: &mut Vector, p: &mut Triangle, {argument}) {{",
        "    let [x, y, heading, mean, difference, width_error] = *state;",
        f"    let [{entries}] = *p;",
    ]
    if argument.startswith("step"):
        lines.append("    let &Step { right, left, sin, cos, noise: [q0, q1, q2, q3, q4, q5] } = step;")
    else:
        lines.append("    let &Range { by_x, by_y, offset, measured, variance } = range;")
    return "\n".join(lines + [code, "}"]) + "\n"


def generated():
    text = HEAD
    text += function("predict", "State, F P Fᵀ + Q.", "step: &Step", predict())
    text += function("update", "P − K H P.", "range: &Range", update(False))
    text += function("update_stabilised", "Joseph's form.", "range: &Range", update(True))
    return text


if __name__ == "__main__":
    text = generated()
    if "--fusable" in sys.argv:
        for code in text.split("pub fn ")[1:]:
            print(code.split("(")[0], len(re.findall(r"[+-] [^-+*;]+ \* ", code)))
        sys.exit()
    if "--check" in sys.argv:
        sys.exit(0 if TARGET.read_text() == text else f"{TARGET} is not what this script writes")
    TARGET.write_text(text)
