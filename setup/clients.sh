# Sourced by ./cell: `./cell test --clients` runs other people's programs, each version in an
# environment of its own, against a live gateway or robot, and writes what worked into docs/clients.md.

# Make the environment of each file in setup/clients, once: a venv for .txt, node_modules for .json.
ensure_clients() {
  local wanted folder
  for wanted in "$root"/setup/clients/*.txt "$root"/setup/clients/*.json; do
    folder=$(basename "$wanted")
    folder=$root/.venv/clients/${folder%.*}
    cmp -s "$wanted" "$folder/installed.txt" && continue
    echo "cell: installing $(basename "$folder") into ${folder#"$root"/}"
    rm -rf "$folder"
    if [[ $wanted = *.json ]]; then install_node_client "$wanted" "$folder"; else install_python_client "$wanted" "$folder"; fi &&
      cp "$wanted" "$folder/installed.txt" || return 1
  done
}

# A line "# Debian: PACKAGE ..." in a file names what the client needs besides, a line "# Source, for its own
# tests: NAME==VERSION" what is unpacked into the folder "source" as its authors have published it.
install_python_client() {
  local packages source
  source=$(sed -n 's/^# Source, for its own tests: //p' "$1")
  read -ra packages < <(sed -n 's/^# Debian: //p' "$1")
  [ ${#packages[@]} -eq 0 ] || dpkg-query --status "${packages[@]}" >/dev/null 2>&1 || apt_install "${packages[@]}" || return 1
  /usr/bin/python3 -m venv "$2" &&
    "$2/bin/python" -m pip install --quiet --disable-pip-version-check --no-input -r "$1" &&
    { [ -z "$source" ] || install_source "$2" "$source"; }
}

install_source() {
  "$1/bin/python" -m pip download --quiet --disable-pip-version-check --no-input --no-deps --no-binary :all: \
    --dest "$1/source" "$2" && tar -xzf "$1/source"/*.tar.gz -C "$1/source" --strip-components=1
}

# Node.js is needed for nothing else here: Debian's, unless there is one.
install_node_client() {
  command -v node >/dev/null && command -v npm >/dev/null || apt_install nodejs npm || return 1
  mkdir -p "$2" && cp "$1" "$2/package.json" &&
    npm install --prefix "$2" --loglevel error --ignore-scripts --omit=optional --no-audit --no-fund --no-update-notifier
}

run_clients() {
  ensure_clients || exit 1
  export CELL_CLIENTS_PAGE=$root/docs/clients.md
  exec "$root/.venv/bin/python" -m pytest tests/clients "$@"
}
