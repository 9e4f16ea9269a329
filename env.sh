# Source this in bash: a shell in which rosrun, rosservice, rostopic and rosbag know the workspace.
#   source env.sh
# It starts from a clean slate: another ROS, an activated venv or conda in the same shell do not leak in.
if [ -z "${BASH_VERSION:-}" ]; then
  echo "env.sh: is for bash: start bash first" >&2
  return 1 2>/dev/null || exit 1
fi
_cell_root=$(cd "$(/usr/bin/dirname "$(/usr/bin/readlink -f "${BASH_SOURCE[0]}")")" && pwd)
if [ ! -f "$_cell_root/devel/setup.bash" ]; then
  echo "env.sh: the workspace is not built yet: run ./cell build" >&2
  unset _cell_root
  return 1 2>/dev/null || exit 1
fi
source "$_cell_root/setup/environment.sh"
export CELL_ROOT="$_cell_root"
export ROS_MASTER_URI="${ROS_MASTER_URI:-http://127.0.0.1:11311}"
[ -n "${ROS_IP:-}${ROS_HOSTNAME:-}" ] || export ROS_IP=127.0.0.1
export ROS_PYTHON_VERSION=3
source "$_cell_root/devel/setup.bash"
unset _cell_root
