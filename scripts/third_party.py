#!/usr/bin/env python3
"""Writes THIRD-PARTY.md: the crates that are linked into prt-batch, with their licences.

  scripts/third_party.py           writes the file
  scripts/third_party.py --check   fails when the file is not what it would write

Of crates with a choice of licences MIT is taken where it is offered, else Apache-2.0, else what there is.
"""

import collections
import json
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
OUTPUT = ROOT / "THIRD-PARTY.md"
# What the notices are made for: the platform that is built and tested.
PLATFORM = "x86_64-unknown-linux-gnu"
HEAD = """# Third-party notices

`prt-batch` is linked with the crates below ({count}, on Linux x86-64). This file is written by `scripts/third_party.py`.

Not linked and not shipped, but loaded when it is found: Intel Embree 4 with oneTBB (both Apache-2.0). `scripts/get-embree.sh`
fetches them on the user's machine, where their own notices lie beside them.

| crate | version | licence | taken as |
|---|---|---|---|
"""


def metadata():
    command = ["cargo", "metadata", "--format-version", "1", "--locked", "--filter-platform", PLATFORM]
    return json.loads(subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout)


def linked(data):
    """Packages that end up in the binary: normal dependencies, without macros, which only run at build time."""
    packages = {p["id"]: p for p in data["packages"]}
    nodes = {n["id"]: n for n in data["resolve"]["nodes"]}
    own = set(data["workspace_members"])
    stack, seen = [data["resolve"]["root"]], set()
    while stack:
        at = stack.pop()
        kinds = [kind for target in packages[at]["targets"] for kind in target["kind"]]
        if at in seen or "proc-macro" in kinds:
            continue
        seen.add(at)
        for dep in nodes[at]["deps"]:
            if any(kind["kind"] is None for kind in dep["dep_kinds"]):
                stack.append(dep["pkg"])
    return sorted((packages[i] for i in seen - own), key=lambda p: (p["name"], p["version"]))


def taken(licence):
    """The licence that is made use of, of an SPDX expression with `OR` or the older `/`."""
    if " AND " in licence:
        must, choice = licence.split(" AND ", 1)
        return f"{must} AND {taken(choice.strip('()'))}"
    choices = [c.strip() for c in re.split(r" OR |/", licence)]
    return next((wanted for wanted in ("MIT", "Apache-2.0") if wanted in choices), choices[0])


def texts(package, licence):
    """The files of the package that hold the licence taken, as text."""
    folder = pathlib.Path(package["manifest_path"]).parent
    files = sorted(p for p in folder.iterdir() if re.match(r"(?i)(licen[cs]e|copying|notice)", p.name) and p.is_file())
    short = {"MIT": "mit", "Apache-2.0": "apache", "BSD-3-Clause": "bsd", "Zlib": "zlib", "ISC": "isc"}
    names = [short[part] for part in re.split(r" AND ", licence) if part in short]
    fitting = [p for p in files if any(n in p.name.lower() for n in names)]
    # A file without a licence in its name holds the only one there is.
    plain = [p for p in files if re.fullmatch(r"(?i)(licen[cs]e|copying)(\.\w+)?", p.name)]
    return [p.read_text(encoding="utf-8").strip() for p in (fitting or plain or files)]


def document():
    packages = linked(metadata())
    rows, groups, missing = [], collections.OrderedDict(), []
    for package in packages:
        name, licence = f"{package['name']} {package['version']}", package["license"] or "see its files"
        choice = taken(licence)
        rows.append(f"| {package['name']} | {package['version']} | {licence} | {choice} |")
        found = texts(package, choice)
        if not found:
            missing.append(f"{name} ({choice}; its package holds no licence file)")
        for text in found:
            key = re.sub(r"\s+", " ", text)
            groups.setdefault(key, (text, []))[1].append(name)
    parts = [HEAD.format(count=len(packages)) + "\n".join(rows) + "\n"]
    if missing:
        parts.append("## Without a licence file of their own\n\n" + "\n".join(f"- {m}" for m in missing) + "\n")
    for text, names in groups.values():
        parts.append(f"## {', '.join(names)}\n\n```\n{text}\n```\n")
    return "\n".join(parts)


def main():
    arguments = sys.argv[1:]
    if arguments not in ([], ["--check"]):
        sys.exit(__doc__)
    text = document()
    if not arguments:
        OUTPUT.write_text(text, encoding="utf-8")
    elif not OUTPUT.exists() or OUTPUT.read_text(encoding="utf-8") != text:
        sys.exit("error: THIRD-PARTY.md is not up to date: run scripts/third_party.py")


if __name__ == "__main__":
    main()
