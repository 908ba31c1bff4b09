#!/bin/sh
# Renders the reference scenes with 32 seeds each and tests them for bias against closed forms and Mitsuba's pictures.
# Minutes on two cores. Options are passed on: scripts/reference_check.sh --scenes cornell --seeds 8; a wrong one lists them.
set -eu
cd "$(dirname "$0")/.."
exec cargo run --release --quiet --example reference_check -- "$@"
