"""Small faults that a line of Python can have: found in its syntax tree, put into its text."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from typing import NamedTuple

OPERATORS = {
    ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"),
    ast.Lt: ("<", "<="), ast.LtE: ("<=", "<"), ast.Gt: (">", ">="), ast.GtE: (">=", ">"),
    ast.Eq: ("==", "!="), ast.NotEq: ("!=", "=="), ast.And: ("and", "or"), ast.Or: ("or", "and"),
}  # fmt: skip
PAIRS = (
    ("min", "max"), ("minimum", "maximum"), ("argmin", "argmax"), ("any", "all"),
    ("floor", "ceil"), ("sin", "cos"), ("nanmin", "nanmax"), ("left", "right"), ("sum", "mean"),
)  # fmt: skip
OPPOSITE = {name: opposite for pair in PAIRS for name, opposite in (pair, pair[::-1])}
SYMMETRIC = {*OPPOSITE, "isinstance", "hypot", "zip", "getattr", "hasattr", "replace", "print"}
NOT_LOOKED_INTO = (ast.Raise, ast.JoinedStr, ast.Assert, ast.Import, ast.ImportFrom)


class Fault(NamedTuple):
    """Bytes `start` to `end` of a file, written otherwise."""

    line: int
    start: int
    end: int
    old: str
    new: str

    def put_into(self, source: bytes) -> bytes:
        return source[: self.start] + self.new.encode() + source[self.end :]

    def __str__(self) -> str:
        return " ".join(f"{self.old} -> {self.new}".split())[:150]


def faults_of(source: bytes) -> list[Fault]:
    """All faults of a file; a few leave no program."""
    lengths = [0]
    for line in source.splitlines(keepends=True):
        lengths.append(lengths[-1] + len(line))

    def place(node: ast.AST, end: bool = False) -> int:
        line, column = (
            (node.end_lineno, node.end_col_offset) if end else (node.lineno, node.col_offset)
        )
        return lengths[line - 1] + column

    def text(start: int, end: int) -> str:
        return source[start:end].decode()

    def whole(node: ast.AST) -> tuple[int, int, str]:
        start, end = place(node), place(node, True)
        return start, end, text(start, end)

    def of_node(node: ast.AST) -> Iterator[tuple[int, int, str]]:
        """Start, end and new text of each fault."""
        start, end, _ = whole(node)
        match node:
            case (
                ast.BinOp(left=left, op=op, right=right)
                | ast.Compare(left=left, ops=[op], comparators=[right])
                | ast.BoolOp(values=[left, right], op=op)
            ):
                if type(op) in OPERATORS:
                    old, new = OPERATORS[type(op)]
                    at = source.index(old.encode(), place(left, True), place(right))
                    yield at, at + len(old), new
                if isinstance(op, ast.Add | ast.Sub | ast.Mult | ast.Mod):
                    yield start, end, whole(left)[2]  # a term, a factor, a period left out
            case ast.UnaryOp(op=ast.USub() | ast.Not(), operand=operand):
                if not isinstance(operand, ast.Constant):
                    yield start, end, f"({whole(operand)[2]})"
            case ast.Constant(value=value) if type(value) is int and 0 <= value <= 2:
                yield start, end, str(value + 1)
            case ast.Constant(value=value) if type(value) is float and 0.1 <= value <= 10.0:
                yield start, end, str(2.0 * value)
            case ast.IfExp(test=test) | ast.If(test=test) | ast.While(test=test):
                if not isinstance(test, ast.Name | ast.NamedExpr):
                    first, last, what = whole(test)
                    yield first, last, f"not ({what})"
            case ast.AugAssign() | ast.Expr(value=ast.Call(func=ast.Name(id="warn_accuracy"))):
                yield start, end, "pass"
            case ast.Expr(value=ast.Call(func=ast.Name(id="warn_user"))):
                yield start, end, "pass"
            case ast.Call(func=ast.Name() | ast.Attribute() as function, args=args):
                name = function.id if isinstance(function, ast.Name) else function.attr
                if name in OPPOSITE:
                    last = place(function, True)
                    yield last - len(name), last, OPPOSITE[name]
                plain = all(isinstance(arg, ast.Name | ast.Attribute) for arg in args[:2])
                if len(args) >= 2 and name not in SYMMETRIC and plain:
                    (first, _, left), (_, last, right) = whole(args[0]), whole(args[1])
                    between = text(place(args[0], True), place(args[1]))
                    yield first, last, right + between + left

    def nodes(node: ast.AST) -> Iterator[ast.AST]:
        """All that is computed: no messages, annotations or decorators."""
        for name, value in ast.iter_fields(node):
            if name in {"annotation", "returns", "decorator_list", "type_params"}:
                continue
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.AST) and not isinstance(child, NOT_LOOKED_INTO):
                    yield child
                    yield from nodes(child)

    return [
        Fault(1 + source[:start].count(b"\n"), start, end, text(start, end), new)
        for node in nodes(ast.parse(source))
        if hasattr(node, "lineno")
        for start, end, new in of_node(node)
    ]
