# Sourced by ./cell: `./cell test --nightly` runs everything that is too long for the day, and writes docs/nightly.md.

# Run tests, other people's programs and mutants, each whatever fails before it: [--mutants N] [--page FILE];
# other words go to pytest. The exit code tells of all.
run_nightly() {
  local page=$root/docs/nightly.md count=100 words=() tonight tests clients mutants
  while [ $# -gt 0 ]; do
    case $1 in
      --mutants) count=$2 && shift 2 ;;
      --page) page=$2 && shift 2 ;;
      *) words+=("$1") && shift ;;
    esac
  done
  tonight=$(night begin) || exit 1
  # A file that cannot be imported fails, and the others are run.
  (export HYPOTHESIS_SEARCH=1 && run_tests --ignore=tests/clients --continue-on-collection-errors "${words[@]}")
  tests=$?
  (run_clients --junitxml=build/test_clients.xml "${words[@]}")
  clients=$?
  # shellcheck disable=SC2086 # its seed and its rooms are words
  (run_mutants --mutants "$count" $tonight)
  mutants=$?
  night write --tests $tests --clients $clients --mutants $mutants --page "$page"
  exit
}

night() { PYTHONPATH="$root/tests:$PYTHONPATH" "$root/.venv/bin/python" -m harness.running.nightly "$@"; }
