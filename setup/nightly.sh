# Sourced by ./cell: `./cell test --nightly` runs everything that is too long for the day, and writes docs/nightly.md.

# Run tests, other people's programs and mutants, each whatever fails before it: [--mutants N] [--page FILE]; other
# words go to pytest. Of the longer scenes and the searches a half is run, by turns. The exit code tells of all. What
# is a choice is not the night's report: without --page it goes to build/nightly.md.
run_nightly() {
  local page='' count=100 words=() choice=() tonight tests clients mutants
  while [ $# -gt 0 ]; do
    case $1 in
      --mutants) count=$2 && choice+=("$1 $2") && shift 2 ;;
      --page) page=$2 && shift 2 ;;
      *) words+=("$1") && choice+=("$1") && shift ;;
    esac
  done
  if [ -z "$page" ]; then
    page=$root/docs/nightly.md
    [ ${#choice[@]} -eq 0 ] || page=$root/build/nightly.md
  fi
  tonight=$(night begin) || exit 1
  # A file that cannot be imported fails, and the others are run.
  (export HYPOTHESIS_SEARCH=1 CELL_TEST_TURN=${tonight%% *} && run_tests --ignore=tests/clients --continue-on-collection-errors "${words[@]}")
  tests=$?
  # Whoever tests by day in this clone writes the same files.
  cp -f build/test_*.xml build/night/ 2>/dev/null
  (run_clients --junitxml=build/night/test_clients.xml "${words[@]}")
  clients=$?
  # shellcheck disable=SC2086 # its seed and its rooms are words
  (run_mutants --mutants "$count" ${tonight#* })
  mutants=$?
  night write --tests $tests --clients $clients --mutants $mutants --page "$page" --words="${choice[*]}"
  exit
}

night() { PYTHONPATH="$root/tests:$PYTHONPATH" "$root/.venv/bin/python" -m harness.running.nightly "$@"; }
