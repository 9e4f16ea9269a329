# Source this: a shell in which rosrun, rosservice, rostopic and rosbag know the workspace.
#   source env.sh
# Nothing is taken from an activated environment: nodes carry their interpreter in their devel wrappers.
_cell_root=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
if [ ! -f "$_cell_root/devel/setup.bash" ]; then
  echo "env.sh: the workspace is not built yet: run ./cell build" >&2
  return 1 2>/dev/null || exit 1
fi
# /usr/bin first: Debian's ROS tools must find Debian's python3, not another one on PATH.
export PATH="/usr/bin:$PATH"
export CELL_ROOT="$_cell_root"
export ROS_MASTER_URI="${ROS_MASTER_URI:-http://127.0.0.1:11311}"
export ROS_IP="${ROS_IP:-127.0.0.1}"
export ROS_PYTHON_VERSION=3
source "$_cell_root/devel/setup.bash"
unset _cell_root
