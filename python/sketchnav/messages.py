"""Messages as annotated classes, and the channels that carry them.

Messages are accessed in place in memory. A message, and every array in it, is valid until the method that received it returns.
To keep something, copy it with `message.copy()` or `numpy.array(message.ranges_m)`.
"""

import enum
import json
import struct
import typing
from collections.abc import Iterable
from typing import Annotated, Any, Generic, Self, TypeVar

from . import _core


class _Number:
    """The type of a field that is a number."""

    def __init__(self, name, form):
        self.name, self.form = name, struct.Struct("<" + form)

    def __repr__(self):
        return self.name


_NUMBERS = {name: _Number(name, form) for name, form in [("u32", "I"), ("u64", "Q"), ("f32", "f"), ("f64", "d")]}

#: Types of numbers in messages.
u32 = Annotated[int, _NUMBERS["u32"]]
u64 = Annotated[int, _NUMBERS["u64"]]
f32 = Annotated[float, _NUMBERS["f32"]]
f64 = Annotated[float, _NUMBERS["f64"]]


class Text:
    """Text of at most this many bytes in UTF-8: `name: Annotated[str, Text(32)]`."""

    def __init__(self, size: int):
        self.size = size


class Array:
    """An array: `at_m: Annotated[memoryview, Array(f64, 2)]`.

    With `count`, it is a list, and the field of that name is the number of entries in use.
    """

    def __init__(self, element: Any, length: int, count: str | None = None):
        self.element, self.length, self.count = element, length, count


class Count:
    """Counts the entries of a list that are in use: `wall_count: Annotated[u32, Count()]`."""


class Zero:
    """Always zero, in place of padding: `reserved: Annotated[u32, Zero()]`."""


class Code:
    """The number of a value of an enumeration: `state: Annotated[u32, Code(State)]`."""

    def __init__(self, values: type[enum.IntEnum]):
        self.values = values


def _kind(hint, place):
    """The type, the words after it and the comment of a field, from its annotation."""
    words = list(getattr(hint, "__metadata__", ()))
    base = hint.__origin__ if words else hint
    kind, way, doc = None, "itself", []
    for word in words:
        if isinstance(word, _Number):
            kind = word.name
        elif isinstance(word, Text):
            kind = {"text": word.size}
        elif isinstance(word, Array):
            kind = {"array": [_kind(word.element, place)[0], word.length]}
            way = {"counted": word.count} if word.count else way
        elif isinstance(word, (Count, Zero)):
            way = type(word).__name__.lower()
        elif isinstance(word, Code):
            way = {"code": [[_camel(value.name), value.value, ""] for value in word.values]}
        elif isinstance(word, str):
            doc += word.splitlines()
        else:
            raise TypeError(f"{place}: expected a type, a comment or words of sketchnav, found {word!r}")
    if kind is None and isinstance(base, type) and issubclass(base, Part):
        common = {PoseM: "pose_m", PosePx: "pose_px", Twist: "twist"}.get(base)
        kind = common or {"part": base._struct()}
    if kind is None:
        raise TypeError(f"{place}: expected a type such as f64 or Annotated[str, Text(32)], found {base!r}")
    return kind, way, doc


def _camel(name):
    return "".join(word.capitalize() for word in name.split("_"))


class _Field:
    """A field of messages of one layout, read and written in place."""

    def __init__(self, name, offset, kind, role, place):
        self.name, self.offset, self.place = name, offset, place
        self.kind, self.size, self.struct = kind, _size(kind), None
        self.count = role["counted"] if isinstance(role, dict) and "counted" in role else None
        self.number = _NUMBERS.get(kind) if isinstance(kind, str) else None
        self.element = kind["array"] if isinstance(kind, dict) and "array" in kind else None
        if self.element or (isinstance(kind, dict) and "struct" in kind):
            inner = self.element[0] if self.element else kind
            while isinstance(inner, dict) and "array" in inner:
                inner = inner["array"][0]
            self.struct = _class_of(inner["struct"]) if isinstance(inner, dict) and "struct" in inner else None

    def __get__(self, message, owner=None):
        if message is None:
            return self
        memory, offset = message._memory, self.offset
        if self.number:
            return self.number.form.unpack_from(memory, offset)[0]
        part = memory[offset : offset + self.size]
        if self.element:
            return self._entries(message, part)
        if self.struct:
            return self.struct._of(part)
        return bytes(part).split(b"\0", 1)[0].decode(errors="replace")

    def _entries(self, message, part):
        element, length = self.element
        if self.count:
            length = min(getattr(message, self.count), length)
            part = part[: length * _size(element)]
        if self.struct:
            size = _size(element)
            return [self.struct._of(part[i * size : (i + 1) * size]) for i in range(length)]
        if isinstance(element, dict) and "text" in element:
            size = element["text"]
            return [bytes(part[i * size : (i + 1) * size]).split(b"\0", 1)[0].decode() for i in range(length)]
        if isinstance(element, dict):
            inner, width = element["array"]
            return part.cast(_NUMBERS[inner].form.format[1:], (length, width)) if length else part[:0]
        return part.cast(_NUMBERS[element].form.format[1:])

    def __set__(self, message, value):
        memory, offset = message._memory, self.offset
        try:
            if self.number:
                self.number.form.pack_into(memory, offset, value)
            elif self.element:
                self._set_entries(message, value)
            elif self.struct:
                self.struct._of(memory[offset : offset + self.size])._set(value)
            else:
                text = _cut(str(value), self.size)
                memory[offset : offset + self.size] = text.ljust(self.size, b"\0")
        except (struct.error, TypeError, ValueError) as error:
            raise ValueError(f"{self.place}.{self.name}: {error} (given {value!r})") from None

    def _set_entries(self, message, value):
        element, length = self.element
        found = len(value)
        if found > length or (found < length and not self.count):
            expected = f"at most {length}" if self.count else f"{length}"
            raise ValueError(f"expected {expected} entries, found {found}")
        part = message._memory[self.offset : self.offset + self.size]
        if self.struct:
            size = _size(element)
            for i, entry in enumerate(value):
                self.struct._of(part[i * size : (i + 1) * size])._set(entry)
        elif isinstance(element, str):
            entries = part.cast(_NUMBERS[element].form.format[1:])
            entries[:found] = _numbers(value, element)
        elif "array" in element:
            flat = [number for entry in value for number in entry]
            entries = part.cast(_NUMBERS[element["array"][0]].form.format[1:])
            entries[: len(flat)] = _numbers(flat, element["array"][0])
        else:
            size = element["text"]
            for i, entry in enumerate(value):
                part[i * size : (i + 1) * size] = _cut(str(entry), size).ljust(size, b"\0")
        if self.count:
            setattr(message, self.count, found)


def _numbers(value, kind):
    """The numbers as memory of their type, which is the caller's own memory if it already has that type."""
    form = _NUMBERS[kind].form.format[1:]
    try:
        view = memoryview(value)
        if view.format in (form, "<" + form) and view.ndim == 1 and view.c_contiguous:
            return view if view.format == form else view.cast("B").cast(form)
    except TypeError:
        pass
    return memoryview(struct.pack(f"<{len(value)}{form}", *value)).cast(form)


def _cut(text, size):
    """The bytes of a text, truncated at a character boundary."""
    return text.encode()[:size].decode(errors="ignore").encode()


def _size(kind):
    if isinstance(kind, str):
        return _NUMBERS[kind].form.size
    if "text" in kind:
        return kind["text"]
    if "array" in kind:
        return _size(kind["array"][0]) * kind["array"][1]
    return kind["struct"]["size"]


class _Slotted(type):
    """Restricts the attributes of classes to their fields, so that a misspelt one is an error."""

    def __new__(cls, name, bases, namespace, **given):
        namespace.setdefault("__slots__", ())
        return super().__new__(cls, name, bases, namespace, **given)


class Part(metaclass=_Slotted):
    """A struct in messages: a class with annotated fields."""

    __slots__ = ("_memory",)
    _memory: memoryview
    _layout: typing.ClassVar[Any] = None

    @classmethod
    def _of(cls, memory):
        part = cls.__new__(cls)
        part._memory = memory
        return part

    @classmethod
    def _struct(cls):
        """The declaration of the class."""
        hints = typing.get_type_hints(cls, include_extras=True)
        fields = []
        for name in cls.__dict__.get("_declared", ()):
            kind, way, doc = _kind(hints[name], f"{cls.__name__}.{name}")
            fields.append({"name": name, "doc": doc, "kind": kind, "way": way})
        doc = cls.__dict__.get("_doc") or ""
        return {"name": cls.__name__, "doc": [line.strip() for line in doc.strip().splitlines()], "fields": fields}

    def __init_subclass__(cls, **given):
        super().__init_subclass__(**given)
        cls._declared = tuple(cls.__dict__.get("__annotations__", ()))
        cls._doc = cls.__dict__.get("__doc__")
        for name in cls._declared:
            if name in cls.__dict__ and not isinstance(cls.__dict__[name], _Field):
                raise TypeError(f"{cls.__name__}.{name}: expected no default, because a message is zero before it is filled")

    @classmethod
    def _lay_out(cls, layout):
        """Creates the fields according to the layout in memory."""
        if cls.__dict__.get("_layout") is not None:
            return
        for field in layout["fields"]:
            name = field["name"]
            if _struct_of(field["kind"]) is not None and cls._declared:
                _lay_out_part(cls, name, _struct_of(field["kind"]))
            setattr(cls, name, _Field(name, field["offset"], field["kind"], field["role"], cls.__name__))
        cls._layout = layout

    def _set(self, values):
        """Sets fields, from a mapping or from a part of the same type."""
        if isinstance(values, Part):
            self._memory[:] = values._memory
            return
        for name, value in values.items():
            if not isinstance(getattr(type(self), name, None), _Field):
                names = ", ".join(field["name"] for field in type(self)._layout["fields"])
                raise TypeError(f"{type(self).__name__}: expected one of {names}, found {name!r}")
            setattr(self, name, value)

    def copy(self) -> Self:
        """A copy, which can be kept."""
        return type(self)._of(memoryview(bytearray(self._memory)))

    def __bytes__(self):
        return bytes(self._memory)

    def __eq__(self, other):
        return type(self) is type(other) and bytes(self) == bytes(other)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self):
        fields = ", ".join(f"{field['name']}={_shown(getattr(self, field['name']))}" for field in type(self)._layout["fields"])
        return f"{type(self).__name__}({fields})"


def _shown(value):
    return repr(value.tolist()) if isinstance(value, memoryview) else repr(value)


def _struct_of(kind):
    while isinstance(kind, dict) and "array" in kind:
        kind = kind["array"][0]
    return kind["struct"] if isinstance(kind, dict) and "struct" in kind else None


_CLASSES: dict[str, type[Part]] = {}


def _lay_out_part(cls, name, layout):
    """Creates the fields of a part that the author has declared as a separate class."""
    hint = typing.get_type_hints(cls, include_extras=True).get(name)
    for word in getattr(hint, "__metadata__", ()):
        while isinstance(word, Array):
            hint = word.element
            word = next((word for word in getattr(hint, "__metadata__", ()) if isinstance(word, Array)), None)
    hint = getattr(hint, "__origin__", hint)
    if isinstance(hint, type) and issubclass(hint, Part):
        hint._lay_out(layout)
        _CLASSES[layout["name"]] = hint


def _class_of(layout):
    """The class of a struct. For a struct of the program, it is created when it is first needed."""
    name = layout["name"]
    if name not in _CLASSES:
        _CLASSES[name] = _Slotted(name, (Part,), {})
    _CLASSES[name]._lay_out(layout)
    return _CLASSES[name]


class Header(Part):
    """Begins every message: its number `seq`, its time `stamp_ns`, and the number of the tick that caused it, `source_seq`."""


class PoseM(Part):
    """A pose in metres: `x_m`, `y_m` and the heading as `orientation_z` and `orientation_w`."""


class PosePx(Part):
    """A pose in pixels of a drawing."""


class Twist(Part):
    """A velocity in the robot's own axes: `vx_mps`, `vy_mps`, `yaw_rate_radps`."""


_CLASSES.update(Header=Header, PoseM=PoseM, PosePx=PosePx, Twist=Twist)


class Message(Part):
    """A message: a class with annotated fields, which states its version and its frame.

    It begins with a `header`, which you don't declare. The fields are stored in their order and must not leave gaps, so
    declare large ones first.
    """

    def __init_subclass__(cls, *, version=1, frame="", **given):
        super().__init_subclass__(**given)
        cls._version, cls._frame = version, frame

    @classmethod
    def _declaration(cls):
        return {"body": cls._struct(), "version": cls._version, "frame": cls._frame}


_M = TypeVar("_M", bound="Message")


class Channel(Generic[_M]):
    """A channel of a navigator's own, written only by the process `writer` and read by the processes `readers`.

    The role is `situation` (the localizer's answer to each tick, one per navigator), `instruction` (the sketcher's, latched) or
    `detail`. At most `per_tick` messages are sent between two ticks, each with at most `max_cells` bytes after it.
    """

    def __init__(
        self,
        name: str,
        message: type[_M],
        *,
        role: str,
        writer: str,
        readers: Iterable[str],
        per_tick: int = 1,
        max_cells: int = 0,
    ):
        self.name, self.message, self._number = name, message, None
        self._row = dict(name=name, role=role, writer=writer, readers=list(readers), per_tick=per_tick, max_cells=max_cells)

    def _declare(self, kind):
        text = json.dumps({**self._row, "kind": kind, "message": self.message._declaration()})
        self._number = _core.declare(text)
        self.message._lay_out(json.loads(_core.layout(self._number)))
        return self._number

    def _found(self):
        if self._number is None:
            raise RuntimeError(f"channel {self.name!r}: expected one of the navigator's `channels`")
        return self._number

    @property
    def definition(self) -> str:
        """The `.msg` text of its messages, and the texts that it needs."""
        return _core.schema(self._found())

    def __repr__(self):
        return f"Channel({self.name!r})"


class _Common(Channel):
    """A channel that all navigators have."""

    def __init__(self, name):
        self.name, self._number = name, _core.find(name)
        layout = json.loads(_core.layout(self._number))
        self.message = _Slotted(layout["name"], (Message,), {})
        self.message._lay_out(layout)
        _CLASSES.setdefault(layout["name"], self.message)
