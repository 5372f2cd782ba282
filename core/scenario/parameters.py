"""Definition of a parameter: unit, bounds and a sentence, stated once, in its annotation.

The annotation of a scenario field is the only definition. Validation, API schema,
sliders, command-line help and recording header are all derived from it.
"""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache, partial
from typing import Any, Literal, cast

from annotated_types import Interval

from slipgrasp.core.scenario.custom_laws import law_parameters
from slipgrasp.core.scenario.space import SPACES, Space

ParameterValue = float | int | bool | str | tuple[float, ...] | None
ParameterKind = Literal["number", "integer", "boolean", "choice", "text", "number-or-list"]


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Quantity:
    """Metadata of one scenario field.

    Attributes:
        text: One sentence for the user.
        unit: SI unit, "1" for pure numbers, "" if a unit makes no sense.
        typical: Range in which a slider moves; the bounds are wider.
        changeable: Whether a timed change may set it during a run.
        used_by: Kinds of its part that use it, such as control laws; all of them if empty.
        choices: Returns the allowed words if they are not known statically.
        hands: The kinds of hands whose kernel uses it; for others it keeps its default.
    """

    text: str
    unit: str = ""
    typical: tuple[float, float] | None = None
    changeable: bool = False
    used_by: tuple[str, ...] = ()
    choices: Callable[[], tuple[str, ...]] | None = None
    hands: tuple[Space, ...] = SPACES

    @property
    def sentence(self) -> str:
        """The sentence, preceded by the kinds that use the parameter."""
        return f"{', '.join(self.used_by)}: {self.text}" if self.used_by else self.text


changeable = partial(Quantity, changeable=True)


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """One editable parameter of a scenario, ready for a schema, a slider or a help text.

    Attributes:
        key: Dotted key such as ``fingers.0.link_masses.1``.
        value: Value in the described scenario.
        kind: ``number``, ``integer``, ``boolean``, ``choice``, ``text`` or ``number-or-list``.
        unit: SI unit.
        text: One sentence for the user.
        minimum: Smallest allowed value, if any.
        maximum: Largest allowed value, if any.
        exclusive_minimum: Whether ``minimum`` itself is excluded.
        typical: Range in which a slider moves.
        choices: Allowed words of a choice.
        optional: Whether it may be omitted.
        changeable: Whether a timed change may set it during a run.
        used_by: Kinds of its part that use it; all of them if empty.
    """

    key: str
    value: ParameterValue
    kind: ParameterKind
    unit: str
    text: str
    minimum: float | None = None
    maximum: float | None = None
    exclusive_minimum: bool = False
    typical: tuple[float, float] | None = None
    choices: tuple[str, ...] = ()
    optional: bool = False
    changeable: bool = False
    used_by: tuple[str, ...] = ()

    @property
    def limit(self) -> str:
        """The allowed values in words, such as ``0.001 … 1000 kg``."""
        if self.choices:
            return "one of " + ", ".join(self.choices)
        if self.kind == "boolean":
            return "true or false"
        unit = "" if self.unit in ("", "1") else f" {self.unit}"
        low, high = self.minimum, self.maximum
        if low is not None and high is not None:
            above = "above " if self.exclusive_minimum else ""
            return f"{above}{low:g} … {high:g}{unit}"
        if low is not None:
            return f"{'above' if self.exclusive_minimum else 'at least'} {low:g}{unit}"
        if high is not None:
            return f"at most {high:g}{unit}"
        return "text" if self.kind == "text" else f"a finite number{unit}"


def iterate_parameters(node: Any, prefix: str = "") -> Iterator[Parameter]:
    """Yields every parameter below a scenario, in the order of its fields.

    Args:
        node: A scenario or a part of one (a dataclass instance).
        prefix: Dotted key of ``node``.
    """
    for field in dataclasses.fields(node):
        yield from _describe_field(node, field.name, prefix)


def iterate_lists(node: Any, prefix: str = "") -> Iterator[Parameter]:
    """Yields every list of variable length that is described by one quantity, such as a table.

    Args:
        node: A scenario or a part of one (a dataclass instance).
        prefix: Dotted key of ``node``.
    """
    for name, hint in hints_of(type(node)).items():
        key, value = f"{prefix}{name}", getattr(node, name)
        quantity, _, base = split_hint(hint)
        if dataclasses.is_dataclass(value):
            yield from iterate_lists(value, f"{key}.")
        elif quantity is not None and is_tuple(base) and Ellipsis in typing.get_args(base):
            yield Parameter(
                key=key,
                value=None,
                kind="text",
                unit=quantity.unit,
                text=quantity.sentence,
                used_by=quantity.used_by,
            )


def kinds_using(part: type, name: str) -> tuple[str, ...]:
    """The kinds of a part of a scenario that use one of its parameters; empty if all do.

    Args:
        part: Class of the part.
        name: Field of the parameter.
    """
    quantity, _, _ = split_hint(hints_of(part)[name])
    return () if quantity is None else quantity.used_by


def values_not_for(node: Any, hand: Space, prefix: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Key, value and default of every unused parameter that differs from its default.

    Args:
        node: A scenario or a part of one (a dataclass instance).
        hand: Kind of hand whose kernel does not use it.
        prefix: Dotted key of ``node``.
    """
    kept, inner = _kept_for(type(node), hand)
    for name, default in kept:
        value = getattr(node, name)
        if value != default:
            yield f"{prefix}{name}", value, default
    for name in inner:
        value = getattr(node, name)
        if isinstance(value, tuple):
            for i, part in enumerate(value):
                yield from values_not_for(part, hand, f"{prefix}{name}.{i}.")
        else:
            yield from values_not_for(value, hand, f"{prefix}{name}.")


@cache
def _kept_for(part: type, hand: Space) -> tuple[tuple[tuple[str, Any], ...], tuple[str, ...]]:
    """Fields that a kernel does not use, with defaults, and fields whose parts have such fields."""
    kept, inner = [], []
    for field in dataclasses.fields(part):
        quantity, _, base = split_hint(hints_of(part)[field.name])
        if quantity is not None and hand not in quantity.hands:
            kept.append((field.name, field.default))
        if any(any(_kept_for(kind, hand)) for kind in _parts_of(base)):
            inner.append(field.name)
    return tuple(kept), tuple(inner)


def _parts_of(base: Any) -> list[type]:
    """The dataclasses in a type, a tuple type or a union."""
    if isinstance(base, type) and dataclasses.is_dataclass(base):
        return [base]
    return [part for inner in typing.get_args(base) for part in _parts_of(inner)]


@cache
def hints_of(kind: type) -> dict[str, Any]:
    """Annotations of a dataclass, cached because resolving them dominates the run time."""
    return typing.get_type_hints(kind, include_extras=True)


def describe(scenario: Any) -> dict[str, Parameter]:
    """Returns the parameters of a scenario by dotted key."""
    return {parameter.key: parameter for parameter in iterate_parameters(scenario)}


def find_parameter(scenario: Any, key: str) -> Parameter | None:
    """The parameter with a dotted key; None if there is none.

    Describes only the field that contains it, a small fraction of `describe`.
    """
    node, prefix = scenario, ""
    for name in key.split("."):
        part = _part_of(node, name)
        if part is None:
            break
        node, prefix = part, f"{prefix}{name}."
    name = key.removeprefix(prefix).partition(".")[0]
    known = not isinstance(node, tuple) and name in hints_of(type(node))
    found = _describe_field(node, name, prefix) if known else ()
    return next((parameter for parameter in found if parameter.key == key), None)


def _part_of(node: Any, name: str) -> Any:
    """A part of a scenario, or a tuple of parts, below another by name or index; None if none."""
    if isinstance(node, tuple):
        value = node[int(name)] if name in map(str, range(len(node))) else None
    else:
        value = getattr(node, name) if name in hints_of(type(node)) else None
    first = value[0] if isinstance(value, tuple) and value else value
    return value if dataclasses.is_dataclass(first) else None


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class ParameterDifference:
    """A parameter that differs between two scenarios.

    Attributes:
        key: Its dotted key.
        a: Value in the first run, None if absent.
        b: Value in the second run, None if absent.
        unit: SI unit.
    """

    key: str
    a: ParameterValue
    b: ParameterValue
    unit: str


def parameter_differences(a: Any, b: Any) -> Iterator[ParameterDifference]:
    """The parameters of two scenarios that differ, in the order of the fields."""
    mine, others = describe(a), describe(b)
    for key in dict.fromkeys((*mine, *others)):
        values = [known[key].value if key in known else None for known in (mine, others)]
        if values[0] != values[1]:
            unit = (mine.get(key) or others[key]).unit
            yield ParameterDifference(key=key, a=values[0], b=values[1], unit=unit)


def _describe_law_parameters(
    key: str, kind: str, values: Mapping[str, float]
) -> Iterator[Parameter]:
    """Parameters of a custom law: as declared, or without a definition if the law is not loaded."""
    declared = law_parameters(kind)
    for name, parameter in declared.items():
        yield Parameter(
            key=f"{key}.{name}",
            value=values.get(name, parameter.value),
            kind="number",
            unit=parameter.unit,
            text=f"{kind}: {parameter.text}",
            minimum=parameter.minimum,
            maximum=parameter.maximum,
            typical=parameter.typical or (parameter.minimum, parameter.maximum),
            changeable=True,
            used_by=(kind,),
        )
    for name in (name for name in values if name not in declared):
        text = f"A parameter of the law '{kind}', which is not loaded."
        yield Parameter(key=f"{key}.{name}", value=values[name], kind="number", unit="", text=text)


def _describe_field(node: Any, name: str, prefix: str) -> Iterator[Parameter]:
    value = getattr(node, name)
    if isinstance(value, Mapping):
        yield from _describe_law_parameters(f"{prefix}{name}", node.kind, value)
    else:
        yield from _describe_value(f"{prefix}{name}", hints_of(type(node))[name], value)


def _describe_value(key: str, hint: Any, value: Any) -> Iterator[Parameter]:
    if dataclasses.is_dataclass(value):
        yield from iterate_parameters(value, f"{key}.")
        return
    quantity, bounds, base = split_hint(hint)
    if isinstance(value, tuple) and is_tuple(base):
        for i, item in enumerate(value):
            yield from _describe_item(f"{key}.{i}", item, quantity, base, i)
        return
    if quantity is not None:
        yield _parameter(key, base, value, quantity, bounds)


def _describe_item(
    key: str, item: Any, quantity: Quantity | None, base: Any, index: int
) -> Iterator[Parameter]:
    if dataclasses.is_dataclass(item):
        yield from iterate_parameters(item, f"{key}.")
        return
    arguments = [a for a in typing.get_args(base) if a is not Ellipsis]
    own, bounds, item_base = split_hint(arguments[min(index, len(arguments) - 1)])
    chosen = own or quantity
    if chosen is not None:
        quantity = _quantity_of_item(chosen, len(arguments), index)
        if isinstance(item, tuple) and is_tuple(item_base):
            for i, part in enumerate(item):
                yield from _describe_item(f"{key}.{i}", part, quantity, item_base, i)
        else:
            yield _parameter(key, item_base, item, quantity, bounds)


@cache
def _quantity_of_item(quantity: Quantity, count: int, index: int) -> Quantity:
    """The quantity of one of ``count`` items, which may have individual units."""
    units = quantity.unit.split(", ")
    unit = units[index] if index < len(units) == count else quantity.unit
    return dataclasses.replace(quantity, unit=unit)


@cache
def split_hint(hint: Any) -> tuple[Quantity | None, tuple[Any, ...], Any]:
    """Splits an annotation into its quantity, if any, other metadata, and the type."""
    if typing.get_origin(hint) is typing.Annotated:
        base, *extras = typing.get_args(hint)
        quantity = next((e for e in extras if isinstance(e, Quantity)), None)
        return quantity, tuple(extras), base
    return None, (), hint


def is_tuple(base: Any) -> bool:
    """Whether a type is a tuple type."""
    return typing.get_origin(base) is tuple


def _parameter(
    key: str, base: Any, value: Any, quantity: Quantity, extras: tuple[Any, ...]
) -> Parameter:
    facts = _facts_of(base, quantity, extras)
    if quantity.choices:
        facts = {**facts, "choices": quantity.choices()}
    return Parameter(key=key, value=value, **facts)


@cache
def _facts_of(base: Any, quantity: Quantity, extras: tuple[Any, ...]) -> dict[str, Any]:
    """The part of a parameter that is the same in every scenario."""
    alternatives = alternatives_of(base)
    kinds = [a for a in alternatives if a is not type(None)]
    low, high, exclusive = _bounds(extras, kinds)
    return {
        "kind": "choice" if quantity.choices else _kind(kinds),
        "unit": quantity.unit,
        "text": quantity.sentence,
        "minimum": low,
        "maximum": high,
        "exclusive_minimum": exclusive,
        "typical": quantity.typical,
        "choices": _words_of(kinds),
        "optional": type(None) in alternatives,
        "changeable": quantity.changeable,
        "used_by": quantity.used_by,
    }


def _words_of(kinds: list[Any]) -> tuple[str, ...]:
    """The statically known words of a choice."""
    return tuple(c for k in kinds if typing.get_origin(k) is Literal for c in typing.get_args(k))


def alternatives_of(base: Any) -> tuple[Any, ...]:
    """The members of a union type."""
    if isinstance(base, types.UnionType) or typing.get_origin(base) is typing.Union:
        return typing.get_args(base)
    return (base,)


def _kind(kinds: list[Any]) -> ParameterKind:
    bases = [split_hint(k)[2] for k in kinds]
    if any(typing.get_origin(b) is Literal for b in bases):
        return "choice"
    if any(is_tuple(b) for b in bases):
        return "number-or-list"
    if bool in bases:
        return "boolean"
    if int in bases and float not in bases:
        return "integer"
    return "number" if float in bases else "text"


def _bounds(extras: Sequence[Any], kinds: list[Any]) -> tuple[float | None, float | None, bool]:
    metadata = [*extras, *(e for k in kinds for e in split_hint(k)[1])]
    found = next((e for e in metadata if isinstance(e, Interval)), None)
    if found is None:
        return None, None, False
    low = found.ge if found.gt is None else found.gt
    return float(cast(float, low)), float(cast(float, found.le)), found.gt is not None
