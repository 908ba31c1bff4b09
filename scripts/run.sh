#!/usr/bin/env bash
# Builds prt-batch and runs it with all arguments: scripts/run.sh scenes/*.gltf --out renders/
# Paths are relative to the folder you are in. Embree is fetched once if that is possible; without it the in-house BVH
# traces the rays.
set -euo pipefail

project=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

if ! command -v cargo >/dev/null; then
  echo "error: cargo was not found: install Rust 1.95 or later from https://rustup.rs and open a new shell" >&2
  exit 2
fi
if [ -x "$project/scripts/get-embree.sh" ] && ! "$project/scripts/get-embree.sh" >/dev/null; then
  echo "note: Embree could not be fetched; the in-house BVH is used" >&2
fi

# In the project's folder, so that its toolchain and cargo settings hold; paths given by the user stay the user's.
quiet=--quiet
if [ ! -x "$project/target/release/prt-batch" ]; then
  echo "building prt-batch (once; a few minutes)" >&2
  quiet=
fi
(cd "$project" && cargo build --release --locked $quiet --bin prt-batch)
exec "$project/target/release/prt-batch" "$@"
