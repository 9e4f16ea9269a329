# Sourced by ./cell: show one line for each step, with its time; when it fails, its last lines and what to do.

# Run a step: number, title, log file, advice, command. The command's output goes to the log.
# Advice is a text, or a function that reads the log and prints one.
run_step() {
  local number=$1 title=$2 log=$3 advice=$4 start=$SECONDS
  shift 4
  printf '[%s] %s ... ' "$number" "$title"
  if "$@" >"$log" 2>&1 9>&-; then
    printf '%d s\n' $((SECONDS - start))
    return 0
  fi
  printf 'FAILED after %d s\n' $((SECONDS - start))
  [ "$(type -t "$advice")" != function ] || advice=$("$advice" "$log")
  {
    echo
    echo "The last lines of $log:"
    tail -n 25 "$log" | sed 's/^/    /'
    echo
    echo "cell: step \"$title\" failed. $advice"
  } >&2
  exit 1
}

# Say why nothing can be done here, and end.
refuse() {
  echo "cell: $*" >&2
  exit 1
}

# Print the SHA-256 of standard input.
hash_of() { sha256sum | cut -d ' ' -f 1; }

# Succeed if a stamp file holds exactly this text.
stamped() { [ "$(cat "$1" 2>/dev/null)" = "$2" ]; }
