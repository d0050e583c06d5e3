"""Writes pam_link.h from link.json: python3 clients/c/generate.py (with --check, only compares).

For each type of a message the header has a structure, a function that writes its bytes and one that reads them.
"""

import json
import re
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
LINK = json.loads((HERE.parent / "link.json").read_text(encoding="utf-8"))
LONGEST_BODY = 512
SCALARS = {"Bool": ("bool", "bool"), "U8": ("uint8_t", "u8"), "I8": ("int8_t", "i8"), "U16": ("uint16_t", "varint"), "U32": ("uint32_t", "varint"),
           "U64": ("uint64_t", "varint"), "F32": ("float", "f32")}
LIMITS = {"U16": "UINT16_MAX", "U32": "UINT32_MAX", "U64": "UINT64_MAX"}

done, out = {}, []


def snake(name):
    return re.sub(r"(?<!^)(?=[A-Z])", "_", name).lower()


def kind_of(schema):
    kind = schema["ty"]
    return (kind, None) if isinstance(kind, str) else next(iter(kind.items()))


def least(schema):
    """Fewest bytes of a value."""
    name, content = kind_of(schema)
    if name == "F32":
        return 4
    if name == "Struct":
        return sum(least(field["ty"]) for field in content)
    if name == "Tuple":
        return sum(map(least, content))
    return 0 if name == "Unit" else 1


def declaration(schema, field):
    """A member of a structure, and the types before it."""
    name, content = kind_of(schema)
    if name in SCALARS:
        return f"{SCALARS[name][0]} {field};"
    if name == "Option":
        return f"bool has_{field}; {declaration(content, field)}"
    if name == "Seq":
        most = min(256, LONGEST_BODY // max(1, least(content)))
        return f"uint16_t {field}_count; {declaration(content, f'{field}[{most}]')}"
    if name == "Tuple":
        return declaration(content[0], f"{field}[{len(content)}]")
    return f"pam_{emit(schema)} {field};"


def write(schema, place, depth=0):
    """Statements that write a value."""
    name, content = kind_of(schema)
    if name in SCALARS:
        return [f"pam_put_{SCALARS[name][1]}(w, {place});"]
    if name == "Option":
        parent, _, field = place.rpartition(".")
        has = f"{parent}.has_{field}"
        return [f"pam_put_bool(w, {has});", f"if ({has}) {{", *write(content, place, depth), "}"]
    if name == "Seq":
        most, i = min(256, LONGEST_BODY // max(1, least(content))), f"i{depth}"
        return [f"if ({place}_count > {most}) w->failed = true;", f"pam_put_varint(w, {place}_count);",
                f"for (unsigned {i} = 0; {i} < {place}_count && !w->failed; {i}++) {{",
                *write(content, f"{place}[{i}]", depth + 1), "}"]
    if name == "Tuple":
        i = f"i{depth}"
        return [f"for (unsigned {i} = 0; {i} < {len(content)}; {i}++) {{", *write(content[0], f"{place}[{i}]", depth + 1), "}"]
    return [f"pam_write_{emit(schema)}(w, &{place});"]


def read(schema, place, depth=0):
    """Statements that read a value."""
    name, content = kind_of(schema)
    if name in LIMITS:
        return [f"{place} = ({SCALARS[name][0]})pam_get_varint(r, {LIMITS[name]});"]
    if name in SCALARS:
        return [f"{place} = pam_get_{SCALARS[name][1]}(r);"]
    if name == "Option":
        parent, _, field = place.rpartition(".")
        has = f"{parent}.has_{field}"
        return [f"{has} = pam_get_bool(r);", f"if ({has}) {{", *read(content, place, depth), "}"]
    if name == "Seq":
        most, i = min(256, LONGEST_BODY // max(1, least(content))), f"i{depth}"
        return [f"{place}_count = (uint16_t)pam_get_varint(r, {most});",
                f"for (unsigned {i} = 0; {i} < {place}_count && !r->failed; {i}++) {{",
                *read(content, f"{place}[{i}]", depth + 1), "}"]
    if name == "Tuple":
        i = f"i{depth}"
        return [f"for (unsigned {i} = 0; {i} < {len(content)}; {i}++) {{", *read(content[0], f"{place}[{i}]", depth + 1), "}"]
    return [f"pam_read_{emit(schema)}(r, &{place});"]


def functions(name, writes, reads):
    out.append(f"static inline void pam_write_{name}(pam_writer *w, const pam_{name} *m) {{")
    out.extend("  " + line.replace("{m}", "(*m)") for line in writes or ["(void)w; (void)m;"])
    out.append("}")
    out.append(f"static inline void pam_read_{name}(pam_reader *r, pam_{name} *m) {{")
    out.extend("  " + line for line in reads or ["(void)r; (void)m;"])
    out.append("}\n")


def emit(schema):
    """Declares a structure or an enumeration once; gives its name."""
    name, (kind, content) = snake(schema["name"]), kind_of(schema)
    if name in done:
        if done[name] != schema:
            raise SystemExit(f"two types are called {name}")
        return name
    done[name] = schema
    if kind == "Struct":
        members = [declaration(field["ty"], field["name"]) for field in content]
        writes = [line for field in content for line in write(field["ty"], f"(*m).{field['name']}")]
        reads = [line for field in content for line in read(field["ty"], f"(*m).{field['name']}")]
        out.append(f"typedef struct {{ {' '.join(members)} }} pam_{name};")
        functions(name, writes, reads)
        return name
    if kind != "Enum":
        raise SystemExit(f"{name}: {kind} is not used on this link")
    upper = name.upper()
    labels = [f"PAM_{upper}_{snake(variant['name']).upper()}" for variant in content]
    if all(variant["ty"] == "UnitVariant" for variant in content):
        out.append(f"typedef enum {{ {', '.join(f'{label} = {n}' for n, label in enumerate(labels))} }} pam_{name};")
        functions(name, ["pam_put_varint(w, (uint64_t)*m);"], [f"*m = (pam_{name})pam_get_varint(r, {len(labels) - 1});"])
        return name
    members, writes, reads = [], ["pam_put_varint(w, (*m).kind);", "switch ((*m).kind) {"], []
    reads = [f"(*m).kind = (uint8_t)pam_get_varint(r, {len(labels) - 1});", "switch ((*m).kind) {"]
    for label, variant in zip(labels, content):
        if variant["ty"] == "UnitVariant":
            continue
        form, inner = next(iter(variant["ty"].items()))
        field = snake(variant["name"])
        if form == "NewtypeVariant":
            members.append(declaration(inner, field))
            parts = [(inner, f"(*m).{field}")]
        else:
            members.append("struct { " + " ".join(declaration(one["ty"], one["name"]) for one in inner) + f" }} {field};")
            parts = [(one["ty"], f"(*m).{field}.{one['name']}") for one in inner]
        writes += [f"case {label}: {{", *(line for one in parts for line in write(*one)), "break; }"]
        reads += [f"case {label}: {{", *(line for one in parts for line in read(*one)), "break; }"]
    out.append(f"enum {{ {', '.join(f'{label} = {n}' for n, label in enumerate(labels))} }};")
    out.append(f"typedef struct {{ uint8_t kind; {' '.join(members)} }} pam_{name};")
    functions(name, writes + ["default: break;", "}"], reads + ["default: break;", "}"])
    return name


def body(schema):
    """Name of a message's structure; none where a body is empty or a plain number."""
    kind, content = kind_of(schema)
    if kind == "Unit" or kind in SCALARS:
        return None
    if kind == "Option":
        return body(content)
    return emit(schema)


def text():
    lines = []
    for row in LINK["endpoints"]:
        request, response = body(row["request"]), body(row["response"])
        said = " → ".join(name and f"pam_{name}" or kind_of(row[key])[0].lower()
                          for name, key in ((request, "request"), (response, "response")))
        lines.append(f"#define PAM_{row['name'].upper()} {row['number']} /* {said} */")
    for topic in LINK["topics"]:
        lines.append(f"#define PAM_TOPIC_{topic['name'].upper()} {topic['number']} /* pam_{emit(topic['body'])} */")
    emit(LINK["refusal"])
    head = (HERE / "frame.h").read_text(encoding="utf-8")
    numbers = [f"#define PAM_LINK_VERSION {LINK['link_version']}", f"#define PAM_SCHEMA_HASH UINT64_C(0x{LINK['schema_hash']})"]
    return "\n".join(["/* Written by clients/c/generate.py from clients/link.json. */", "#ifndef PAM_LINK_H", "#define PAM_LINK_H", "",
                      head, *numbers, "", *lines, "", *out, "#endif", ""])


if __name__ == "__main__":
    path, header = HERE / "pam_link.h", text()
    if "--check" in sys.argv:
        sys.exit(0 if path.read_text(encoding="utf-8") == header else "clients/c/generate.py writes another pam_link.h")
    path.write_text(header, encoding="utf-8")
