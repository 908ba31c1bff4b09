#!/usr/bin/env bash
# Every check that needs no second machine: unit and integration tests, then every scene rendered small with each EXR
# read whole by OpenImageIO. Under 15 minutes on two cores.
#   --long   also runs scripts/reference_check.sh, where it is there
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")/.."
long=
case "${1-}" in
  --long) long=1 ;;
  "") ;;
  *) echo "usage: scripts/test.sh [--long]" >&2; exit 2 ;;
esac
oiio=openimageio==3.2.2.0
summary=()
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

missing() { echo "error: $1" >&2; exit 2; }
command -v cargo >/dev/null || missing "cargo was not found: install Rust 1.95 or later from https://rustup.rs"
command -v cc >/dev/null || missing "no C compiler (cc) was found; Rust links with it: install gcc or clang"
command -v python3 >/dev/null || missing "python3 was not found; it brings OpenImageIO, which checks the EXR files"

echo "== Embree"
if [ -x scripts/get-embree.sh ] && scripts/get-embree.sh; then
  summary+=("embree: found")
else
  summary+=("embree: NOT FOUND, tests ran without it")
fi

echo "== OpenImageIO"
oiiotool=
if [ ! -x .venv/bin/python ]; then
  python3 -m venv .venv || missing "python3 -m venv failed: install python3-venv"
fi
if .venv/bin/python -c "import importlib.metadata as m, sys; sys.exit(m.version('openimageio') != '${oiio##*==}')" 2>/dev/null ||
  .venv/bin/python -m pip install --quiet --disable-pip-version-check "$oiio"; then
  oiiotool=$PWD/.venv/bin/oiiotool
elif [ "${CI-}" = true ]; then
  missing "$oiio could not be installed, and CI=true asks for the check by OpenImageIO"
else
  echo "skipped: $oiio could not be installed (offline?); EXR files are not checked by OpenImageIO"
fi

echo "== Notices of third parties"
scripts/third_party.py --check
summary+=("third-party notices: up to date")

echo "== cargo test"
cargo test --workspace --locked
summary+=("cargo test: passed")

echo "== Scenes"
shopt -s nullglob
scenes=(scenes/*.gltf scenes/*.glb)
if [ ${#scenes[@]} -eq 0 ]; then
  summary+=("scenes: there are none yet")
else
  # The dev profile is optimised and keeps the checks of debug builds.
  cargo build --locked --quiet --bin prt-batch
  "${CARGO_TARGET_DIR:-target}/debug/prt-batch" scenes --out "$work/renders" --size 64x36 --spp 2 --progress none
  pictures=()
  while IFS= read -r -d '' picture; do pictures+=("$picture"); done < <(find "$work/renders" -name '*.exr' -print0 | sort -z)
  if [ ${#pictures[@]} -lt ${#scenes[@]} ]; then
    echo "error: ${#scenes[@]} scenes gave only ${#pictures[@]} EXR files" >&2
    exit 1
  fi
  if [ -n "$oiiotool" ]; then
    for picture in "${pictures[@]}"; do
      # --stats reads every pixel.
      if ! "$oiiotool" --info -v --stats "$picture" >"$work/info" 2>&1; then
        echo "error: OpenImageIO cannot read $picture:" >&2
        cat "$work/info" >&2
        exit 1
      fi
      if ! grep -Eq 'Stats NanCount: (0 *)+$' "$work/info" || ! grep -Eq 'Stats InfCount: (0 *)+$' "$work/info"; then
        echo "error: $picture holds pixels that are not finite:" >&2
        grep -E 'Nan|Inf' "$work/info" >&2
        exit 1
      fi
    done
    summary+=("scenes: ${#pictures[@]} EXR files rendered and read whole by OpenImageIO")
  else
    summary+=("scenes: ${#pictures[@]} EXR files rendered, NOT checked by OpenImageIO")
  fi
fi

if [ -n "$long" ]; then
  echo "== Long checks"
  # GEO-01, BVH-01: of each of 14 kinds at every mesh and scene, so 3e5 (random, at edges, at vertices) at every scale of
  # the closed mesh, and over a million at each.
  cargo build --locked --quiet --release --bin prt-batch
  target/release/prt-batch verify hits --rays 100000
  target/release/prt-batch verify hits scenes/ --rays 100000
  summary+=("verify hits: passed")
  # The tables are what their generator makes, to the bit.
  cargo run --locked --quiet --release --example energy_tables -- --check
  # BSDF-01 to -05, -10.
  target/release/prt-batch verify materials --samples 1000000 --random 2000 --seed "$(date +%j)"
  summary+=("verify materials: passed")
  # LGT, ENV and INT: scenes with closed forms, by both backends where Embree is to be had.
  target/release/prt-batch verify light
  target/release/prt-batch verify light --accel bvh --seed "$(date +%j)"
  summary+=("verify light: passed")
  # SOR-02 and -04: the full numbers.
  target/release/prt-batch verify shapes --rays 40000 --random 1000 --seed "$(date +%j)"
  summary+=("verify shapes: passed")
  if [ -x scripts/reference_check.sh ]; then
    scripts/reference_check.sh
    summary+=("reference check: passed")
  else
    summary+=("reference check: there is none yet")
  fi
fi

echo
printf '%s\n' "${summary[@]}"
echo "all passed"
