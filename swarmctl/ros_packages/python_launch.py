"""Reads a Python launch file of ROS 2 as data: its syntax tree is evaluated, and nothing of it is run.

Known are constants, f-strings, lists, dictionaries, loops and comprehensions over them, functions of the
file, `os.path.join`, and the actions, substitutions and conditions of launch and launch_ros. Any other value
is unknown, with the reason. Source: github.com/ros2/launch, launch_ros (Humble to Kilted).
"""

from __future__ import annotations

import ast
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from swarmctl.ros_packages.launch_calls import (
    ACTIONS,
    CONDITIONS,
    SOURCES,
    SUBSTITUTIONS,
    Description,
    LaunchSource,
    action_of,
    argument_of,
    condition_of,
    listed,
    parts_of,
    share_of,
    started,
    uncertain,
)
from swarmctl.ros_packages.launch_values import (
    Action,
    Computed,
    Condition,
    Load,
    NotReadError,
    Text,
    Unknown,
    Variable,
    Written,
)
from swarmctl.ros_packages.python_values import (
    CHANGES,
    COMPARISONS,
    COMPUTED,
    FOLDER,
    METHODS,
    OF_THE_LAUNCH,
    SAME_PATH,
    SIMPLE,
    Name,
    Opened,
    TooMuchError,
    between,
    binary,
    dumped,
    extended_by,
    folder_of,
    is_plain,
    joined,
    opened,
    simple_call,
    why_unknown,
)

_STEPS = 20_000  # expressions and statements of one file
_DEEPEST = 40  # calls and expressions within each other
_ITERABLE = (list, tuple, dict, range, str)
_ENTRY = "generate_launch_description"
_FILE = f"{FOLDER}/{_ENTRY}"  # stands for the path of the file itself


class _Return(Exception):  # noqa: N818  (it carries a value, and is no error)
    def __init__(self, value: Any) -> None:
        super().__init__()
        self.value = value


class _Break(Exception):  # noqa: N818
    pass


class _Continue(Exception):  # noqa: N818
    pass


@dataclass(frozen=True)
class _Function:
    definition: ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda
    names: dict[str, Any]  # those around it


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
    except TooMuchError:
        run.unread.setdefault(1, "it takes too many steps to evaluate")
        found = Description()
    except (_Return, _Break, _Continue, RecursionError):
        found = Unknown("a statement outside of a function or a loop")
    actions = found.actions if isinstance(found, Description) else [found]
    return Written(actions, run.unread)


def expression(text: str) -> str | Unknown:
    """Returns the value of an expression over constants as text."""
    unknown = Unknown("$(eval)")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            tree = ast.parse(text.strip(), mode="eval")
        found = _Run(lambda _: unknown).value(tree.body, {})
    except (SyntaxError, ValueError, RecursionError, MemoryError, TooMuchError):
        return unknown
    return str(found) if is_plain(found) else unknown


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
            raise TooMuchError

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
            extended_by(old, [uncertain(each, self.why) for each in new])
        else:
            self.assign(one.target, binary(one.op, old, new), names)

    def do_expr(self, one: ast.Expr, names: dict[str, Any]) -> None:
        found = self.value(one.value, names)
        if isinstance(one.value, ast.Call) and isinstance(found, Unknown):
            self.unread.setdefault(one.lineno, f"it calls `{ast.unparse(one.value)[:60]}`")

    def do_import(self, one: ast.Import | ast.ImportFrom, names: dict[str, Any]) -> None:
        for alias in one.names:
            whole = alias.asname is None and isinstance(one, ast.Import)
            name = alias.name.partition(".")[0] if whole else alias.name.rpartition(".")[2]
            names[alias.asname or name] = Name(name)

    do_importfrom = do_import

    def do_if(self, one: ast.If, names: dict[str, Any]) -> None:
        test = self.value(one.test, names)
        if (why := why_unknown(test)) is not None:
            self.perhaps(one, (one.body, one.orelse), why, names)
        else:
            self.block(one.body if test else one.orelse, names)

    def do_for(self, one: ast.For, names: dict[str, Any]) -> None:
        items = self.value(one.iter, names)
        if not isinstance(items, _ITERABLE):
            why = why_unknown(items) or COMPUTED
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
                self.returned.append(uncertain(returned.value, self.why))
                ends = True
            except (_Break, _Continue):
                ends = True
            found.append(inner)
        self.skip(one, f"what is below this `{type(one).__name__.lower()}` depends on {why}", names)
        for name, value in names.items():
            if isinstance(value, Unknown) and value.line == one.lineno:
                made = [one[name] for one in found if isinstance(one.get(name), (Action, Description, list))]
                if made and all(started(each) for each in made):
                    names[name] = [uncertain(each, self.why) for each in made]
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
                self.assign(one, value[number] if known else Unknown(COMPUTED), names)
        elif isinstance(target, ast.Subscript):
            into, key = self.value(target.value, names), self.value(target.slice, names)
            if isinstance(into, dict) and isinstance(key, (str, int, float, bool)):
                into[key] = uncertain(value, self.why)
            elif isinstance(into, list):
                into[:] = [Unknown("an item that is replaced")] * len(into)

    # Expressions

    def value(self, one: ast.expr, names: dict[str, Any]) -> Any:
        self.step()
        self.depth += 1
        try:
            found = getattr(self, f"of_{type(one).__name__.lower()}", None)
            return Unknown(COMPUTED) if found is None else found(one, names)
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
        return Name(name)

    def of_joinedstr(self, one: ast.JoinedStr, names: dict[str, Any]) -> Any:
        return joined([self.value(part, names) for part in one.values])

    def of_formattedvalue(self, one: ast.FormattedValue, names: dict[str, Any]) -> Any:
        found = self.value(one.value, names)
        if one.conversion > 0 and not isinstance(found, Unknown):
            return Unknown("a format")
        if one.format_spec is None or isinstance(found, Unknown):
            return found
        if not is_plain(found):
            return Unknown("a format")
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
                extended_by(
                    found, list(value) if isinstance(value, (list, tuple, range)) else [Unknown("a list")]
                )
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
            if is_plain(called) or (
                isinstance(called, Variable) and not isinstance(called.default, (list, dict))
            ):
                found[called] = item
        return found

    def of_subscript(self, one: ast.Subscript, names: dict[str, Any]) -> Any:
        into = self.value(one.value, names)
        if isinstance(into, Name) and into.name == "environ":
            return Unknown(f"the environment variable {self.value(one.slice, names)}")
        if not isinstance(into, (str, list, tuple, dict)):
            return into if isinstance(into, Unknown) else Unknown(COMPUTED)
        if isinstance(one.slice, ast.Slice) and one.slice.step is not None:
            return Unknown("a slice")
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
            return folder_of(into)
        if one.attr == "argv" and isinstance(into, Name):
            self.unread.setdefault(one.lineno, "it reads its command line, which has no argument here")
            return []
        return into if isinstance(into, Unknown) else Name(one.attr)

    def of_binop(self, one: ast.BinOp, names: dict[str, Any]) -> Any:
        return binary(one.op, self.value(one.left, names), self.value(one.right, names))

    def of_unaryop(self, one: ast.UnaryOp, names: dict[str, Any]) -> Any:
        found = self.value(one.operand, names)
        if isinstance(one.op, ast.Not) and isinstance(found, (bool, int, str, list, dict, tuple, type(None))):
            return not found
        if isinstance(one.op, (ast.USub, ast.UAdd)) and isinstance(found, (int, float)):
            return -found if isinstance(one.op, ast.USub) else found
        return found if isinstance(found, Unknown) else Unknown(COMPUTED)

    def of_boolop(self, one: ast.BoolOp, names: dict[str, Any]) -> Any:
        found: Any = None
        for part in one.values:
            found = self.value(part, names)
            if (why := why_unknown(found)) is not None:
                return Unknown(why)
            if bool(found) is isinstance(one.op, ast.Or):
                return found
        return found

    def of_compare(self, one: ast.Compare, names: dict[str, Any]) -> Any:
        values = [self.value(part, names) for part in (one.left, *one.comparators)]
        for value in values:
            if (why := why_unknown(value)) is not None:
                return Unknown(why)
        for number, op in enumerate(one.ops):
            compare = COMPARISONS.get(type(op))
            one_side, other = values[number], values[number + 1]
            inside = other if isinstance(other, (list, tuple, dict)) else [other]
            if compare is None or not is_plain(one_side) or not all(map(is_plain, inside)):
                return Unknown("a comparison")
            try:
                if not compare(one_side, other):
                    return False
            except TypeError:
                return Unknown("a comparison")
        return True

    def of_ifexp(self, one: ast.IfExp, names: dict[str, Any]) -> Any:
        test = self.value(one.test, names)
        if (why := why_unknown(test)) is not None:
            return Unknown(why)
        return self.value(one.body if test else one.orelse, names)

    def of_listcomp(self, one: ast.ListComp | ast.GeneratorExp, names: dict[str, Any]) -> Any:
        rounds = self.rounds(one.generators, dict(names))
        if not isinstance(rounds, Unknown):
            return [self.value(one.elt, each) for each in rounds]
        inner = dict(names)
        for each in one.generators:
            self.assign(each.target, Unknown(f"an item of {rounds.why}"), inner)
        made = uncertain(self.value(one.elt, inner), rounds.why)
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
                    return Unknown(why_unknown(items) or COMPUTED)
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
                extended_by(
                    given, list(value) if isinstance(value, (list, tuple, range)) else [Unknown("a list")]
                )
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
            if (isinstance(into, Name) and into.name == "environ") or one.func.attr == "getenv":
                return Unknown(f"the environment variable {given[0] if given else ''}")
            if not isinstance(into, Name):
                return self.method(into, one.func.attr, given, named, one.lineno)
            called: Any = Name(one.func.attr)
        else:
            called = self.value(one.func, names)
        if isinstance(called, _Function):
            return self.call(called, tuple(given), named, one.lineno)
        if isinstance(called, Name):
            return self.known_call(called.name, given, named, one.lineno)
        return called if isinstance(called, Unknown) else Unknown(COMPUTED)

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
        every = [*perhaps, uncertain(result, later)]
        if any(one is not None and started(one) is None for one in every):
            return next((one for one in every if isinstance(one, Unknown)), Unknown(later or COMPUTED))
        actions = [one.actions if isinstance(one, Description) else one for one in every if one is not None]
        return Description(actions) if any(isinstance(one, Description) for one in every) else actions

    def method(self, into: Any, name: str, given: list[Any], named: Mapping[str, Any], line: int) -> Any:
        """The value of a call of a method of a value."""
        if isinstance(into, Unknown):
            return into
        if isinstance(into, Description) and name in ("add_action", "add_entity"):
            into.actions += [uncertain(one, self.why) for one in given[:1]]
            return None
        if isinstance(into, (Text, Variable, Computed)):
            if name == "perform":
                return self.resolve(into) if self.resolve is not None else into
            return Unknown(OF_THE_LAUNCH)
        if name in ("open", "read_text") and isinstance(into, str):
            return opened(into)
        if name == "joinpath" and isinstance(into, (str, Text)):
            return joined(between("/", [into, *given]))
        if name == "find" and isinstance(into, str) and into.startswith("$(find-pkg-share "):
            return share_of(given, named)
        if name in SAME_PATH and isinstance(into, (str, Text)):
            return into
        function = METHODS.get(type(into))
        if name in CHANGES and isinstance(into, (list, dict)):
            given = [*given[:-1], *(uncertain(one, self.why) for one in given[-1:])]
        if function is not None:
            return function(into, name, given, named)
        return Unknown(f"`.{name}()` of line {line}")

    def known_call(self, name: str, given: list[Any], named: dict[str, Any], line: int) -> Any:
        """The value of a call of what an import brings, or Python itself."""
        if name in SIMPLE:
            return simple_call(name, given, named)
        if name == "PythonExpression":
            return Computed(expression, parts_of(argument_of(given, named, 0, "expression")))
        if name in SUBSTITUTIONS:
            return SUBSTITUTIONS[name](given, named)
        if name in CONDITIONS:
            value = given[0] if given else named.get("predicate_expression")
            if name.startswith("Launch"):
                variable = argument_of(given, named, 0, "launch_configuration_name")
                expected = argument_of(given, named, 1, "expected_value")
                value = Computed("equals", (Variable(str(variable)), expected))
            return Condition(value, CONDITIONS[name])
        if name in SOURCES:
            return LaunchSource(given[0] if given else named.get("launch_file_path", named.get("location")))
        if name == "LaunchDescription":
            entities = given[0] if given else named.get("initial_entities")
            actions = entities if isinstance(entities, list) else listed(entities)
            flat = (one.actions if isinstance(one, Description) else [one] for one in actions)
            return Description([one for some in flat for one in some])
        if name in _OF_FILES and given:
            return self.file_call(name, given[0])
        if name == "OpaqueFunction":
            return self.opaque(given, named, line)
        if name in ACTIONS:
            return action_of(name, given, named, line)
        return Unknown(f"{name}()", line)

    def file_call(self, name: str, value: Any) -> Any:
        """The value of a call that opens a file, reads YAML or JSON from it, or writes a value as text."""
        if name == "open":
            return opened(value)
        if "dump" in name:
            return dumped(value)
        return self.load(value.file) if isinstance(value, Opened) else Unknown(f"{name}()")

    def opaque(self, given: list[Any], named: dict[str, Any], line: int) -> Any:
        function = named.get("function", given[0] if given else None)
        if not isinstance(function, _Function):
            return Unknown(f"the function of line {line}")
        more = named.get("args") or ()
        keywords = named.get("kwargs") or {}

        def run(known: Callable[[Any], Any]) -> Any:
            self.resolve = known
            try:
                values = (Name("context"), *(more if isinstance(more, (list, tuple)) else ()))
                found = self.call(function, values, keywords if isinstance(keywords, dict) else {}, line)
            except TooMuchError:
                return Unknown(f"the function of line {line}, which takes too many steps")
            finally:
                self.resolve = None
            return [] if found is None else found

        return Action("opaque", line, {"call": run}, condition_of(named))


def _loaded(target: ast.expr) -> ast.expr:
    found = ast.copy_location(ast.parse(ast.unparse(target), mode="eval").body, target)
    return ast.fix_missing_locations(found)


_OF_FILES = frozenset(
    ("open", "safe_load", "load", "full_load", "unsafe_load", "loads", "dump", "safe_dump", "dumps")
)
