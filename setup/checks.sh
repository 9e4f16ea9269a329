# Sourced by ./cell: what ./cell check looks at. All checks run; the exit code says whether all passed.

checks_failed=0

# Run one check: title, command. Silent when it passes.
check() {
  local title=$1 start=$EPOCHREALTIME output code
  shift
  output=$("$@" 2>&1)
  code=$?
  printf '%-34s %s  %s s\n' "$title" "$([ $code -eq 0 ] && echo passed || echo FAILED)" \
    "$(awk -v a="$start" -v b="$EPOCHREALTIME" 'BEGIN { printf "%.1f", b - a }')"
  [ $code -eq 0 ] && return
  printf '%s\n' "$output" | sed 's/^/    /'
  checks_failed=1
}

# Print the modules of all packages, those that touch the world too.
all_modules() {
  find config/src src/*/src src/scara_course/exercises -name '*.py' | sort
}

check_xml() {
  local files=(config/package.xml src/*/package.xml)
  compgen -G 'src/*/urdf/*.urdf' >/dev/null && files+=(src/*/urdf/*.urdf)
  xmllint --noout "${files[@]}"
}

check_urdfs() {
  local file
  for file in src/*/urdf/*.urdf; do check_urdf "$file" || return 1; done
}

check_types() {
  local modules
  mapfile -t modules < <(all_modules)
  .venv/bin/mypy --no-error-summary "${modules[@]}"
}

run_checks() {
  check "format (ruff)" .venv/bin/ruff format --check --quiet .
  check "lint (ruff)" .venv/bin/ruff check --quiet .
  check "types of all modules (mypy)" check_types
  check "packages (catkin_lint)" catkin_lint --quiet -W1 --strict --ignore package_path_name config src
  check "XML (xmllint)" check_xml
  check "robot description (check_urdf)" check_urdfs
  check "unit tests (pytest)" .venv/bin/python -m pytest tests/unit -q --no-header -m "not slow" -p no:cacheprovider
  exit $checks_failed
}

# Build the packages of one ring alone, and test each against what was built.
check_ring() {
  local python=$root/.venv/bin/python build=$root/build/ring_$1 rooms room tests=()
  rooms=$(PYTHONPATH=tests:$PYTHONPATH "$python" -m harness.running.rooms "$1") || exit 2
  for room in $rooms; do [ ! -d "tests/unit/$room" ] || tests+=("tests/unit/$room"); done
  check "build of $(wc -w <<<"$rooms") packages alone" build_ring "$build" "$(tr '\n' ';' <<<"$rooms")"
  [ $checks_failed -eq 0 ] || exit 1
  set +u
  source "$root/setup/environment.sh"
  source "$build/devel/setup.bash" || exit 1
  set -u
  check "unit tests (pytest)" "$python" -m pytest "${tests[@]}" -q --no-header -m "not slow" -p no:cacheprovider
  exit $checks_failed
}

# Configure and build named packages in a folder of their own.
build_ring() {
  /usr/bin/cmake -S "$root" -B "$1" -DCATKIN_WHITELIST_PACKAGES="$2" -DCATKIN_DEVEL_PREFIX="$1/devel" &&
    /usr/bin/cmake --build "$1"
}
