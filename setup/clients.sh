# Sourced by ./cell: `./cell test --clients` runs other people's programs, each version in a venv of
# its own, against a live gateway, and writes what worked into docs/clients.md.

# Make the venv of each file in setup/clients, once.
ensure_clients() {
  local wanted folder
  for wanted in "$root"/setup/clients/*.txt; do
    folder=$root/.venv/clients/$(basename "$wanted" .txt)
    cmp -s "$wanted" "$folder/installed.txt" && continue
    echo "cell: installing $(basename "$wanted" .txt) into ${folder#"$root"/}"
    rm -rf "$folder"
    /usr/bin/python3 -m venv "$folder" &&
      "$folder/bin/python" -m pip install --quiet --disable-pip-version-check --no-input -r "$wanted" &&
      cp "$wanted" "$folder/installed.txt" || return 1
  done
}

run_clients() {
  ensure_clients || exit 1
  export CELL_CLIENTS_PAGE=$root/docs/clients.md
  exec "$root/.venv/bin/python" -m pytest tests/clients "$@"
}
