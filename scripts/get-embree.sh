#!/bin/sh
# Brings the Embree 4.4.0 library (with its TBB) into <project>/.embree/lib, where prt-batch looks for it.
# Uses pip; nothing is installed outside the project. Does nothing when an Embree is there already.
# Always exits 0: without Embree the built-in ray kernel is used.

VERSION=4.4.0.post1
# The wheel for this one CPython serves any Python: only the two libraries in it are used, never its
# Python modules. Their names carry hashes and must not change: the one finds the other by its name.
PYTHON_TAG=311
SHA256=2cd0f7d5c6342e6247e31f700761689cae7829454d8c6de0c41e62124a023e1f

say() { echo "get-embree: $*"; }
give_up() {
    say "$*"
    say "Embree is optional: prt-batch works without it."
    exit 0
}
has_embree() {
    for file in "$1"/libembree4*.so* "$1"/lib/libembree4*.so* "$1"/lib64/libembree4*.so* "$1"/embreex.libs/libembree4*.so*; do
        if [ -f "$file" ]; then return 0; fi
    done
    return 1
}

project=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd) || give_up "cannot find the project folder."
target="$project/.embree"

if [ -n "${EMBREE_DIR:-}" ]; then
    if has_embree "$EMBREE_DIR"; then
        say "EMBREE_DIR=$EMBREE_DIR has an Embree 4, nothing to do."
        exit 0
    fi
    say "EMBREE_DIR=$EMBREE_DIR holds no libembree4*.so*, going on."
fi
if has_embree "$target"; then
    say "$target has an Embree 4, nothing to do."
    exit 0
fi

system=$(uname -s 2>/dev/null)-$(uname -m 2>/dev/null)
if [ "$system" = Linux-x86_64 ]; then
    if (PATH="$PATH:/sbin:/usr/sbin"; ldconfig -p 2>/dev/null) | grep -q 'libembree4\.so'; then
        say "the system has an Embree 4 (libembree4.so), nothing to do."
        exit 0
    fi
else
    give_up "only for Linux-x86_64, this is $system. Set EMBREE_DIR to an Embree 4 of your own."
fi
command -v python3 >/dev/null 2>&1 || give_up "no python3, whose pip brings the library."

# A temporary folder beside the target, so that the last step is a rename in one file system.
work=$(mktemp -d "$project/.embree.tmp.XXXXXX") || give_up "cannot write to $project."
trap 'rm -rf "$work"' EXIT
trap 'exit 0' HUP INT TERM

python=python3
if ! python3 -m pip --version >/dev/null 2>&1; then
    python3 -m venv "$work/venv" >/dev/null 2>&1 || give_up "python3 has neither pip nor venv."
    python="$work/venv/bin/python3"
fi

echo "embreex==$VERSION --hash=sha256:$SHA256" >"$work/requirements.txt"
if ! "$python" -m pip --disable-pip-version-check --no-input download --quiet --no-deps --require-hashes \
    --only-binary :all: --implementation cp --python-version "$PYTHON_TAG" --abi "cp$PYTHON_TAG" \
    --platform manylinux_2_28_x86_64 --platform manylinux_2_27_x86_64 \
    --retries 1 --timeout 15 --dest "$work/wheel" --requirement "$work/requirements.txt" 2>"$work/log"; then
    sed 's/^/get-embree: pip: /' "$work/log" | tail -n 3
    give_up "pip could not bring embreex $VERSION (offline?)."
fi

"$python" - "$work" "$project/LICENSE-APACHE" <<'PYTHON' || give_up "the downloaded wheel could not be unpacked."
import glob, os, sys, zipfile

work, apache = sys.argv[1:]
out = os.path.join(work, "embree")
kept = {}
for wheel in glob.glob(os.path.join(work, "wheel", "*.whl")):
    with zipfile.ZipFile(wheel) as archive:
        for name in archive.namelist():
            base = os.path.basename(name)
            if name.startswith("embreex.libs/") and ".so" in base:
                kept[os.path.join("lib", base)] = archive.read(name)
            elif "/licenses/" in name and base:
                kept[os.path.join("licenses", "embreex-" + base)] = archive.read(name)
libraries = [name for name in kept if name.startswith("lib" + os.sep)]
if not any("libembree4" in name for name in libraries) or not any("libtbb" in name for name in libraries):
    sys.exit("no libembree4 and libtbb in the wheel")
kept["README.txt"] = b"""Embree 4.4.0 and oneTBB, from the Python package embreex.
Both libraries: Copyright Intel Corporation, Apache License 2.0 (licenses/Apache-2.0.txt).
licenses/embreex-LICENSE is the licence of the package that carries them.
"""
with open(apache, "rb") as file:
    kept[os.path.join("licenses", "Apache-2.0.txt")] = file.read()
for name, data in kept.items():
    path = os.path.join(out, name)
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "wb") as file:
        file.write(data)
PYTHON

# Whatever is at the target holds no Embree (checked above); keep it if it is not empty.
if [ -d "$target" ] && ! rmdir "$target" 2>/dev/null; then
    give_up "$target exists without an Embree in it and is not empty; remove it and run this again."
fi
mv "$work/embree" "$target" || give_up "cannot move the library to $target."
say "Embree 4.4.0 and its TBB are in $target/lib."
exit 0
