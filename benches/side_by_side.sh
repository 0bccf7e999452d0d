#!/usr/bin/env bash
# The kernels beside the anchors, in the same minute and on the same core: benches/side_by_side.sh ANCHORS_BUILD [CORE]
# ANCHORS_BUILD: the folder `setup.sh` of the anchors made (with build/ and venv/).
set -euo pipefail
anchors=$(realpath "${1:?folder made by setup.sh of the anchors}")
core=${2:-1}
cd "$(dirname "$0")/.."
build=$anchors/build
# Where these are set the anchors' scripts start themselves anew, and lose what they were to read from the pipe.
unset OPENBLAS_CORETYPE OPENBLAS_L2_SIZE
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
cargo build --quiet --release --package idim-benches --bin side_by_side

# The anchors' robot and a stack of rows, as their own scripts make them.
here=${ANCHORS_SOURCE:-../shared/anchors}
(cd "$here" && "$anchors/venv/bin/python" dump_model.py ur5 "$scratch/ur5.txt")
(cd "$here" && "$anchors/venv/bin/python" - "$scratch/w.bin" <<'PY'
import sys
import numpy as np, pinocchio as pin
from _common import load_model, rand_samples, base_columns
m = load_model("ur5"); d = m.createData()
def stack(n):
    q, v, a = rand_samples(6, n, 3)
    return np.vstack([pin.computeJointTorqueRegressor(m, d, *x) for x in zip(q, v, a)])
np.asfortranarray(stack(1000)[:, base_columns(stack(200))]).T.tofile(sys.argv[1])
PY
)

field() { sed -n "s/.*\"$1\":\([0-9.]*\).*/\1/p"; }
on_core() { taskset -c "$core" "$@"; }
pinocchio=$(on_core "$build/pin_native" "$scratch/ur5.txt" 5000 21 2>/dev/null | head -1 | field ns_min)
generated=$(on_core "$build/gb_ur5_base_8" 21 2>/dev/null | grep with_sincos | field ns_min || true)
eigen=$(on_core "$build/cond_eigen" "$scratch/w.bin" 6000 36 15 | grep SelfAdjoint | field ms_min)
on_core target/release/side_by_side | tee "$scratch/ours"
ours() { grep -F "$1" "$scratch/ours" | head -1 | sed 's/.*min *\([0-9.]*\).*/\1/'; }

echo
echo "anchors: Pinocchio C++ $pinocchio ns a sample, generated C of eight lanes ${generated:-not run} ns, Eigen Gram and eigenvalues $eigen ms"
awk -v p="$pinocchio" -v e="$eigen" -v b="$(ours 'regressor, base, batch')" \
  -v s="$(ours 'workspace kept')" -v c="$(ours 'states to cond, 1000 samples')" \
  -v g="$(ours 'log cond and its gradient, 1000 samples')" 'BEGIN {
    printf "%-44s %8.1f\n", "base regressor, batch: times Pinocchio C++", p / b
    printf "%-44s %8.1f\n", "base regressor, one sample: times", p / s
    printf "%-44s %8.1f\n", "cond of 1000 samples: times", (p * 1e-3 + e) / c
    printf "%-44s %8.2f\n", "gradient of log cond over its value", g / c
  }'
