# Sourced by ./cell: the three steps of the set-up. Each is skipped at once when its result is there.

venv="$root/.venv"

# What is set up: "run", all that a cell needs; "farm", what the farm needs too; or "test", what tests, checks,
# benches and documents need too.
scope=${scope:-run}

# Print a file of the scope, and those of larger scopes beside it: setup/NAME.txt, NAME_farm.txt, NAME_test.txt.
scope_files() {
  echo "setup/$1.txt"
  if [ "$scope" != run ] && [ -f "setup/$1_farm.txt" ]; then echo "setup/$1_farm.txt"; fi
  if [ "$scope" = test ]; then echo "setup/$1_test.txt"; fi
}

# Print the lines of a list without comments: files.
lines_of() { sed -e 's/#.*//' -e 's/[[:space:]]*$//' -e '/^$/d' "$@"; }

# Print the packages that are wanted, one a line.
wanted_packages() { lines_of $(scope_files apt); }

# Print name=version of those that are installed.
installed_packages() {
  wanted_packages | xargs dpkg-query -W -f '${Package}=${Version} ${db:Status-Status}\n' 2>/dev/null |
    sed -n 's/ installed$//p'
}

missing_packages() { grep -vxFf <(installed_packages | cut -d = -f 1) <(wanted_packages); }

# Run a command as root.
as_root() {
  if [ "$(id -u)" = 0 ]; then "$@"; else sudo "$@"; fi
}

apt_install() {
  local install=(env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends -o DPkg::Lock::Timeout=300 "$@")
  as_root "${install[@]}" && return 0
  # Not found or no longer there: the package lists are missing or old.
  as_root apt-get update -o DPkg::Lock::Timeout=300 && as_root "${install[@]}"
}

step_debian() {
  local missing
  mapfile -t missing < <(missing_packages)
  [ ${#missing[@]} -gt 0 ] || return 0
  if [ "$(id -u)" != 0 ]; then
    command -v sudo >/dev/null || refuse "Debian packages are missing and there is no sudo. As root: apt-get install ${missing[*]}"
    sudo -v || refuse "Debian packages are missing and sudo refused. As root: apt-get install ${missing[*]}"
  fi
  run_step 1/3 "Debian packages (${#missing[@]} of $(wanted_packages | wc -l))" "$logs/apt.log" \
    "Is this machine online, and does /etc/apt/sources.list name Debian 12 (main)? By hand: apt-get install ${missing[*]}" \
    apt_install "${missing[@]}"
}

# Print the lines of the requirements that the pins do not hold.
unpinned_requirements() {
  grep -vixFf <(sed 's/ .*//' $(scope_files pins)) <(lines_of $(scope_files requirements))
}

# Install what a file pins: name, and words for pip. Everything anew, for a package that is there
# already would not be compared with its hash.
install_pins() {
  local name=$1
  shift
  "$venv/bin/python" -m pip install --disable-pip-version-check --no-input --force-reinstall --no-deps \
    --only-binary :all: --require-hashes "$@" -r "setup/$name.txt"
}

# Make a .venv without libraries, unless there is one.
empty_venv() {
  [ -z "$(unpinned_requirements)" ] || return 1
  # A venv knows its own path: one that was moved or copied here is made anew.
  if ! grep -qsF "VIRTUAL_ENV=$venv" "$venv/bin/activate" && ! grep -qsF "VIRTUAL_ENV=\"$venv\"" "$venv/bin/activate" ||
    ! "$venv/bin/python" -m pip --version; then
    rm -rf "$venv"
    /usr/bin/python3 -m venv --system-site-packages "$venv" || return 1
  fi
  touch "$venv/CATKIN_IGNORE" # rospack and catkin shall not look inside
}

make_venv() { empty_venv && install_pins pins; }

# Add what a larger scope needs to the libraries that are there: farm or test. Python compiles what
# of them is imported, when it is; most of it never is.
add_libraries() {
  [ -z "$(unpinned_requirements)" ] && install_pins "pins_$1" --no-compile
}

# Print what to do when the libraries could not be installed: log file.
advise_python() {
  local wrong unpinned
  mapfile -t unpinned < <(unpinned_requirements)
  wrong=$(sed -n '/DO NOT MATCH THE HASHES/,$ s/^ *\([^ ]*==[^ ]*\) from .*/\1/p' "$1" | head -n 1)
  if [ ${#unpinned[@]} -gt 0 ]; then
    echo "setup/requirements.txt asks for ${unpinned[*]}, which setup/pins.txt does not hold. Nothing was installed." \
      "To pin it: /usr/bin/python3 setup/renew_pins.py"
  elif [ -n "$wrong" ]; then
    echo "The file that came for $wrong is not the one whose SHA-256 setup/pins.txt holds. Nothing was installed." \
      "Was pins.txt edited (git diff setup/pins.txt)? Does a mirror (PIP_INDEX_URL) hold another file? Try without it." \
      "If neither is so, do not install it: somebody may have changed the file."
  else
    echo "Is this machine online? A mirror is set with PIP_INDEX_URL. To start afresh: rm -rf .venv"
  fi
}

# Print the stamp of what a cell needs.
python_stamp() {
  { echo "$venv"; /usr/bin/python3 -V; cat setup/requirements.txt setup/pins.txt; } | hash_of
}

libraries_are_there() {
  [ -x "$venv/bin/python" ] && stamped "$venv/.cell-stamp" "$(python_stamp)"
}

# Where a cell's libraries are not there or other ones: nothing counts that was added to them.
step_venv() {
  libraries_are_there && return 0
  rm -f "$venv"/.cell-stamp*
  run_step 2/3 ".venv" "$logs/venv.log" advise_python empty_venv
}

step_python() {
  libraries_are_there && return 0
  run_step 2/3 "Python libraries in .venv" "$logs/pip.log" advise_python make_venv
  python_stamp >"$venv/.cell-stamp"
}

step_more_libraries() {
  [ "$scope" = run ] || step_libraries farm "of the farm"
  [ "$scope" != test ] || step_libraries test "of the tests"
}

# Add the libraries of a larger scope: its name, and in words.
step_libraries() {
  local stamp
  stamp=$({ python_stamp; cat "setup/requirements_$1.txt" "setup/pins_$1.txt"; } | hash_of)
  stamped "$venv/.cell-stamp-$1" "$stamp" && return 0
  run_step 2/3 "Python libraries $2 in .venv" "$logs/pip_$1.log" advise_python add_libraries "$1"
  echo "$stamp" >"$venv/.cell-stamp-$1"
}

# Print everything that asks for a new build when it changes.
build_inputs() {
  local -x LC_ALL=C # files in one order, whoever asks
  echo "$root"
  (scope=run && installed_packages) # what only tests need changes no build
  sha256sum CMakeLists.txt
  find config src \( -name package.xml -o -name CMakeLists.txt -o -name setup.py -o -name '*.msg' -o -name '*.srv' \
    -o -name '*.action' -o -name '*.cfg' -o -name '*.test' -o -name '*.c' \) -type f -print0 | sort -z | xargs -0 sha256sum
  find config src -path '*/nodes/*' -type f ! -name '*.py*' | sort
}

build_workspace() {
  local known
  known=$(sed -n 's/^CMAKE_HOME_DIRECTORY:INTERNAL=//p' build/CMakeCache.txt 2>/dev/null)
  if [ -n "$known" ] && [ "$known" != "$root" ]; then rm -rf build devel install; fi
  # What generates messages is Debian's, for pip fills .venv meanwhile: who loads a library that is half there
  # ends with a bus error. numpy, which Debian's does without, is nowhere else.
  mkdir -p build/debian_alone
  echo 'raise ImportError("not while .venv is filled")' >build/debian_alone/numpy.py
  local -x PYTHONPATH=$root/build/debian_alone:/usr/lib/python3/dist-packages${PYTHONPATH:+:$PYTHONPATH}
  # Messages for Python alone: nothing here is in C++ or Lisp. Who sets the variable decides.
  ROS_LANG_DISABLE=${ROS_LANG_DISABLE-gencpp:genlisp} cmake -S . -B build &&
    cmake --build build -- -j"$(nproc)"
}

step_build() {
  local stamp
  stamp=$(build_inputs | hash_of)
  [ "${1:-}" != always ] && [ -f devel/setup.bash ] && stamped build/.cell-stamp "$stamp" && return 0
  rm -f build/.cell-stamp
  run_step 3/3 "catkin build" "$logs/build.log" \
    "If the lines above do not tell why: ./cell clean, then ./cell build." build_workspace
  echo "$stamp" >build/.cell-stamp
}

# Make sure of everything. One at a time: a second start waits for the first.
ensure_setup() {
  local logs="$root/.setup_logs"
  check_machine
  check_folder
  mkdir -p "$logs"
  exec 9<"$root/cell"
  if ! flock -n 9; then
    echo "cell: another ./cell is setting up; waiting for it ..."
    flock 9
  fi
  step_debian
  step_venv
  # The build needs none of the libraries, and what farm and tests add none of a cell's: pip is one
  # process. The lock is held until all have ended, also where this shell is interrupted.
  local others code=0 pid
  rm -f "$logs"/beside_*.txt
  (step_build "${1:-}") >"$logs/beside_build.txt" 2>&1 &
  others=($!)
  if [ "$scope" != run ]; then
    step_more_libraries >"$logs/beside_more.txt" 2>&1 &
    others+=($!)
  fi
  (scope=run step_python) || code=$?
  for pid in "${others[@]}"; do wait "$pid" || code=$?; done
  cat "$logs"/beside_*.txt >&$((code == 0 ? 1 : 2))
  [ $code -eq 0 ] || exit "$code"
  exec 9<&-
}
