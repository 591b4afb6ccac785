"""Folds the constants of all modules of a board into one another, as mpy-cross does within one.

`from firmware.interrupts import LINKED` costs a board the name, its place in two dictionaries and
the code that puts it there. Here the number takes the place of the name, and what only CPython
needs goes too. Every line keeps its number, so that tracebacks stay right.
"""

from __future__ import annotations

import ast
import copy
import functools
import operator
from collections.abc import Callable
from dataclasses import dataclass, field

from ghst_tools.errors import GhstError

PUBLIC = ("ghst.protocol", "firmware.vtx")
"""Modules that keep their constants, for the REPL and /user.py."""

_HOST = "ghst._host"
# For the compiler alone, which knows them without being told.
_DECORATORS = tuple(f"micropython.{emitter}" for emitter in ("native", "viper", "asm_thumb"))
_COMPILER = ("micropython", "const")

# A small integer of a 32-bit port. What is larger is an object, and stays where it is.
_SMALLEST, _LARGEST = -(1 << 30), (1 << 30) - 1

_OPERATORS: dict[type[ast.AST], Callable[..., int]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.FloorDiv: operator.floordiv,
    ast.LShift: operator.lshift,
    ast.RShift: operator.rshift,
    ast.BitOr: operator.or_,
    ast.BitAnd: operator.and_,
    ast.BitXor: operator.xor,
    ast.USub: operator.neg,
    ast.Invert: operator.invert,
}


@dataclass
class _Module:
    name: str
    text: str
    tree: ast.Module
    constants: dict[str, int] = field(default_factory=dict)
    """Those of this module and those that it imports, by their names here."""
    modules: dict[str, _Module] = field(default_factory=dict)
    """Other modules of the board, by their names here."""
    resolved: bool = False

    @functools.cached_property
    def bound(self) -> dict[str, list[int]]:
        """In which lines a name is given a meaning, but by an import or a definition."""
        lines: dict[str, list[int]] = {}
        for node in ast.walk(self.tree):
            match node:
                case ast.Name(id=name, ctx=ast.Store() | ast.Del()) | ast.arg(arg=name):
                    lines.setdefault(name, []).append(node.lineno)
        return lines


def fold(sources: dict[str, str]) -> dict[str, str]:
    """Fold the modules of a board: dotted name -> source, both ways.

    A constant is what stands as `NAME = const(...)` at the top of a module and is a small integer.
    `GhstError` names the place where such a name is something else as well. A module that is no
    Python comes back as it is: the compiler explains it better.
    """
    modules = {}
    for name, text in sources.items():
        try:
            modules[name] = _Module(name, text, ast.parse(text))
        except SyntaxError:
            continue
    for module in modules.values():
        _resolve(module, modules)
    return sources | {name: _Folding(module).text() for name, module in modules.items()}


def _resolve(module: _Module, modules: dict[str, _Module]) -> None:
    """Find the constants of a module, after those of the modules that it imports."""
    if module.resolved:
        return
    module.resolved = True
    for node in ast.walk(module.tree):
        if not isinstance(node, ast.ImportFrom):
            continue
        for alias in node.names:
            local = alias.asname or alias.name
            if other := modules.get(f"{node.module}.{alias.name}"):
                _resolve(other, modules)
                module.modules[local] = other
            elif other := modules.get(node.module or ""):
                _resolve(other, modules)
                if alias.name in other.constants:
                    module.constants[local] = other.constants[alias.name]
                    _check_single(module, local)
    for statement in module.tree.body:
        if definition := _definition(statement):
            name, expression = definition
            value = _value(expression, module)
            if value is not None and _SMALLEST <= value <= _LARGEST:
                module.constants[name] = value
                _check_single(module, name, statement.lineno)


def _definition(statement: ast.stmt) -> tuple[str, ast.expr] | None:
    """Name and expression of `NAME = const(expression)`; None of any other statement."""
    match statement:
        case ast.Assign(
            targets=[ast.Name(id=name)],
            value=ast.Call(func=ast.Name(id="const"), args=[expression]),
        ):
            return name, expression
    return None


def _check_single(module: _Module, name: str, lineno: int = 0) -> None:
    """`GhstError` if `name` is given a meaning in another line than `lineno`, and no import."""
    for line in module.bound.get(name, ()):
        if line != lineno:
            raise GhstError(
                f"{module.name}:{line}: {name} is a constant, or a module with "
                "constants: choose another name"
            )


def _value(node: ast.expr, module: _Module) -> int | None:
    """The value of a constant expression; None of any other."""
    match node:
        case ast.Constant(value=bool()):
            return None
        case ast.Constant(value=int(value)):
            return value
        case ast.Name(id=name):
            return module.constants.get(name)
        case ast.Attribute(value=ast.Name(id=name), attr=attribute) if name in module.modules:
            return module.modules[name].constants.get(attribute)
        case ast.UnaryOp(op=sign, operand=operand):
            parts = [_value(operand, module)]
        case ast.BinOp(left=left, op=sign, right=right):
            parts = [_value(left, module), _value(right, module)]
        case _:
            return None
    if None in parts or type(sign) not in _OPERATORS:
        return None
    return _OPERATORS[type(sign)](*parts)


class _Folding:
    """The new text of one module: the old one with pieces replaced, line by line."""

    def __init__(self, module: _Module) -> None:
        self._module = module
        self._pieces: list[tuple[ast.stmt | ast.expr, str]] = []
        self._needed: set[str] = set()
        # Until Python 3.12 nobody tells where in an f-string a name stands: such names stay.
        self._in_texts = {
            name.id
            for text in ast.walk(module.tree)
            if isinstance(text, ast.JoinedStr)
            for name in ast.walk(text)
            if isinstance(name, ast.Name)
        }

    def text(self) -> str:
        """The folded source."""
        self._constants(self._module.tree)
        self._imports(self._module.tree)
        return self._apply()

    def _constants(self, node: ast.AST) -> None:
        """Drop the constants that are defined in `node`, replace those that are read there."""
        match node:
            case ast.JoinedStr():
                return
            case ast.Assign() if definition := _definition(node):
                name, expression = definition
                if self._may_go(name):
                    self._pieces.append((node, ""))
                else:
                    self._constants(expression)
                return
            case ast.Name(id=name, ctx=ast.Load()) | ast.Attribute(value=ast.Name(id=name)):
                value = _value(node, self._module)
                if value is None:
                    self._needed.add(name)
                    return
                if name in self._module.modules:
                    _check_single(self._module, name)
                self._pieces.append((node, str(value) if value >= 0 else f"({value})"))
                return
            case ast.FunctionDef():
                node = copy.copy(node)
                node.decorator_list = [
                    decorator
                    for decorator in node.decorator_list
                    if ast.unparse(decorator) not in _DECORATORS
                ]
        for child in ast.iter_child_nodes(node):
            self._constants(child)

    def _may_go(self, name: str) -> bool:
        # mpy-cross drops the private ones.
        return not (
            name.startswith("_")
            or name not in self._module.constants
            or self._module.name in PUBLIC
            or name in self._in_texts
        )

    def _imports(self, node: ast.AST) -> None:
        """Drop what nothing needs any more of the imports in `node`."""
        for statement in ast.iter_child_nodes(node):
            match statement:
                case ast.Try(
                    body=imports, handlers=[ast.ExceptHandler(body=[ast.ImportFrom(module=other)])]
                ) if other == _HOST:
                    parts = [self._import(each) for each in imports]
                    self._pieces.append((statement, "; ".join(filter(None, parts)) or "pass"))
                case ast.Import() | ast.ImportFrom():
                    kept = self._import(statement)
                    if kept != ast.unparse(statement):
                        self._pieces.append((statement, kept or "pass"))
                case _:
                    self._imports(statement)

    def _import(self, statement: ast.stmt) -> str:
        """What is left of an import."""
        assert isinstance(statement, (ast.Import, ast.ImportFrom))
        parts = []
        kept = []
        for alias in statement.names:
            name = alias.asname or alias.name
            if isinstance(statement, ast.ImportFrom) and name in self._module.constants:
                if name in self._in_texts:
                    parts.append(f"{name} = const({self._module.constants[name]})")
            elif name in self._needed | self._in_texts or name not in (
                *self._module.modules,
                *_COMPILER,
            ):
                kept.append(alias)
        if kept:
            rest = copy.copy(statement)
            rest.names = kept
            parts.append(ast.unparse(rest))
        return "; ".join(parts)

    def _apply(self) -> str:
        lines = [line.encode() for line in self._module.text.splitlines()]
        # From the end to the beginning, so that the places of what is left to do stay right.
        self._pieces.sort(key=lambda piece: (piece[0].lineno, piece[0].col_offset))
        for node, text in reversed(self._pieces):
            assert node.end_lineno is not None and node.end_col_offset is not None
            first, last = node.lineno - 1, node.end_lineno - 1
            before, after = lines[first][: node.col_offset], lines[last][node.end_col_offset :]
            lines[first : last + 1] = [before + text.encode() + after] + [b""] * (last - first)
        return b"\n".join(lines).decode() + "\n"
