"""Reads a Python launch file of ROS 2 as data: its syntax tree is evaluated, and nothing of it is run.

Known are constants, f-strings, lists, dictionaries, loops and comprehensions over them, functions of the
file, `os.path.join`, and the actions, substitutions and conditions of launch and launch_ros. Any other value
is unknown, with the reason. Source: github.com/ros2/launch, launch_ros (Humble to Kilted).
"""

from __future__ import annotations

import ast
import json
import operator
import posixpath
import re
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from swarmctl.ros_packages.launch_description import (
    Action,
    Computed,
    Condition,
    Load,
    NotReadError,
    Rewritten,
    Text,
    Unknown,
    Variable,
    Written,
)

_STEPS = 20_000  # expressions and statements of one file
_DEEPEST = 40  # calls and expressions within each other
_COMPUTED, _OF_THE_LAUNCH = "what it computes", "a value of the running launch"
_ITERABLE = (list, tuple, dict, range, str)
_LARGEST_NUMBER = 1 << 63
_WIDE = re.compile(r"\*|\d{3}")  # of a format
_LARGEST = 2_000  # items of a list, characters of a text
_ENTRY = "generate_launch_description"
_FOLDER = "$(dirname)"
_FILE = f"{_FOLDER}/{_ENTRY}"  # stands for the path of the file itself


class _TooMuchError(Exception):
    """The file takes more steps than the limit."""


class _Return(Exception):  # noqa: N818  (it carries a value, and is no error)
    def __init__(self, value: Any) -> None:
        super().__init__()
        self.value = value


class _Break(Exception):  # noqa: N818
    pass


class _Continue(Exception):  # noqa: N818
    pass


@dataclass(frozen=True)
class _Name:
    """What an import brings, by its last name."""

    name: str


@dataclass
class _Description:
    """A LaunchDescription, to which actions can be added."""

    actions: list[Any] = field(default_factory=list)


@dataclass(frozen=True)
class _Function:
    definition: ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda
    names: dict[str, Any]  # those around it


@dataclass(frozen=True)
class _Source:
    """The file of an IncludeLaunchDescription."""

    file: Any


@dataclass(frozen=True)
class _Opened(Unknown):
    """The text of a file, which only a reader of YAML or JSON knows."""

    file: Any = None


@dataclass(frozen=True)
class _Component:
    action: Action


def read(text: str, load: Load) -> Written:
    """Returns the actions of a launch file. Raises ``NotReadError`` for one that Python cannot read."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of escapes in a text
            tree = ast.parse(text)
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        line = error.lineno or 1 if isinstance(error, SyntaxError) else 1
        raise NotReadError(f"it is not valid Python: {getattr(error, 'msg', error)}", line) from None
    run = _Run(load)
    try:
        run.block(tree.body, run.names)
        entry = run.names.get(_ENTRY)
        if not isinstance(entry, _Function):
            raise NotReadError(f"it has no function {_ENTRY}()", 1)
        found = run.call(entry, (), {}, 1)
    except _TooMuchError:
        run.unread.setdefault(1, "it takes too many steps to evaluate")
        found = _Description()
    except (_Return, _Break, _Continue, RecursionError):
        found = Unknown("a statement outside of a function or a loop")
    actions = found.actions if isinstance(found, _Description) else [found]
    return Written(actions, run.unread)


def expression(text: str) -> str | Unknown:
    """Returns the value of an expression over constants as text."""
    unknown = Unknown("$(eval)")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            tree = ast.parse(text.strip(), mode="eval")
        found = _Run(lambda _: unknown).value(tree.body, {})
    except (SyntaxError, ValueError, RecursionError, MemoryError, _TooMuchError):
        return unknown
    return str(found) if _is_plain(found) else unknown


class _Run:
    def __init__(self, load: Load) -> None:
        self.left, self.depth, self.load = _STEPS, 0, load
        self.names: dict[str, Any] = {"__name__": "launch", "__file__": _FILE}
        self.unread: dict[int, str] = {}
        self.resolve: Callable[[Any], Any] | None = None  # within a function that a running launch calls
        self.why = ""  # on what it depends whether the statements are run
        self.returned: list[Any] = []  # by those of which this is not known

    def step(self) -> None:
        self.left -= 1
        if self.left < 0 or self.depth > _DEEPEST:
            raise _TooMuchError

    # Statements

    def block(self, body: Sequence[ast.stmt], names: dict[str, Any]) -> None:
        for one in body:
            self.statement(one, names)

    def statement(self, one: ast.stmt, names: dict[str, Any]) -> None:
        self.step()
        evaluate = getattr(self, f"do_{type(one).__name__.lower()}", None)
        if evaluate is not None:
            evaluate(one, names)
        elif not isinstance(one, (ast.Pass, ast.Assert, ast.Delete, ast.Global, ast.Nonlocal, ast.ClassDef)):
            self.skip(one, "this statement is not evaluated", names)

    def do_functiondef(self, one: ast.FunctionDef, names: dict[str, Any]) -> None:
        names[one.name] = _Function(one, names)

    def do_return(self, one: ast.Return, names: dict[str, Any]) -> None:
        raise _Return(self.value(one.value, names) if one.value else None)

    def do_assign(self, one: ast.Assign, names: dict[str, Any]) -> None:
        value = self.value(one.value, names)
        for target in one.targets:
            self.assign(target, value, names)

    def do_annassign(self, one: ast.AnnAssign, names: dict[str, Any]) -> None:
        if one.value is not None:
            self.assign(one.target, self.value(one.value, names), names)

    def do_augassign(self, one: ast.AugAssign, names: dict[str, Any]) -> None:
        old = self.value(_loaded(one.target), names)
        new = self.value(one.value, names)
        if isinstance(old, list) and isinstance(one.op, ast.Add) and isinstance(new, (list, tuple)):
            _extend(old, [_uncertain(each, self.why) for each in new])
        else:
            self.assign(one.target, _binary(one.op, old, new), names)

    def do_expr(self, one: ast.Expr, names: dict[str, Any]) -> None:
        found = self.value(one.value, names)
        if isinstance(one.value, ast.Call) and isinstance(found, Unknown):
            self.unread.setdefault(one.lineno, f"it calls `{ast.unparse(one.value)[:60]}`")

    def do_import(self, one: ast.Import | ast.ImportFrom, names: dict[str, Any]) -> None:
        for alias in one.names:
            whole = alias.asname is None and isinstance(one, ast.Import)
            name = alias.name.partition(".")[0] if whole else alias.name.rpartition(".")[2]
            names[alias.asname or name] = _Name(name)

    do_importfrom = do_import

    def do_if(self, one: ast.If, names: dict[str, Any]) -> None:
        test = self.value(one.test, names)
        if (why := _why_unknown(test)) is not None:
            self.perhaps(one, (one.body, one.orelse), why, names)
        else:
            self.block(one.body if test else one.orelse, names)

    def do_for(self, one: ast.For, names: dict[str, Any]) -> None:
        items = self.value(one.iter, names)
        if not isinstance(items, _ITERABLE):
            why = _why_unknown(items) or _COMPUTED
            inner = dict(names)
            self.assign(one.target, Unknown(f"an item of {why}"), inner)
            self.perhaps(one, (one.body,), why, names, inner)
            return
        for item in list(items):
            self.assign(one.target, item, names)
            try:
                self.block(one.body, names)
            except _Break:
                return
            except _Continue:
                continue
        self.block(one.orelse, names)

    def do_with(self, one: ast.With, names: dict[str, Any]) -> None:
        for item in one.items:
            if item.optional_vars is not None:
                self.assign(item.optional_vars, self.value(item.context_expr, names), names)
        self.block(one.body, names)

    def do_try(self, one: ast.Try, names: dict[str, Any]) -> None:
        self.block(one.body, names)
        self.block(one.finalbody, names)

    def do_break(self, _one: ast.Break, _names: dict[str, Any]) -> None:
        raise _Break

    def do_continue(self, _one: ast.Continue, _names: dict[str, Any]) -> None:
        raise _Continue

    def perhaps(
        self,
        one: ast.If | ast.For,
        bodies: Sequence[Sequence[ast.stmt]],
        why: str,
        names: dict[str, Any],
        inside: Mapping[str, Any] | None = None,
    ) -> None:
        """Evaluates statements of which it is not known whether they are run; ``inside`` has their names."""
        outer, self.why = self.why, self.why or why
        found: list[dict[str, Any]] = []
        ends = False
        for body in bodies:
            inner = dict(names if inside is None else inside)
            try:
                self.block(body, inner)
            except _Return as returned:
                self.returned.append(_uncertain(returned.value, self.why))
                ends = True
            except (_Break, _Continue):
                pass
            found.append(inner)
        self.skip(one, f"what is below this `{type(one).__name__.lower()}` depends on {why}", names)
        for name, value in names.items():
            if isinstance(value, Unknown) and value.line == one.lineno:
                made = [one[name] for one in found if isinstance(one.get(name), (Action, _Description, list))]
                if made and all(_started(each) for each in made):
                    names[name] = [_uncertain(each, self.why) for each in made]
        self.why = self.why if ends else outer

    def skip(self, one: ast.stmt, why: str, names: dict[str, Any]) -> None:
        """Records a statement that is not evaluated; what it may set is unknown."""
        self.unread.setdefault(one.lineno, why)
        for node in ast.walk(one):
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                names[node.id] = Unknown(f"`{node.id}`, which line {one.lineno} may set", one.lineno)

    def assign(self, target: ast.expr, value: Any, names: dict[str, Any]) -> None:
        if isinstance(target, ast.Name):
            names[target.id] = value
        elif isinstance(target, (ast.Tuple, ast.List)):
            known = isinstance(value, (list, tuple)) and len(value) == len(target.elts)
            for number, one in enumerate(target.elts):
                self.assign(one, value[number] if known else Unknown(_COMPUTED), names)
        elif isinstance(target, ast.Subscript):
            into, key = self.value(target.value, names), self.value(target.slice, names)
            if isinstance(into, dict) and isinstance(key, (str, int, float, bool)):
                into[key] = _uncertain(value, self.why)
            elif isinstance(into, list):
                into[:] = [Unknown("an item that is replaced")] * len(into)

    # Expressions

    def value(self, one: ast.expr, names: dict[str, Any]) -> Any:
        self.step()
        self.depth += 1
        try:
            found = getattr(self, f"of_{type(one).__name__.lower()}", None)
            return Unknown(_COMPUTED) if found is None else found(one, names)
        finally:
            self.depth -= 1

    def of_constant(self, one: ast.Constant, _names: dict[str, Any]) -> Any:
        return (
            one.value if isinstance(one.value, (str, int, float, bool, type(None))) else Unknown("a constant")
        )

    def of_name(self, one: ast.Name, names: dict[str, Any]) -> Any:
        return self.look_up(one.id, names)

    def look_up(self, name: str, names: Mapping[str, Any]) -> Any:
        if name in names:
            return names[name]
        if name in self.names:
            return self.names[name]
        return _Name(name)

    def of_joinedstr(self, one: ast.JoinedStr, names: dict[str, Any]) -> Any:
        return _joined([self.value(part, names) for part in one.values])

    def of_formattedvalue(self, one: ast.FormattedValue, names: dict[str, Any]) -> Any:
        found = self.value(one.value, names)
        if one.format_spec is None or isinstance(found, Unknown):
            return found
        shape = self.value(one.format_spec, names)
        try:
            return format(found, shape) if isinstance(shape, str) and len(shape) < 5 else Unknown("a format")
        except (TypeError, ValueError):
            return Unknown("a format")

    def of_list(self, one: ast.List | ast.Tuple | ast.Set, names: dict[str, Any]) -> Any:
        found: list[Any] = []
        for item in one.elts:
            if isinstance(item, ast.Starred):
                value = self.value(item.value, names)
                found += list(value) if isinstance(value, (list, tuple, range)) else [Unknown("a list")]
            else:
                found.append(self.value(item, names))
        return found

    of_set = of_list

    def of_tuple(self, one: ast.Tuple, names: dict[str, Any]) -> Any:
        return tuple(self.of_list(one, names))

    def of_dict(self, one: ast.Dict, names: dict[str, Any]) -> Any:
        found: dict[Any, Any] = {}
        for key, value in zip(one.keys, one.values, strict=True):
            item = self.value(value, names)
            if key is None:
                found.update(item if isinstance(item, dict) else {})
                continue
            called = self.value(key, names)
            if _is_plain(called) or isinstance(called, Variable):
                found[called] = item
        return found

    def of_subscript(self, one: ast.Subscript, names: dict[str, Any]) -> Any:
        into = self.value(one.value, names)
        if isinstance(into, _Name) and into.name == "environ":
            return Unknown(f"the environment variable {self.value(one.slice, names)}")
        if not isinstance(into, (str, list, tuple, dict)):
            return into if isinstance(into, Unknown) else Unknown(_COMPUTED)
        if isinstance(one.slice, ast.Slice):
            ends = [self.value(end, names) if end else None for end in (one.slice.lower, one.slice.upper)]
            known = not isinstance(into, dict) and all(isinstance(end, (int, type(None))) for end in ends)
            unknown = next((end for end in ends if isinstance(end, Unknown)), Unknown("a slice"))
            return into[slice(*ends)] if known else unknown
        key: Any = self.value(one.slice, names)
        try:
            return into[key]
        except (LookupError, TypeError):
            return Unknown(f"`{ast.unparse(one)[:60]}`")

    def of_attribute(self, one: ast.Attribute, names: dict[str, Any]) -> Any:
        into = self.value(one.value, names)
        if one.attr == "parent" and isinstance(into, str):
            return _above(into)
        if one.attr == "argv" and isinstance(into, _Name):
            self.unread.setdefault(one.lineno, "it reads its command line, which has no argument here")
            return []
        return into if isinstance(into, Unknown) else _Name(one.attr)

    def of_binop(self, one: ast.BinOp, names: dict[str, Any]) -> Any:
        return _binary(one.op, self.value(one.left, names), self.value(one.right, names))

    def of_unaryop(self, one: ast.UnaryOp, names: dict[str, Any]) -> Any:
        found = self.value(one.operand, names)
        if isinstance(one.op, ast.Not) and isinstance(found, (bool, int, str, list, dict, tuple, type(None))):
            return not found
        if isinstance(one.op, (ast.USub, ast.UAdd)) and isinstance(found, (int, float)):
            return -found if isinstance(one.op, ast.USub) else found
        return found if isinstance(found, Unknown) else Unknown(_COMPUTED)

    def of_boolop(self, one: ast.BoolOp, names: dict[str, Any]) -> Any:
        found: Any = None
        for part in one.values:
            found = self.value(part, names)
            if (why := _why_unknown(found)) is not None:
                return Unknown(why)
            if bool(found) is isinstance(one.op, ast.Or):
                return found
        return found

    def of_compare(self, one: ast.Compare, names: dict[str, Any]) -> Any:
        values = [self.value(part, names) for part in (one.left, *one.comparators)]
        for value in values:
            if (why := _why_unknown(value)) is not None:
                return Unknown(why)
        for number, op in enumerate(one.ops):
            compare = _COMPARISONS.get(type(op))
            one_side, other = values[number], values[number + 1]
            inside = other if isinstance(other, (list, tuple, dict)) else [other]
            if compare is None or not _is_plain(one_side) or not all(map(_is_plain, inside)):
                return Unknown("a comparison")
            try:
                if not compare(one_side, other):
                    return False
            except TypeError:
                return Unknown("a comparison")
        return True

    def of_ifexp(self, one: ast.IfExp, names: dict[str, Any]) -> Any:
        test = self.value(one.test, names)
        if (why := _why_unknown(test)) is not None:
            return Unknown(why)
        return self.value(one.body if test else one.orelse, names)

    def of_listcomp(self, one: ast.ListComp | ast.GeneratorExp, names: dict[str, Any]) -> Any:
        rounds = self.rounds(one.generators, dict(names))
        if not isinstance(rounds, Unknown):
            return [self.value(one.elt, each) for each in rounds]
        inner = dict(names)
        for each in one.generators:
            self.assign(each.target, Unknown(f"an item of {rounds.why}"), inner)
        made = _uncertain(self.value(one.elt, inner), rounds.why)
        return [made] if isinstance(made, Action) else rounds

    of_generatorexp = of_listcomp
    of_setcomp = of_listcomp

    def of_dictcomp(self, one: ast.DictComp, names: dict[str, Any]) -> Any:
        rounds = self.rounds(one.generators, dict(names))
        if isinstance(rounds, Unknown):
            return rounds
        pairs = ((self.value(one.key, each), self.value(one.value, each)) for each in rounds)
        return {key: value for key, value in pairs if isinstance(key, (str, int, float, bool))}

    def rounds(
        self, generators: Sequence[ast.comprehension], names: dict[str, Any]
    ) -> list[dict[str, Any]] | Unknown:
        """The names of each round of a comprehension."""
        found = [names]
        for one in generators:
            after: list[dict[str, Any]] = []
            for each in found:
                items = self.value(one.iter, each)
                if not isinstance(items, _ITERABLE):
                    return Unknown(_why_unknown(items) or _COMPUTED)
                for item in list(items):
                    self.step()
                    inner = dict(each)
                    self.assign(one.target, item, inner)
                    tests = [self.value(test, inner) for test in one.ifs]
                    if any(isinstance(test, Unknown) for test in tests):
                        return Unknown("the condition of a comprehension")
                    if all(tests):
                        after.append(inner)
            found = after
        return found

    def of_lambda(self, one: ast.Lambda, names: dict[str, Any]) -> Any:
        return _Function(one, names)

    def of_namedexpr(self, one: ast.NamedExpr, names: dict[str, Any]) -> Any:
        found = self.value(one.value, names)
        self.assign(one.target, found, names)
        return found

    # Calls

    def of_call(self, one: ast.Call, names: dict[str, Any]) -> Any:
        given: list[Any] = []
        for item in one.args:
            if isinstance(item, ast.Starred):
                value = self.value(item.value, names)
                given += list(value) if isinstance(value, (list, tuple, range)) else [Unknown("a list")]
            else:
                given.append(self.value(item, names))
        named: dict[str, Any] = {}
        for keyword in one.keywords:
            value = self.value(keyword.value, names)
            if keyword.arg is not None:
                named[keyword.arg] = value
            elif isinstance(value, dict):
                named.update({str(key): item for key, item in value.items()})
        if isinstance(one.func, ast.Attribute):
            into = self.value(one.func.value, names)
            if (isinstance(into, _Name) and into.name == "environ") or one.func.attr == "getenv":
                return Unknown(f"the environment variable {given[0] if given else ''}")
            if not isinstance(into, _Name):
                return self.method(into, one.func.attr, given, named, one.lineno)
            called: Any = _Name(one.func.attr)
        else:
            called = self.value(one.func, names)
        if isinstance(called, _Function):
            return self.call(called, tuple(given), named, one.lineno)
        if isinstance(called, _Name):
            return self.known_call(called.name, given, named, one.lineno)
        return called if isinstance(called, Unknown) else Unknown(_COMPUTED)

    def call(self, function: _Function, given: Sequence[Any], named: Mapping[str, Any], line: int) -> Any:
        """The value of a call of a function of the file."""
        self.step()
        definition, names = function.definition, dict(function.names)
        parameters = [*definition.args.posonlyargs, *definition.args.args]
        defaults = definition.args.defaults
        for one, default in zip(parameters[len(parameters) - len(defaults) :], defaults, strict=True):
            names[one.arg] = self.value(default, function.names)
        for one, keyword in zip(definition.args.kwonlyargs, definition.args.kw_defaults, strict=True):
            names[one.arg] = self.value(keyword, function.names) if keyword else Unknown(f"`{one.arg}`")
        names.update({one.arg: value for one, value in zip(parameters, given, strict=False)})
        if definition.args.vararg:
            names[definition.args.vararg.arg] = list(given[len(parameters) :])
        if definition.args.kwarg:
            names[definition.args.kwarg.arg] = dict(named)
        names.update(named)
        self.depth += 1
        outer, self.returned, why = self.returned, [], self.why
        result: Any = None
        try:
            self.step()
            if isinstance(definition, ast.Lambda):
                return self.value(definition.body, names)
            self.block(definition.body, names)
        except _Return as found:
            result = found.value
        except (_Break, _Continue):
            return Unknown(f"line {line}")
        finally:
            self.depth -= 1
            perhaps, self.returned = self.returned, outer
            later, self.why = self.why, why
        if not perhaps:
            return result
        every = [*perhaps, _uncertain(result, later)]
        if any(one is not None and _started(one) is None for one in every):
            return next((one for one in every if isinstance(one, Unknown)), Unknown(later or _COMPUTED))
        actions = [one.actions if isinstance(one, _Description) else one for one in every if one is not None]
        return _Description(actions) if any(isinstance(one, _Description) for one in every) else actions

    def method(self, into: Any, name: str, given: list[Any], named: Mapping[str, Any], line: int) -> Any:
        """The value of a call of a method of a value."""
        if isinstance(into, Unknown):
            return into
        if isinstance(into, _Description) and name in ("add_action", "add_entity"):
            into.actions += [_uncertain(one, self.why) for one in given[:1]]
            return None
        if isinstance(into, (Text, Variable, Computed)):
            if name == "perform":
                return self.resolve(into) if self.resolve is not None else into
            return Unknown(_OF_THE_LAUNCH)
        if name in ("open", "read_text") and isinstance(into, str):
            return _opened(into)
        if name == "joinpath" and isinstance(into, (str, Text)):
            return _joined(_between("/", [into, *given]))
        if name == "find" and isinstance(into, str) and into.startswith("$(find-pkg-share "):
            return _share(given, named)
        if name in _SAME_PATH and isinstance(into, (str, Text)):
            return into
        function = _METHODS.get(type(into))
        if name in _CHANGES and isinstance(into, (list, dict)):
            given = [*given[:-1], *(_uncertain(one, self.why) for one in given[-1:])]
        if function is not None:
            return function(into, name, given, named)
        return Unknown(f"`.{name}()` of line {line}")

    def known_call(self, name: str, given: list[Any], named: dict[str, Any], line: int) -> Any:
        """The value of a call of what an import brings, or Python itself."""
        if name in _SIMPLE:
            return _simple(name, given)
        if name in _SUBSTITUTIONS:
            return _SUBSTITUTIONS[name](given, named)
        if name in _CONDITIONS:
            value = given[0] if given else named.get("predicate_expression")
            if name.startswith("Launch"):
                variable = _argument(given, named, 0, "launch_configuration_name")
                expected = _argument(given, named, 1, "expected_value")
                value = Computed("equals", (Variable(str(variable)), expected))
            return Condition(value, _CONDITIONS[name])
        if name in _SOURCES:
            return _Source(given[0] if given else named.get("launch_file_path", named.get("location")))
        if name == "LaunchDescription":
            entities = given[0] if given else named.get("initial_entities")
            return _Description(entities if isinstance(entities, list) else _listed(entities))
        if name in _OF_FILES and given:
            return self.file_call(name, given[0])
        if name == "OpaqueFunction":
            return self.opaque(given, named, line)
        if name in _ACTIONS:
            return _action(name, given, named, line)
        return Unknown(f"{name}()", line)

    def file_call(self, name: str, value: Any) -> Any:
        """The value of a call that opens a file, reads YAML or JSON from it, or writes a value as text."""
        if name == "open":
            return _opened(value)
        if "dump" in name:
            return _dumped(value)
        return self.load(value.file) if isinstance(value, _Opened) else Unknown(f"{name}()")

    def opaque(self, given: list[Any], named: dict[str, Any], line: int) -> Any:
        function = named.get("function", given[0] if given else None)
        if not isinstance(function, _Function):
            return Unknown(f"the function of line {line}")
        more = named.get("args") or ()
        keywords = named.get("kwargs") or {}

        def run(known: Callable[[Any], Any]) -> Any:
            self.resolve = known
            try:
                values = (_Name("context"), *(more if isinstance(more, (list, tuple)) else ()))
                found = self.call(function, values, keywords if isinstance(keywords, dict) else {}, line)
            except _TooMuchError:
                return Unknown(f"the function of line {line}, which takes too many steps")
            finally:
                self.resolve = None
            return [] if found is None else found

        return Action("opaque", line, {"call": run}, _condition(named))


def _started(value: Any) -> list[Action] | None:
    """The actions of a value, which may be within lists and descriptions; None if it has anything else."""
    waiting, found = [value], list[Action]()
    for _ in range(_LARGEST):
        if not waiting:
            return found
        one = waiting.pop(0)
        if isinstance(one, Action):
            found.append(one)
        elif isinstance(one, (list, tuple, _Description)):
            waiting[:0] = one.actions if isinstance(one, _Description) else one
        else:
            return None
    return None


def _uncertain(value: Any, why: str) -> Any:
    """What a value is if it is only perhaps, for a reason."""
    if not why:
        return value
    if isinstance(value, dict):
        return {key: Unknown(why) for key in value}
    actions = _started(value)
    if value is None or actions is None:
        return value if isinstance(value, Unknown) or value is None else Unknown(why)
    perhaps = Condition(Unknown(why))
    made = [
        Action("group", one.line, {"actions": [one], "scoped": False}, perhaps)
        if one.condition
        else replace(one, condition=perhaps)
        for one in actions
    ]
    return (
        made[0]
        if isinstance(value, Action)
        else _Description(made)
        if isinstance(value, _Description)
        else made
    )


def _why_unknown(value: Any) -> str | None:
    """Why a value cannot be tested or iterated here; None if it can."""
    if isinstance(value, Unknown):
        return value.why
    if isinstance(value, _Name) and value.name == "environ":
        return "the environment"
    return _OF_THE_LAUNCH if isinstance(value, (Text, Variable, Computed, _Name)) else None


def _is_plain(value: Any) -> bool:
    """True for a value that takes no time to print or compare: nothing within it."""
    return isinstance(value, (str, int, float, bool, type(None)))


def _loaded(target: ast.expr) -> ast.expr:
    found = ast.copy_location(ast.parse(ast.unparse(target), mode="eval").body, target)
    return ast.fix_missing_locations(found)


_BINARY: Mapping[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv, ast.Mod: operator.mod,
}  # fmt: skip
_COMPARISONS: Mapping[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Eq: operator.eq, ast.NotEq: operator.ne, ast.Lt: operator.lt, ast.LtE: operator.le,
    ast.Gt: operator.gt, ast.GtE: operator.ge, ast.Is: lambda one, other: one is other or one == other,
    ast.IsNot: lambda one, other: one != other, ast.In: lambda one, other: one in other,
    ast.NotIn: lambda one, other: one not in other,
}  # fmt: skip


def _binary(op: ast.operator, left: Any, right: Any) -> Any:
    for one in (left, right):
        if isinstance(one, Unknown):
            return one
    if isinstance(op, ast.Add) and (
        isinstance(left, (Text, Variable)) or isinstance(right, (Text, Variable))
    ):
        return _joined([left, right])
    if isinstance(op, ast.Div) and isinstance(left, (str, Text, Variable)):
        return _joined([left, "/", right])
    function = _BINARY.get(type(op))
    if (
        function is None
        or isinstance(left, (Text, Variable, Computed, _Name))
        or isinstance(right, (Text, Variable, Computed, _Name))
    ):
        return Unknown(_COMPUTED)
    size = sum(len(one) for one in (left, right) if isinstance(one, (str, list, tuple)))
    if size > _LARGEST:
        return Unknown("a long list or text")
    times = next((one for one in (left, right) if isinstance(one, int)), 1)
    if isinstance(op, ast.Mult) and size * abs(times) > _LARGEST:
        return Unknown("a long list or text")
    if isinstance(op, ast.Mod) and isinstance(left, str):
        values = right if isinstance(right, tuple) else (right,)
        if _WIDE.search(left) or not all(map(_is_plain, values)):
            return Unknown("a format")
    try:
        found = function(left, right)
    except (TypeError, ValueError, ArithmeticError):
        return Unknown(_COMPUTED)
    return Unknown("a large number") if isinstance(found, int) and abs(found) > _LARGEST_NUMBER else found


def _joined(parts: Sequence[Any]) -> Any:
    """The parts as one text; unknown if one of them is."""
    if unknown := next((one for one in parts if isinstance(one, Unknown)), None):
        return unknown
    if all(map(_is_plain, parts)) and sum(len(one) for one in parts if isinstance(one, str)) <= _LARGEST:
        text = "".join(map(str, parts))
        return text if len(text) <= _LARGEST else Unknown("a long text")
    if all(isinstance(one, (str, int, float, bool, Text, Variable, Computed)) for one in parts):
        return Text(tuple(parts))
    return Unknown(_COMPUTED)


def _between(text: str, items: Sequence[Any]) -> list[Any]:
    found: list[Any] = []
    for number, one in enumerate(items):
        found += [text, one] if number else [one]
    return found


_OF_TEXT = frozenset(
    ("format", "join", "split", "replace", "lower", "upper", "strip", "lstrip", "rstrip", "startswith",
     "endswith")
)  # fmt: skip
_FORMATS = ":!.["  # of a format: widths, conversions, attributes


def _extend(into: list[Any], items: Sequence[Any]) -> None:
    if len(into) + len(items) > _LARGEST:
        raise _TooMuchError
    into.extend(items)


def _of_list(into: list[Any], name: str, given: list[Any], _named: Mapping[str, Any]) -> Any:
    if name == "copy":
        return list(into)
    if name == "append":
        _extend(into, given[:1])
    elif name == "insert" and len(given) > 1 and isinstance(given[0], int):
        into.insert(given[0], given[1])
    elif name == "extend" and given:
        _extend(into, given[0] if isinstance(given[0], (list, tuple)) else given[:1])
    else:
        return Unknown(f"`.{name}()`")
    return None


def _of_text(into: str, name: str, given: list[Any], named: Mapping[str, Any]) -> Any:
    if name == "join" and given and isinstance(given[0], (list, tuple)):
        return _joined(_between(into, given[0]))
    if unknown := next((one for one in (*given, *named.values()) if isinstance(one, Unknown)), None):
        return unknown
    if not all(map(_is_plain, (*given, *named.values()))):
        return Unknown(f"`.{name}()`")
    sizes = sum(len(one) for one in given if isinstance(one, str))
    grows = name == "replace" and len(into) * sizes > _LARGEST
    if name not in _OF_TEXT or grows or any(char in into for char in _FORMATS if name == "format"):
        return Unknown(f"`.{name}()`")
    try:
        found = getattr(into, name)(*given, **named)
    except (TypeError, ValueError, LookupError, AttributeError):
        return Unknown(f"`.{name}()`")
    return Unknown("a long text") if isinstance(found, str) and len(found) > _LARGEST else found


def _of_dict(into: dict[Any, Any], name: str, given: list[Any], named: Mapping[str, Any]) -> Any:
    if name in ("items", "keys", "values"):
        return list(getattr(into, name)())
    if name == "copy":
        return dict(into)
    if name == "update":
        into.update(given[0] if given and isinstance(given[0], dict) else {})
        into.update(named)
        return None
    try:
        return into.get(given[0], given[1] if len(given) > 1 else None) if name == "get" else Unknown(name)
    except (LookupError, TypeError):
        return Unknown(f"`.{name}()`")


_METHODS: Mapping[type[Any], Callable[..., Any]] = {list: _of_list, dict: _of_dict, str: _of_text}
_BUILTINS: Mapping[str, Callable[..., Any]] = {
    "len": len, "str": str, "int": int, "float": float, "bool": bool, "list": list, "dict": dict,
    "tuple": tuple, "sorted": sorted, "min": min, "max": max, "sum": sum, "abs": abs, "round": round,
    "enumerate": lambda items, start=0: list(enumerate(items, start)),
    "zip": lambda *items: list(zip(*items, strict=False)),
    "reversed": lambda items: list(reversed(items)),
}  # fmt: skip
_LOOKING = frozenset(("str", "sorted", "min", "max", "sum"))  # what looks into its values
_CHANGES = ("append", "insert", "extend", "update", "setdefault")  # of a list or a dictionary
_SAME_PATH = ("resolve", "as_posix", "absolute", "expanduser", "__str__")
_OF_PATHS = frozenset((
    "join", "get_package_share_directory", "get_package_share_path", "dirname", "Path", "realpath", "abspath",
))  # fmt: skip
_SIMPLE = frozenset((*_BUILTINS, *_OF_PATHS, "range", "print"))


def _of_path(name: str, given: list[Any]) -> Any:
    if name == "join":
        return _joined(_between("/", given))
    first = given[0] if given else ""
    if name.startswith("get_package"):
        return f"$(find-pkg-share {first})" if isinstance(first, str) else Unknown("a package")
    if name == "Path" and len(given) > 1:
        return _joined(_between("/", given))
    if name == "dirname":
        return _above(first) if isinstance(first, str) else Unknown("a path")
    return first if isinstance(first, (str, Text)) else Unknown("a path")


def _above(path: str) -> str:
    """The folder of a path."""
    return f"{path}/.." if path.endswith((")", "..")) else posixpath.dirname(path)


def _simple(name: str, given: list[Any]) -> Any:
    if name == "print":
        return None
    if unknown := next((one for one in given if isinstance(one, Unknown)), None):
        return unknown
    if name in _OF_PATHS:
        return _of_path(name, given)
    if any(isinstance(one, (Text, Variable, Computed, _Name)) for one in given):
        is_text = name == "str" and len(given) == 1 and not isinstance(given[0], _Name)
        return given[0] if is_text else Unknown(_OF_THE_LAUNCH)
    inside = [one for item in given for one in (item if isinstance(item, (list, tuple, dict)) else [item])]
    if name in _LOOKING and not all(map(_is_plain, inside)):
        return Unknown(f"{name}()")
    try:
        if name == "range":
            found = range(*given)
            return list(found) if len(found) <= _LARGEST else Unknown("a long range")
        made = _BUILTINS[name](*given)
    except (TypeError, ValueError, ArithmeticError):
        return Unknown(f"{name}()")
    return made


def _listed(value: Any) -> list[Any]:
    return list(value) if isinstance(value, tuple) else [] if value is None else [value]


def _argument(given: Sequence[Any], named: Mapping[str, Any], number: int, name: str) -> Any:
    return given[number] if len(given) > number else named.get(name)


def _variable(given: Sequence[Any], named: Mapping[str, Any]) -> Any:
    name = _argument(given, named, 0, "variable_name")
    return (
        Variable(name, named.get("default")) if isinstance(name, str) else Unknown("a name that it computes")
    )


def _path(given: Sequence[Any], _named: Mapping[str, Any]) -> Any:
    parts = given[0] if given and isinstance(given[0], (list, tuple)) else []
    parts = [Text(tuple(one)) if isinstance(one, (list, tuple)) else one for one in parts]
    return _joined(_between("/", parts))


def _share(given: Sequence[Any], named: Mapping[str, Any]) -> Any:
    package = _argument(given, named, 0, "package")
    package = package[0] if isinstance(package, (list, tuple)) and len(package) == 1 else package
    if isinstance(package, (Text, Variable)):
        return Text(("$(find-pkg-share ", package, ")"))
    return f"$(find-pkg-share {package})" if isinstance(package, str) else Unknown("a package")


def _environment(given: Sequence[Any], named: Mapping[str, Any]) -> Any:
    default = named.get("default_value", given[1] if len(given) > 1 else None)
    shown = f", by default `{default}`" if isinstance(default, str) else ""
    return Unknown(f"$(env {_argument(given, named, 0, 'name')}){shown}")


def _printed(command: str) -> Unknown:
    """What a command prints, which only the host knows."""
    return Unknown(f"what `{command[:100]}` prints")


def _rewritten(given: Sequence[Any], named: Mapping[str, Any]) -> Any:
    rewrites = _argument(given, named, 1, "param_rewrites")
    known = (
        {key: one for key, one in rewrites.items() if isinstance(key, str)}
        if isinstance(rewrites, dict)
        else {}
    )
    return Rewritten(_argument(given, named, 0, "source_file"), known, named.get("root_key") or "")


def _replaced(given: Sequence[Any], named: Mapping[str, Any]) -> Any:
    """The ReplaceString of Nav2: texts in the values of a file of parameters."""
    found = _argument(given, named, 1, "replacements")
    pairs = [part for pair in found.items() for part in pair] if isinstance(found, dict) else []
    when = _argument(given, named, 2, "condition")
    wanted = when.value if isinstance(when, Condition) else True
    wanted = wanted if not isinstance(when, Condition) or when.wanted else Computed("not", (wanted,))
    return Computed("replace", (_argument(given, named, 0, "source_file"), wanted, *pairs))


def _dumped(value: Any) -> Any:
    """A value as text in YAML, which is that of JSON, too."""
    waiting, count = [value], 0
    while waiting:  # what repeats itself may have no end
        one, count = waiting.pop(), count + 1
        inside = (
            list(one.values()) if isinstance(one, dict) else one if isinstance(one, (list, tuple)) else []
        )
        waiting += inside
        if count > _LARGEST or not (inside or _is_plain(one) or one in ([], {})):
            return Unknown("dump()")
    text = json.dumps(value, default=str)
    return text if len(text) <= _LARGEST else Unknown("a long text")


def _opened(file: Any) -> _Opened:
    return _Opened(f"the text of {file}" if isinstance(file, str) else "the text of a file", file=file)


def _parts(value: Any) -> tuple[Any, ...]:
    return tuple(value) if isinstance(value, (list, tuple)) else (value,)


def _first(given: Sequence[Any], named: Mapping[str, Any]) -> Any:
    """The value that a wrapper such as ParameterValue has."""
    return given[0] if given else next(iter(named.values()), None)


_SUBSTITUTIONS: Mapping[str, Callable[[Sequence[Any], Mapping[str, Any]], Any]] = {
    "LaunchConfiguration": _variable,
    "PathJoinSubstitution": _path,
    "FindPackageShare": _share,
    "FindPackagePrefix": _share,
    "EnvironmentVariable": _environment,
    "TextSubstitution": lambda given, named: Text((_first(given, named),)),
    "ParameterValue": _first,
    "ParameterFile": _first,
    "StringJoinSubstitution": lambda given, named: _joined(
        _between(str(named.get("delimiter", "")), given[0] if given and isinstance(given[0], list) else [])
    ),
    "FindExecutable": _first,
    "ThisLaunchFileDir": lambda _given, _named: _FOLDER,
    "Command": lambda given, named: Computed(_printed, _parts(_argument(given, named, 0, "command"))),
    "PythonExpression": lambda given, named: Computed(
        expression, _parts(_argument(given, named, 0, "expression"))
    ),
    "AnonName": lambda _given, _named: Unknown("$(anon)"),
    "NotSubstitution": lambda given, _named: Computed("not", tuple(given[:1])),
    "AndSubstitution": lambda given, _named: Computed("and", tuple(given)),
    "OrSubstitution": lambda given, _named: Computed("or", tuple(given)),
    "EqualsSubstitution": lambda given, _named: Computed("equals", tuple(given)),
    "NotEqualsSubstitution": lambda given, _named: Computed("not", (Computed("equals", tuple(given)),)),
    "IfElseSubstitution": lambda given, named: (
        Computed(
            "if", (given[0], _argument(given, named, 1, "if_value"), _argument(given, named, 2, "else_value"))
        )
        if given
        else Unknown("$(if)")
    ),
    "RewrittenYaml": _rewritten,
    "ReplaceString": _replaced,
    "HasNodeParams": lambda given, named: Computed(
        "has", (_argument(given, named, 0, "source_file"), _argument(given, named, 1, "node_name"))
    ),
}
_CONDITIONS = {
    "IfCondition": True, "UnlessCondition": False,
    "LaunchConfigurationEquals": True, "LaunchConfigurationNotEquals": False,
}  # fmt: skip
_SOURCES = frozenset(
    ("PythonLaunchDescriptionSource", "AnyLaunchDescriptionSource", "XMLLaunchDescriptionSource",
     "YAMLLaunchDescriptionSource", "FrontendLaunchDescriptionSource", "LaunchDescriptionSource")
)  # fmt: skip

_OF_FILES = frozenset(
    ("open", "safe_load", "load", "full_load", "unsafe_load", "loads", "dump", "safe_dump", "dumps")
)
_Arguments = Mapping[str, Any]


def _of_node(given: Sequence[Any], named: _Arguments) -> _Arguments:
    own = dict(named)
    for old, new in (
        ("node_executable", "executable"),
        ("node_name", "name"),
        ("node_namespace", "namespace"),
    ):
        own.setdefault(new, named.get(old))
    own["components"] = _components(named.get("composable_node_descriptions"))
    return own


def _components(value: Any) -> list[Any]:
    return [one.action for one in value if isinstance(one, _Component)] if isinstance(value, list) else []


def _of_argument(given: Sequence[Any], named: _Arguments) -> _Arguments:
    return {"name": _argument(given, named, 0, "name"), "default": named.get("default_value")}


def _of_pair(given: Sequence[Any], named: _Arguments) -> _Arguments:
    return {
        "name": _argument(given, named, 0, "name"),
        "value": _argument(given, named, 1, "value"),
        "from": _argument(given, named, 0, "src"),
        "to": _argument(given, named, 1, "dst"),
    }


def _of_group(given: Sequence[Any], named: _Arguments) -> _Arguments:
    return {
        "actions": _argument(given, named, 0, "actions") or [],
        "scoped": named.get("scoped", True),
        "values": named.get("launch_configurations"),
    }


def _of_include(given: Sequence[Any], named: _Arguments) -> _Arguments:
    source = _argument(given, named, 0, "launch_description_source")
    file = source.file if isinstance(source, _Source) else source
    file = Text(tuple(file)) if isinstance(file, (list, tuple)) else file
    return {"file": file, "arguments": named.get("launch_arguments")}


def _of_timer(given: Sequence[Any], named: _Arguments) -> _Arguments:
    actions = named.get("actions") or (given[1] if len(given) > 1 else [])
    return {"actions": actions, "period": _argument(given, named, 0, "period")}


def _of_process(_given: Sequence[Any], named: _Arguments) -> _Arguments:
    return named


def _of_event(given: Sequence[Any], named: _Arguments) -> _Arguments:
    return {
        "what": "an event handler has no key in a spec",
        "actions": [*_actions_in((*given, *(one for key, one in named.items() if key != "target_action")))],
    }


def _actions_in(values: Sequence[Any]) -> Iterator[Action]:
    for one in values:
        if isinstance(one, Action):
            if one.kind == "later":
                yield from one.arguments.get("actions", ())
            else:
                yield one
        elif isinstance(one, (list, tuple)):
            yield from _actions_in(one)


_ACTIONS: Mapping[str, tuple[str, Callable[[Sequence[Any], _Arguments], _Arguments]]] = {
    **dict.fromkeys(("Node", "LifecycleNode"), ("node", _of_node)),
    "ComposableNodeContainer": ("container", _of_node),
    "LoadComposableNodes": ("load", _of_node),
    "ComposableNode": ("component", _of_node),
    "DeclareLaunchArgument": ("arg", _of_argument),
    "SetLaunchConfiguration": ("let", _of_pair),
    "UnsetLaunchConfiguration": ("unset", _of_pair),
    "GroupAction": ("group", _of_group),
    **dict.fromkeys(
        ("PushRosNamespace", "PushROSNamespace"),
        ("namespace", lambda given, named: {"namespace": _argument(given, named, 0, "namespace")}),
    ),
    "IncludeLaunchDescription": ("include", _of_include),
    "SetRemap": ("remap", _of_pair),
    "SetParameter": ("parameter", _of_pair),
    **dict.fromkeys(("SetEnvironmentVariable", "AppendEnvironmentVariable"), ("environment", _of_pair)),
    "TimerAction": ("children", _of_timer),
    **dict.fromkeys(
        ("LogInfo", "PushLaunchConfigurations", "PopLaunchConfigurations", "ResetLaunchConfigurations"),
        ("silent", lambda _given, _named: {}),
    ),
    **dict.fromkeys(("ExecuteProcess", "ExecuteLocal"), ("process", _of_process)),
    **dict.fromkeys(
        ("RegisterEventHandler", "OnProcessExit", "OnProcessStart", "OnShutdown", "OnStateTransition",
         "OnExecutionComplete", "OnProcessIO", "EmitEvent", "Shutdown"),
        ("later", _of_event),
    ),
}  # fmt: skip


def _condition(named: Mapping[str, Any]) -> Condition | None:
    found = named.get("condition")
    if found is None or isinstance(found, Condition):
        return found
    return Condition(found if isinstance(found, Unknown) else Unknown("a condition that it computes"))


def _action(name: str, given: Sequence[Any], named: _Arguments, line: int) -> Any:
    kind, arguments = _ACTIONS[name]
    made = Action(kind, line, arguments(given, named), _condition(named))
    return _Component(made) if kind == "component" else made
