"""What the compiler is told of the records that a unit is given: that none is part of another."""

import ast
from pathlib import Path

import slipgrasp.core.kernel

FOLDER = Path(slipgrasp.core.kernel.__file__).parent
# They copy the part they are given, and write elsewhere.
ONLY_READ = {"evaluate_at", "emit_as_of"}


def functions(tree):
    return [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]


def is_unit(function):
    decorators = (d.func for d in function.decorator_list if isinstance(d, ast.Call))
    return any(isinstance(d, ast.Name) and d.id == "compiled_apart" for d in decorators)


def path_of(node, names):
    """A record as a path such as run.step.start; None for anything else."""
    if isinstance(node, ast.Name):
        return names.get(node.id, node.id)
    if not isinstance(node, ast.Attribute | ast.Subscript):
        return None
    owner = path_of(node.value, names)
    if owner is None or isinstance(node, ast.Subscript):
        return owner and f"{owner}.[{ast.unparse(node.slice)}]"
    return f"{owner}.{node.attr}"


def names_in(function):
    """Local names of records, by the paths that they are given."""
    names = {}
    for node in ast.walk(function):
        if not isinstance(node, ast.Assign) or len(node.targets) > 1:
            continue
        target, value = node.targets[0], node.value
        many = isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple)
        pairs = zip(target.elts, value.elts, strict=True) if many else [(target, value)]
        for name, source in pairs:
            if isinstance(name, ast.Name) and isinstance(source, ast.Attribute | ast.Subscript):
                names[name.id] = path_of(source, names)
    return names


def overlapping(tree, units):
    """Units that are called with a record and a part of it, once per call."""
    for function in functions(tree):
        names = names_in(function)
        for call in ast.walk(function):
            if not isinstance(call, ast.Call) or getattr(call.func, "id", None) not in units:
                continue
            records = units[call.func.id]
            paths = [path_of(call.args[k], names) for k in records if k < len(call.args)]
            if any(
                a is not b and b is not None and a is not None and f"{b}.".startswith(f"{a}.")
                for a in paths
                for b in paths
            ):
                yield call.func.id


def records_of(function):
    """Places of the arguments that are records."""
    return [k for k, a in enumerate(function.args.args) if ast.unparse(a.annotation) == "Record"]


def test_no_unit_is_given_a_record_and_a_part_of_it_except_to_read():
    trees = [ast.parse(file.read_text(encoding="utf-8")) for file in FOLDER.rglob("*.py")]
    units = {f.name: records_of(f) for tree in trees for f in functions(tree) if is_unit(f)}
    assert len(units) > 80
    assert {name for tree in trees for name in overlapping(tree, units)} == ONLY_READ


def test_a_part_is_found_under_another_name():
    tree = ast.parse("def f(run):\n    now, work = run.now, run.work\n    flow(run, work, now)\n")
    assert list(overlapping(tree, {"flow": [0, 1]})) == ["flow"]
    assert not list(overlapping(tree, {"flow": [0]}))
