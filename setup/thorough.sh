# Sourced by ./cell: `./cell test --thorough` runs all tests, with new examples for the property
# searches, then mutants. These take --mutants N (0: all, hours), --seed N, --jobs N,
# --continue (go on where a run with the same seed was ended), and rooms.

# Install the library that makes mutants, once, beside the environment.
ensure_mutants() {
  local folder=$root/.venv/thorough wanted=$root/setup/requirements_thorough.txt
  cmp -s "$wanted" "$folder/installed.txt" && return
  echo "cell: installing what makes mutants into .venv/thorough"
  "$root/.venv/bin/python" -m pip install --quiet --disable-pip-version-check --no-input \
    --upgrade --target "$folder" -r "$wanted" && cp "$wanted" "$folder/installed.txt"
}

# Make mutants in the rooms of tests/mutants/rooms.yaml, and see which the tests kill.
run_mutants() {
  ensure_mutants || return 1
  PYTHONPATH="$root/tests:$PYTHONPATH:$root/.venv/thorough" \
    "$root/.venv/bin/python" -m harness.mutants "$@"
}

# Run everything, whatever fails first; the exit code tells of both. A search that fails prints how
# to repeat its example.
run_thorough() {
  local failed=0
  (export HYPOTHESIS_SEARCH=1 && run_tests) || failed=1
  (run_mutants "$@") || failed=1
  exit $failed
}
