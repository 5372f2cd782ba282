"""A normal form of reachable code that contains only what it computes.

A function is represented by its syntax tree, without comments, docstring, annotations, decorators,
messages and its name. References are represented by value, other functions and classes by the order
of first reference, regardless of their module. Only the used fields of records and attributes of
objects are included. The form is the same for every version of Python, and for the compiled and the
interpreted kernel.
"""

from __future__ import annotations

import ast
import dataclasses
import enum
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

import numpy as np
from numba.core.types import Type

from slipgrasp.core.kernel.compilation.compiler import declared_types, function_of
from slipgrasp.core.kernel.compilation.references import code_lines, names_known_to, plain

_FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)
_COMPREHENSIONS = (ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)
# Parts of nodes: text, types, and version-dependent attributes.
_LEFT_OUT = frozenset(("ctx", "kind", "msg", "type_comment", "type_params"))
_MAX_PARSES = 100
_PLAIN = (bool, int, float, complex, str, bytes, type(None), type(...))


class NormalForm:
    """Code that is reachable from some functions, classes and values.

    Args:
        roots: Starting points; for classes all methods, otherwise only the used ones.
        ends: Functions and classes that are not expanded.
        package: Package whose code is expanded.

    Attributes:
        lines: The form.
        names: All used names of attributes and fields, and texts.
        reached: Functions and classes, in the order of first reference.
    """

    def __init__(
        self, roots: Iterable[Any], ends: Iterable[Any] = (), package: str = "slipgrasp"
    ) -> None:
        self.names: set[str] = set()
        self.reached: list[Any] = []
        self._ends = {_code_of(end): place for place, end in enumerate(ends)}
        self._package = package
        self._numbers: dict[Any, int] = {}
        self._layouts: dict[np.dtype, int] = {}
        self._num_parted = 0
        # Parts that are included when they are used: position, name and value.
        self._parts: list[tuple[str, str, Any]] = []
        self.lines: list[str] = []
        for root in roots:
            self.names |= set(vars(root)) if isinstance(root, type) else set()
            self.lines.append(self.value(root))
        self._describe_all()

    def value(self, value: Any) -> str:
        """A value that the code refers to."""
        value = _code_of(value)
        if isinstance(value, FunctionType | type):
            return self._reference(value)
        if isinstance(value, enum.Enum):
            return f"{type(value).__name__} {value.value!r}"
        if isinstance(value, _PLAIN):
            if isinstance(value, str):
                self.names.add(value)
            return repr(value)
        if isinstance(value, Mapping):
            value = tuple(value.items())
        if isinstance(value, tuple | list):
            return f"({', '.join(map(self.value, value))})"
        if isinstance(value, set | frozenset):
            return f"{{{', '.join(sorted(map(self.value, value)))}}}"
        if parts := _parts_of(value):
            return self._parted(value, parts)
        if isinstance(value, np.ndarray):
            content = value.astype(value.dtype.newbyteorder("<")).tobytes().hex()
            return f"{value.dtype} {value.shape} {content}"
        if isinstance(value, np.generic | np.dtype | Type):
            return f"{type(value).__name__} {value}"
        # Code of another package is not part of the kernel.
        return str(getattr(value, "__name__", type(value).__qualname__))

    def _reference(self, code: Any) -> str:
        if code in self._ends:
            return f"end {self._ends[code]}"
        if code.__module__.partition(".")[0] != self._package:
            return str(code.__qualname__)
        if code not in self._numbers:
            self._numbers[code] = len(self.reached)
            self.reached.append(code)
        return f"code {self._numbers[code]}"

    def _parted(self, value: Any, parts: Mapping[str, Any]) -> str:
        """A value that is represented by its used parts; a layout only once."""
        known = self._layouts.get(value) if isinstance(value, np.dtype) else None
        if known is not None:
            return f"parted {known}"
        place = self._num_parted
        self._num_parted += 1
        if isinstance(value, np.dtype):
            self._layouts[value] = place
        shape = getattr(value, "shape", ())
        self._parts += [(f"parted {place}", name, part) for name, part in sorted(parts.items())]
        return f"parted {place} {shape}"

    def _describe_all(self) -> None:
        """Describes reachable code, and its parts after their use is known."""
        described = 0
        while True:
            while described < len(self.reached):
                self.lines.append(self._describe(self.reached[described], described))
                described += 1
            named = [part for part in self._parts if part[1] in self.names]
            if not named:
                return
            self._parts = [part for part in self._parts if part[1] not in self.names]
            self.lines += [f"{place} {name} {self.value(value)}" for place, name, value in named]

    def _describe(self, code: Any, number: int) -> str:
        if isinstance(code, type):
            bases = ", ".join(map(self.value, code.__bases__))
            fields = getattr(code, "_fields", None) or getattr(code, "__dataclass_fields__", ())
            # Code that Python or a library generates, such as methods of dataclasses, has no tree.
            members = {name: _code_of(each) for name, each in sorted(vars(code).items())}
            written = {name: each for name, each in members.items() if tree_of(each)}
            self._parts += [(f"code {number}", name, each) for name, each in written.items()]
            return f"class {bases} {tuple(fields)} {self.value(written.get('__init__'))}"
        defaults = self.value((code.__defaults__, code.__kwdefaults__))
        declared = self.value(declared_types(code))
        tree = tree_of(code)
        if tree is None:
            body = "\n".join(code_lines(code.__code__, documented=code.__doc__ is not None))
        else:
            body = _Writer(self, code).node(tree, frozenset())
        return f"{body} {defaults} {declared}"


def _parts_of(value: Any) -> dict[str, Any]:
    """Named parts of a layout, or of an instance of a dataclass."""
    if isinstance(value, np.dtype):
        return {name: value.base[name] for name in value.base.names or ()}
    if isinstance(value, np.ndarray | np.void):
        return {name: value[name] for name in value.dtype.names or ()}
    if dataclasses.is_dataclass(value):
        return {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    return {}


def _code_of(value: Any) -> Any:
    """The Python function of a value, if any; otherwise the value."""
    return plain(function_of(value))


class _Writer:
    """Writes the syntax tree of a function."""

    def __init__(self, form: NormalForm, function: FunctionType) -> None:
        self._form = form
        self._known = names_known_to(function)

    def node(self, node: Any, bound: frozenset[str]) -> str:
        """Writes a node of the tree, within functions with some bound names."""
        if isinstance(node, list):
            return f"[{', '.join(self.node(each, bound) for each in node if not _is_word(each))}]"
        if not isinstance(node, ast.AST):
            return repr(node)
        outside = self._outside(node, bound)
        if outside is not None:
            return self._form.value(outside[0])
        if isinstance(node, ast.Constant):
            return self._form.value(node.value)
        if isinstance(node, ast.Raise):
            return "Raise"  # messages are for people
        if isinstance(node, ast.Attribute):
            self._form.names.add(node.attr)
        if isinstance(node, _FUNCTIONS):
            return self._function(node, bound)
        if isinstance(node, _COMPREHENSIONS):
            bound = bound | set(_stored_in(node.generators))
        if isinstance(node, ast.AnnAssign):
            node = ast.Assign(targets=[node.target], value=node.value)
        # Versions of Python differ in the empty fields of nodes.
        fields = ((name, each) for name, each in ast.iter_fields(node) if each not in (None, []))
        texts = (f"{k}={self.node(each, bound)}" for k, each in fields if k not in _LEFT_OUT)
        return f"{type(node).__name__}({', '.join(texts)})"

    def _function(self, node: Any, bound: frozenset[str]) -> str:
        arguments = node.args
        every = (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs)
        others = [each.arg for each in (arguments.vararg, arguments.kwarg) if each is not None]
        names = [each.arg for each in every]
        body = node.body if isinstance(node.body, list) else [node.body]
        bound = bound | {*names, *others, *_stored_in(body)}
        counts = len(arguments.posonlyargs), len(arguments.args)
        return f"function {counts} {names} {others} {self.node(body, bound)}"

    def _outside(self, node: ast.AST, bound: frozenset[str]) -> tuple[Any] | None:
        """The value of a global name, or of an attribute of a module."""
        if isinstance(node, ast.Name) and node.id not in bound:
            return (self._known[node.id],) if node.id in self._known else None
        if isinstance(node, ast.Attribute):
            module = self._outside(node.value, bound)
            if module is not None and isinstance(module[0], ModuleType):
                return (getattr(module[0], node.attr),)
        return None


def _is_word(node: Any) -> bool:
    """Whether a statement is only text, such as a docstring, or only an annotation."""
    if isinstance(node, ast.AnnAssign):
        return node.value is None
    is_text = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    return is_text and isinstance(node.value.value, str)


def _stored_in(nodes: Iterable[ast.AST]) -> Iterator[str]:
    """Names that statements bind, excluding nested functions."""
    for node in nodes:
        if isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load):
            yield node.id
        elif isinstance(node, ast.FunctionDef | ast.ExceptHandler | ast.MatchAs) and node.name:
            yield node.name
        elif isinstance(node, ast.alias):
            yield node.asname or node.name.partition(".")[0]
        if not isinstance(node, (*_FUNCTIONS, *_COMPREHENSIONS)):
            yield from _stored_in(ast.iter_child_nodes(node))


def tree_of(function: Any) -> ast.AST | None:
    """The tree of a function; None if its source is missing or has changed."""
    if not isinstance(function, FunctionType):
        return None
    code = function.__code__
    found = _trees_in(code.co_filename).get(code.co_qualname, ())
    same = [tree for line, tree in found if line == code.co_firstlineno]
    return same[0] if same else found[0][1] if len(found) == 1 else None


@cache
def _trees_in(path: str) -> Mapping[str, list[tuple[int, ast.AST]]]:
    """Functions of a file by qualified name, with their first lines."""
    try:
        module = _parse(Path(path).read_bytes())
    except (OSError, SyntaxError, ValueError):
        return {}
    found: dict[str, list[tuple[int, ast.AST]]] = {}
    for name, node in _functions_in(module, ""):
        decorators = getattr(node, "decorator_list", [])
        line = min([node.lineno, *(each.lineno for each in decorators)])
        found.setdefault(name, []).append((line, node))
    return found


def _parse(code: bytes) -> ast.Module:
    """Parses code, again if Python 3.11 failed because another thread parsed at the same time."""
    for _ in range(_MAX_PARSES - 1):
        try:
            return ast.parse(code)
        except SystemError:
            continue
    return ast.parse(code)


def _functions_in(node: ast.AST, prefix: str) -> Iterator[tuple[str, Any]]:
    for child in ast.iter_child_nodes(node):
        inner = prefix
        if isinstance(child, (*_FUNCTIONS, ast.ClassDef)):
            name = f"{prefix}{getattr(child, 'name', '<lambda>')}"
            inner = f"{name}." if isinstance(child, ast.ClassDef) else f"{name}.<locals>."
            if isinstance(child, _FUNCTIONS):
                yield name, child
        yield from _functions_in(child, inner)
