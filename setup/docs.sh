# Sourced by ./cell: `./cell docs` builds the documents as a site.

# Build the site in build/docs, or show it while it is written: [--serve].
build_docs() {
  local mkdocs=("$root/.venv/bin/python" -m mkdocs)
  if [ "${1:-}" = --serve ]; then
    exec "${mkdocs[@]}" serve --config-file mkdocs.yml
  fi
  "${mkdocs[@]}" build --quiet --strict --config-file mkdocs.yml || exit 1
  echo "cell: the documents are a site: file://$root/build/docs/index.html"
}
