# Sourced by ./cell: `./cell test --clients` runs other people's programs, each version in an
# environment of its own, against a live gateway or robot, and writes what worked into docs/clients.md.

# Make the environment of each file in setup/clients, once: a venv for .txt, node_modules for .json, a catkin
# workspace for .git. One that cannot be had keeps no other from being made.
ensure_clients() {
  local wanted folder failed=0
  for wanted in "$root"/setup/clients/*.{txt,json,git}; do
    [ -e "$wanted" ] || continue
    folder=$(basename "$wanted")
    folder=$root/.venv/clients/${folder%.*}
    cmp -s "$wanted" "$folder/installed.txt" && continue
    echo "cell: installing $(basename "$folder") into ${folder#"$root"/}"
    rm -rf "$folder"
    case $wanted in
      *.json) install_node_client "$wanted" "$folder" ;;
      *.git) install_workspace "$wanted" "$folder" ;;
      *) install_python_client "$wanted" "$folder" ;;
    esac && cp "$wanted" "$folder/installed.txt" && continue
    echo "cell: $(basename "$folder") cannot be installed here: its tests are skipped or fail" >&2
    failed=1
  done
  return $failed
}

# Install Debian's packages that a line "# Debian: PACKAGE ..." of a file names.
install_debian() {
  local packages
  read -ra packages < <(sed -n 's/^# Debian: //p' "$1")
  [ ${#packages[@]} -eq 0 ] || dpkg-query --status "${packages[@]}" >/dev/null 2>&1 || apt_install "${packages[@]}"
}

# A line "# Source, for its own tests: NAME==VERSION" in a file names what is unpacked into the folder "source" as
# its authors have published it.
install_python_client() {
  local source
  source=$(sed -n 's/^# Source, for its own tests: //p' "$1")
  install_debian "$1" && /usr/bin/python3 -m venv "$2" &&
    install_libraries "$2/bin/python" -r "$1" &&
    { [ -z "$source" ] || install_source "$2" "$source"; }
}

# Install into a venv: its interpreter, what to install.
install_libraries() {
  "$1" -m pip install --quiet --disable-pip-version-check --no-input "${@:2}"
}

install_source() {
  "$1/bin/python" -m pip download --quiet --disable-pip-version-check --no-input --no-deps --no-binary :all: \
    --dest "$1/source" "$2" && tar -xzf "$1/source"/*.tar.gz -C "$1/source" --strip-components=1
}

# A line "ADDRESS COMMIT" of a file names a repository, a line "# PyPI: NAME==VERSION ..." what its nodes import besides:
# Debian's packages of these would stand in the way of our own libraries. Its build knows nothing of our workspace.
install_workspace() {
  local address commit source libraries python=/usr/bin/python3
  install_debian "$1" || return 1
  read -ra libraries < <(sed -n 's/^# PyPI: //p' "$1")
  if [ ${#libraries[@]} -gt 0 ]; then
    python=$2/venv/bin/python
    /usr/bin/python3 -m venv --system-site-packages "$2/venv" && install_libraries "$python" "${libraries[@]}" || return 1
  fi
  while read -r address commit; do
    source=$2/src/$(basename "$address")
    git clone --quiet --no-checkout "$address" "$source" && git -C "$source" checkout --quiet "$commit" || return 1
  done < <(grep -v '^#' "$1")
  env -i HOME="$HOME" PATH=/usr/bin:/bin catkin_make -C "$2" -DPYTHON_EXECUTABLE="$python" \
    -DCATKIN_ENABLE_TESTING=OFF >"$2/build.log" 2>&1 || { tail -n 25 "$2/build.log" >&2 && return 1; }
}

# Node.js is needed for nothing else here: Debian's, unless there is one.
install_node_client() {
  command -v node >/dev/null && command -v npm >/dev/null || apt_install nodejs npm || return 1
  mkdir -p "$2" && cp "$1" "$2/package.json" &&
    npm install --prefix "$2" --loglevel error --ignore-scripts --omit=optional --no-audit --no-fund --no-update-notifier
}

run_clients() {
  local failed=0
  ensure_clients || failed=1
  export CELL_CLIENTS_PAGE=$root/docs/clients.md
  "$root/.venv/bin/python" -m pytest tests/clients "$@" || failed=1
  exit $failed
}
