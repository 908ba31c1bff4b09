#!/bin/sh
# Looks at the unsafe code of crates/embree4-rs with the tools that are installed: Miri on what needs no Embree,
# AddressSanitizer with leak detection and valgrind on all tests. Ends with one line per tool: ok, FAILED or not run.
# Not part of scripts/test.sh: it needs a nightly toolchain and takes minutes. Tools write below target/.
#
#   rustup toolchain install nightly --component miri --component rust-src
#   apt-get install valgrind
set -u
cd "$(dirname "$0")/.." || exit 1

failed=0
summary=""
note() { summary="$summary$1
"; }
outcome() { # NAME STATUS
  if [ "$2" -eq 0 ]; then note "$1: ok"; else note "$1: FAILED"; failed=1; fi
}

# Library::find loads code, which Miri cannot: its tests are left out, and those in tests/ with them.
if cargo +nightly miri --version >/dev/null 2>&1; then
  cargo +nightly miri test -p embree4-rs --lib --target-dir target/miri -- --skip library::
  outcome "miri (callbacks, layouts, checks; no Embree)" $?
else
  note "miri: not run, no nightly toolchain with the component"
fi

# Sees what our side does with memory, and what nobody gives back. Embree itself is not instrumented.
host=$(rustc -vV | sed -n 's/^host: //p')
if cargo +nightly --version >/dev/null 2>&1; then
  ASAN_OPTIONS=detect_leaks=1 RUSTFLAGS=-Zsanitizer=address \
    cargo +nightly test -p embree4-rs --lib --tests --no-fail-fast --target "$host" --target-dir target/asan
  outcome "address sanitizer (all tests)" $?
else
  note "address sanitizer: not run, no nightly toolchain"
fi

# Sees also what Embree reads and writes, with the kernels for AVX2 or less: valgrind has no AVX-512.
if command -v valgrind >/dev/null; then
  binaries=$(cargo test -p embree4-rs --lib --tests --no-run 2>&1 | sed -n 's/^ *Executable .*(\(.*\))$/\1/p')
  status=0
  cd crates/embree4-rs || exit 1
  for binary in $binaries; do
    valgrind --quiet --error-exitcode=9 --suppressions=../../scripts/check_unsafe.supp "../../$binary" || status=1
  done
  outcome "valgrind (all tests)" "$status"
else
  note "valgrind: not run, not installed"
fi

printf '\n%s' "$summary"
exit "$failed"
