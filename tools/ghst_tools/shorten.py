"""Gives private names short ones, which many modules of a board share.

MicroPython keeps each name that a loaded module uses for good. Names that begin with an underscore
and parameters of functions so named are nobody else's business, so every module can have `_a`,
`_b` and so on. Public names stay, and every line keeps its number: a traceback names the right
file and line, but may call a private function by its short name.
"""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

KEPT = ("_machine", "_msp_read", "_pwm", "_unit", "_words")
"""Private names that stay: of MicroPython itself, and those that tests look at."""

_PRIVATE = re.compile(r"_[A-Za-z][A-Za-z0-9_]*\Z")
_WORD = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_LETTERS = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"


@dataclass
class _Module:
    text: str
    tree: ast.Module
    tokens: list[tokenize.TokenInfo]
    group: set[str]
    """The modules that share their private names: those with classes that inherit from theirs."""
    defined: set[str] = field(default_factory=set)
    used: Counter[str] = field(default_factory=Counter)


def shorten(sources: dict[str, str]) -> dict[str, str]:
    """Shorten the names of all modules of a board: dotted name -> source, both ways.

    A name that stands in a text somewhere stays, since it may be looked up by it; so does one that
    a module uses which does not define it. A module that is no Python comes back as it is.
    """
    modules = {}
    for name, text in sources.items():
        try:
            tree = ast.parse(text)
        except SyntaxError:
            continue
        tokens = list(tokenize.generate_tokens(io.StringIO(text).readline))
        modules[name] = _Module(text, tree, tokens, {name})
    _join_heirs(modules)
    kept = set(KEPT)
    for module in modules.values():
        _collect(module)
        kept |= _words_in_texts(module.tree)
    for module in modules.values():
        defined = set().union(*(modules[name].defined for name in module.group))
        kept |= {name for name in module.used if name not in defined}
    results = dict(sources)
    for name, module in modules.items():
        used: Counter[str] = Counter()
        for other in sorted(module.group):
            used += modules[other].used
        taken = {token.string for other in module.group for token in modules[other].tokens}
        short = _short_names(taken)
        names = {old: next(short) for old, _ in used.most_common() if old not in kept}
        results[name] = _apply(module, names, list(short))
    return results


def _join_heirs(modules: dict[str, _Module]) -> None:
    """Put modules into one group if a class of one is the base of a class of the other."""
    for name, module in modules.items():
        bases = {
            base.id
            for node in ast.walk(module.tree)
            if isinstance(node, ast.ClassDef)
            for base in node.bases
            if isinstance(base, ast.Name)
        }
        for node in ast.walk(module.tree):
            if not isinstance(node, ast.ImportFrom) or node.module not in modules:
                continue
            if bases & {alias.asname or alias.name for alias in node.names}:
                group = modules[node.module].group | modules[name].group
                for member in group:
                    modules[member].group = group


def _collect(module: _Module) -> None:
    """Find the private names that a module uses, and those that it defines."""
    for token in module.tokens:
        if token.type == tokenize.NAME and _PRIVATE.match(token.string):
            module.used[token.string] += 1
    for node in ast.walk(module.tree):
        match node:
            case ast.Assign(
                targets=[ast.Name(id=name)], value=ast.Call(func=ast.Name(id="const"))
            ):
                # The compiler puts the number in its place.
                del module.used[name]
                module.defined.add(name)
            case ast.Attribute(attr=name, ctx=ast.Store()) | ast.Name(id=name, ctx=ast.Store()):
                module.defined.add(name)
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name) | ast.arg(arg=name):
                module.defined.add(name)


def _words_in_texts(tree: ast.Module) -> set[str]:
    """The words of all strings but the docstrings, and the names inside of f-strings.

    Until Python 3.12 nobody tells where in an f-string a name stands.
    """
    words: set[str] = set()
    docstrings = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)
        and node.body
        and isinstance(node.body[0], ast.Expr)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str | bytes):
            if id(node) not in docstrings:
                value = node.value
                words.update(_WORD.findall(value if isinstance(value, str) else repr(value)))
        elif isinstance(node, ast.JoinedStr):
            for child in ast.walk(node):
                match child:
                    case ast.Name(id=name) | ast.Attribute(attr=name):
                        words.add(name)
    return words


def _short_names(taken: Iterable[str]) -> Iterator[str]:
    taken = set(taken)
    for first in ("", *_LETTERS):
        for last in _LETTERS:
            name = "_" + first + last
            if name not in taken:
                yield name
        if first == "b":
            return


def _apply(module: _Module, names: dict[str, str], free: list[str]) -> str:
    lines = module.text.splitlines(keepends=True)
    changes = [
        (token.start, token.end, names[token.string])
        for token in module.tokens
        if token.type == tokenize.NAME and token.string in names
    ]
    changes += _parameters(module, free)
    for (row, start), (_, end), new in sorted(changes, reverse=True):
        line = lines[row - 1]
        lines[row - 1] = line[:start] + new + line[end:]
    return "".join(lines)


def _parameters(
    module: _Module, free: list[str]
) -> Iterator[tuple[tuple[int, int], tuple[int, int], str]]:
    """Changes of the parameters of private functions without inner ones."""
    keywords = {
        keyword.arg
        for node in ast.walk(module.tree)
        if isinstance(node, ast.Call)
        for keyword in node.keywords
    }
    for node in ast.walk(module.tree):
        if not isinstance(node, ast.FunctionDef) or not _PRIVATE.match(node.name):
            continue
        inner = [
            each
            for each in ast.walk(node)
            if isinstance(each, ast.FunctionDef | ast.Lambda | ast.ClassDef) and each is not node
        ]
        arguments = node.args
        if inner or arguments.vararg or arguments.kwarg or arguments.kwonlyargs:
            continue
        names = [arg.arg for arg in arguments.args if arg.arg != "self"]
        stay = keywords | _words_in_texts(ast.Module([node], []))
        short = {
            old: new
            for old, new in zip(names, free, strict=False)
            if old not in stay and not _PRIVATE.match(old) and len(old) > 1
        }
        assert node.end_lineno is not None
        before = ""
        for token in module.tokens:
            if node.lineno <= token.start[0] <= node.end_lineno:
                if token.type == tokenize.NAME and token.string in short and before != ".":
                    yield token.start, token.end, short[token.string]
                before = token.string
