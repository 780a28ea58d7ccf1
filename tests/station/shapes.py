"""shapes.py - whether what the station sends is as protocol.schema.json says."""

import json
import os
import re

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
with open(os.path.join(ROOT, "src", "station", "protocol.schema.json"), encoding="ascii") as _file:
    DOCUMENT = json.load(_file)

_TYPES = {
    "object": lambda v: isinstance(v, dict),
    "array": lambda v: isinstance(v, list),
    "string": lambda v: isinstance(v, str),
    "boolean": lambda v: isinstance(v, bool),
    "number": lambda v: isinstance(v, (int, float)) and not isinstance(v, bool),
    "integer": lambda v: isinstance(v, int) and not isinstance(v, bool),
}

# docs/protocol.md, "Formats of strings"
_FORMATS = {
    "uuid": r"[0-9a-fA-F]{8}(-[0-9a-fA-F]{4}){3}-[0-9a-fA-F]{12}",
    "sha256": r"[0-9a-f]{64}",
    "date-time": r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(\.\d+)?Z",
    "token": r"[A-Za-z0-9_]+",
    "name": r"[A-Za-z0-9_][A-Za-z0-9_-]*",
    "text": r"[^\x00-\x1f\x7f]*",
    "notes": r"[^\x00-\x08\x0b-\x1f\x7f]*",
}


def _resolve(schema):
    while "$ref" in schema:
        found = DOCUMENT
        for part in schema["$ref"].lstrip("#/").split("/"):
            found = found[part]
        schema = found
    return schema


def faults(schema, value, path=""):
    """Each place where the value is not as the schema says."""
    schema = _resolve(schema)
    for one in schema.get("anyOf", []):
        if _TYPES[_resolve(one)["type"]](value):
            schema = _resolve(one)
    if "anyOf" in schema:
        yield f"{path}: {value!r} is of none of the types"
        return
    if not _TYPES.get(schema.get("type"), lambda v: True)(value):
        yield f"{path}: {value!r} is no {schema['type']}"
        return
    if "enum" in schema and value not in schema["enum"]:
        yield f"{path}: {value!r} is none of {schema['enum']}"
    if isinstance(value, str):
        form = schema.get("format")
        if form in _FORMATS and not re.fullmatch(_FORMATS[form], value):
            yield f"{path}: {value[:80]!r} is no {form}"
        size = len(value.encode("utf-8"))
        if size < schema.get("minLength", 0) or size > schema.get("maxBytes", size):
            yield f"{path}: {size} bytes"
    elif isinstance(value, dict):
        yield from _member_faults(schema, value, path)
    elif isinstance(value, list):
        if len(value) < schema.get("minItems", 0) or len(value) > schema.get(
            "maxItems", len(value)
        ):
            yield f"{path}: {len(value)} items"
        for i, item in enumerate(value):
            yield from faults(schema.get("items", {}), item, f"{path}[{i}]")
    elif not isinstance(value, bool):
        if value < schema.get("minimum", value) or value > schema.get("maximum", value):
            yield f"{path}: {value!r} is out of range"


def _member_faults(schema, value, path):
    members = schema.get("properties")
    if members is None:  # any members
        return
    for name in schema.get("required", []):
        if name not in value:
            yield f"{path}.{name}: is missing"
    for name, part in value.items():
        if name in members:
            yield from faults(members[name], part, f"{path}.{name}")
        else:
            yield f"{path}.{name}: is not described"


def _schemas(kind, name, value):
    """What a message is held to: (schema, part of the message)."""
    if kind == "result" and name is not None:
        yield DOCUMENT["methods"][name]["result"], value
    elif kind == "error":
        yield DOCUMENT["$defs"]["error"], value
    elif kind == "notification":
        yield DOCUMENT["notifications"][name]["params"], value
        if name == "event":
            yield DOCUMENT["events"][value["topic"]][value["type"]]["data"], value["data"]


def check(kind, name, value):
    """For Client.check: fail where the message is not as described."""
    found = [f for schema, part in _schemas(kind, name, value) for f in faults(schema, part)]
    if kind == "error":
        found += list(_error_faults(name, value))
    if found:
        raise AssertionError(f"{kind} {name}: " + "; ".join(found[:10]))


def _error_faults(method, error):
    """What docs/protocol.md says of each reason."""
    reason = error["data"]["reason"]
    described = DOCUMENT["errors"].get(reason)
    if described is None:
        yield f"the reason {reason} is not described"
        return
    if (error["code"], error["data"]["retryable"]) != (described["code"], described["retryable"]):
        yield f"{reason}: code or retryable is not as described"
    if not error["data"]["hint"] or not error["message"]:
        yield f"{reason}: without hint or message"
