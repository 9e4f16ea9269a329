#!/usr/bin/env bash
# Start `./cell up`, open the operator's page as a browser does, press Ctrl-C, and see that the cell ends in order.
#   bash setup/up_once.sh [options of ./cell up]
# Exit code 0: the page answered and the cell ended by the signal.
set -uo pipefail
cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.." || exit 1
told=$(mktemp)
trap 'rm -f "$told"' EXIT
ready_within_s=600 # a first start installs everything

./cell up --no-browser "$@" >"$told" 2>&1 &
cell=$!
began=$SECONDS
until grep -q -i "robot's pendant" "$told"; do
  if ! kill -0 "$cell" 2>/dev/null || [ $((SECONDS - began)) -gt $ready_within_s ]; then
    cat "$told"
    echo "up_once: the cell did not come up" >&2
    kill -INT "$cell" 2>/dev/null
    exit 1
  fi
  sleep 0.2
done
address=$(grep -o 'http://[^ ]*' "$told" | grep -m 1 token)
code=0
/usr/bin/python3 - "$address" <<'END' || code=1
import sys, urllib.request

with urllib.request.urlopen(sys.argv[1], timeout=20.0) as answer:
    print(f"up_once: the operator's page answers with {answer.status}, {len(answer.read())} bytes")
END
kill -INT "$cell"
wait "$cell"
ended=$?
cat "$told"
# Ctrl-C is signal 2, and a shell tells it as 128 + 2.
[ $ended -eq 130 ] || { echo "up_once: the cell ended with code $ended, not by Ctrl-C" >&2 && code=1; }
echo "up_once: exit code $code after $((SECONDS - began)) s"
exit $code
