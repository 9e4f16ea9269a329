# Sourced by ./cell: what this machine and this folder have to be, said before anything is installed.

os_release=/etc/os-release

check_machine() {
  local id="" version="" name=""
  if [ -r "$os_release" ]; then
    id=$(. "$os_release" && echo "${ID:-}")
    version=$(. "$os_release" && echo "${VERSION_ID:-}")
    name=$(. "$os_release" && echo "${PRETTY_NAME:-}")
  fi
  [ "$id" = debian ] && [ "$version" = 12 ] ||
    refuse "this needs Debian 12 (bookworm), which carries ROS 1 and Python 3.11; this machine runs ${name:-an unknown system}." \
      "A container or a virtual machine with Debian 12 does."
  [ "$(dpkg --print-architecture)" = amd64 ] ||
    refuse "this needs an amd64 machine (the physics library has ready wheels for no other); this one is $(dpkg --print-architecture)."
  if [ -x /usr/bin/python3 ]; then
    local python
    python=$(/usr/bin/python3 -c 'import sys; print("%d.%d" % sys.version_info[:2])')
    [ "$python" = 3.11 ] || refuse "/usr/bin/python3 is Python $python; Debian 12's own is 3.11, and rospy is built for that one." \
      "Restore Debian's python3 (another one may stand elsewhere on PATH)."
  fi
}

check_folder() {
  local odd='[^[:alnum:]_./+@~=,-]'
  [[ $root =~ $odd ]] && refuse "catkin cannot build in \"$root\": the path holds \"${BASH_REMATCH[0]}\"." \
    "Move the folder to a path of letters, digits and _ . - + @ only."
  [ ${#root} -le 200 ] || refuse "the path of this folder is ${#root} characters long; scripts stop working beyond 200."
  [ -w "$root" ] || refuse "\"$root\" is not writable for $(id -un)."
}
